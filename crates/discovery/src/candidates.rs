//! Which effects and laws the data allow to look for.

use crate::addition::{Addition, KNOTS};
use crate::evaluate::Event;
use crate::hypothesis::Hypothesis;
use crate::record::Measured;
use augsim_physics::ball::{Axes, RADIUS, RESTITUTION};
use augsim_physics::effects::{Against, Location, Needs, SCATTER_KIND, Table, Target, all, spec_of};
use augsim_physics::model::{Model, Per, Release};

/// Most groups for which an effect is offered with one value a group: beyond, that is a description, not a law.
const MOST_GROUPS: usize = 20;

/// Library effects that these data can speak about; with several groups each in two variants. The scatter of restitution is
/// tried by another rule.
pub(crate) fn library(model: &Model, data: &Measured) -> Vec<Addition> {
    let mut out = Vec::new();
    let horizontal = data.axes != Axes::Vertical;
    let radius_known =
        model.parameters[RADIUS].nominal > 0.0 || data.records.iter().all(|r| r.radius_m.is_some());
    for effect in all::<f64>() {
        let spec = effect.spec();
        let declared =
            model.effects.iter().any(|b| b.kind == spec.kind || spec.excludes.contains(&b.kind.as_str()));
        let possible = match spec.needs {
            Needs::Nothing => true,
            Needs::Horizontal => horizontal,
            Needs::Slip => horizontal && (!data.has_spin || radius_known),
            Needs::Lateral => data.axes == Axes::Space,
            Needs::Spin => data.has_spin && horizontal,
            Needs::SpinInSpace => data.has_spin && data.axes == Axes::Space,
            Needs::StartTime => data.has_start_time,
            Needs::AreaPerMass => area_per_mass_varies(data),
            Needs::ReleaseAtRest => model.release == Release::Rest,
            Needs::Coasting => false,
        } && (spec.location != Location::Impact || data.has_impacts());
        let known = model.parameters.iter().any(|p| spec.same_as == Some(p.name.as_str()) && !p.frozen);
        if possible && !declared && !known {
            out.push(Addition::Kind(spec.kind, Per::All));
            if (2..=MOST_GROUPS).contains(&data.groups.len())
                && data.groups.len() < data.records.len()
                && spec.joins.is_none()
            {
                out.push(Addition::Kind(spec.kind, Per::Group));
            }
        }
    }
    out
}

/// Whether size and mass are known and make a difference: in balls that are all alike a coefficient is what drag per metre is.
fn area_per_mass_varies(data: &Measured) -> bool {
    let ratios = || data.records.iter().map(|r| r.covariates.area_per_mass_m2_kg);
    let (low, high) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
    low > 0.0 && high > 1.05 * low
}

/// Whether an addition may join a hypothesis.
pub(crate) fn may_join(addition: &Addition, h: &Hypothesis) -> bool {
    if h.additions.iter().any(|a| a == addition || a.excludes(addition)) {
        return false;
    }
    if addition.kind() == SCATTER_KIND && h.scatter.is_some() {
        return false;
    }
    let joins = spec_of(addition.kind()).is_some_and(|s| s.joins.is_some());
    !joins || h.additions.iter().any(|a| addition.acts_through(a))
}

/// One-feature laws over the features that vary in these data; knots between the 1 % and 99 % quantiles.
pub(crate) fn laws(model: &Model, data: &Measured, impacts: &[Vec<Event>]) -> Vec<Addition> {
    let horizontal = data.axes != Axes::Vertical;
    let mut pairs: Vec<(Target, Against)> = vec![
        (Target::AccelerationZ, Against::Z),
        (Target::AccelerationZ, Against::Time),
        (Target::SensorZ, Against::Z),
        (Target::SensorZ, Against::VelocityZ),
        (Target::Drag, Against::Speed),
        (Target::Drag, Against::Time),
    ];
    let impact_laws = data.has_impacts() && !model.parameters[RESTITUTION].frozen;
    if impact_laws {
        for against in [Against::NormalSpeed, Against::Time, Against::Bounce] {
            pairs.push((Target::Restitution, against));
        }
        if data.has_start_time {
            pairs.push((Target::Restitution, Against::Clock));
        }
    }
    if horizontal {
        use Against::*;
        use Target::*;
        pairs.extend([
            (AccelerationZ, X),
            (AccelerationX, X),
            (AccelerationX, Time),
            (AccelerationX, Z),
            (AccelerationX, VelocityX),
            (SensorZ, X),
            (SensorX, X),
            (SensorX, Z),
            (SensorX, VelocityX),
        ]);
        if data.has_start_time {
            pairs.extend([(AccelerationX, Clock), (AccelerationZ, Clock)]);
        }
        if impact_laws {
            pairs.extend([
                (Restitution, X),
                (Restitution, TangentialSpeed),
                (Restitution, Slip),
                (TangentialJump, Slip),
                (TangentialJump, X),
                (TangentialJump, NormalSpeed),
            ]);
            if data.has_spin {
                pairs.push((Restitution, Spin));
            }
        }
        if data.has_spin {
            pairs.extend([(Magnus, Time), (Magnus, Speed)]);
        }
    }
    if data.axes == Axes::Space {
        pairs.extend([(Target::AccelerationY, Against::Y), (Target::AccelerationY, Against::Time)]);
    }
    pairs
        .into_iter()
        .filter_map(|(target, against)| {
            let (first, last) = span(target, against, data, impacts)?;
            Some(Addition::Law(Table { target, against, first, last }))
        })
        .collect()
}

/// 1 % and 99 % quantiles of a feature; `None` if it hardly varies.
fn span(target: Target, against: Against, data: &Measured, impacts: &[Vec<Event>]) -> Option<(f64, f64)> {
    let mut x: Vec<f64> = if target.location() == Location::Impact {
        impacts.iter().flatten().map(|event| event.feature(against)).collect()
    } else {
        let axes = data.axes.indices();
        let channel = |axis: usize| axes.iter().position(|&a| a == axis);
        let mut out = Vec::new();
        for r in &data.records {
            for a in &r.arcs {
                for k in a.clone().skip(1) {
                    let y = |axis: usize, k: usize| channel(axis).map_or(0.0, |c| r.y[c][k]);
                    let rate = |axis: usize| {
                        // Over a few samples: single differences are all noise.
                        let (low, high) = (a.start.max(k.saturating_sub(4)), (k + 4).min(a.end - 1));
                        (y(axis, high) - y(axis, low)) / (r.times[high] - r.times[low])
                    };
                    out.push(match against {
                        Against::Time => r.times[k],
                        Against::Clock => r.times[k] + r.covariates.clock_s,
                        Against::X => y(0, k),
                        Against::Y => y(1, k),
                        Against::Z => y(2, k),
                        Against::VelocityX => rate(0),
                        Against::VelocityZ => rate(2),
                        _ => (0..3).map(|axis| rate(axis).powi(2)).sum::<f64>().sqrt(),
                    });
                }
            }
        }
        out
    };
    x.retain(|v| v.is_finite());
    if x.len() < 3 * KNOTS {
        return None;
    }
    x.sort_by(f64::total_cmp);
    let (first, last) = (crate::statistics::quantile(&x, 0.01), crate::statistics::quantile(&x, 0.99));
    (last - first > 1e-6 * (1.0 + first.abs())).then_some((first, last))
}
