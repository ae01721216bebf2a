//! Section of the report on groups of recordings: which parameters they share, and a forest plot of each other one.

use augsim_discovery::{Discovery, Estimate, GroupDistribution};
use augsim_report::figure::{Axis, Bar, BarGroup, BarShape, Bars, Reference, Tone};
use augsim_report::page::{Block, FigureBlock, significant};
use std::collections::BTreeMap;

/// The parameters with values by group, and the text on those that all groups share; empty without values by group.
pub(super) fn blocks(d: &Discovery) -> Vec<Block> {
    let of_effects = d.effects.iter().flat_map(|e| e.parameters.iter().map(move |p| (e.kind.as_str(), p)));
    let plots: Vec<Block> = by_group(&d.parameters)
        .map(|(name, estimate)| plot(name, estimate))
        .chain(
            // Groupwise values of a declared parameter are listed with the declared parameters.
            of_effects
                .filter(|(_, (name, estimate))| {
                    !estimate.groups.is_empty() && !d.parameters.contains_key(*name)
                })
                .map(|(kind, (name, estimate))| plot(&format!("{name} of {kind}"), estimate)),
        )
        .collect();
    if plots.is_empty() {
        return plots;
    }
    let shared = d.parameters.iter().filter(|(_, e)| e.groups.is_empty());
    let shared: Vec<String> = shared.map(|(name, _)| format!("`{name}`")).collect();
    let text = match &shared[..] {
        [] => "No parameter is shared by all groups.".to_owned(),
        names => format!("Shared by all groups: {}.", names.join(", ")),
    };
    [Block::Prose(text)].into_iter().chain(plots).collect()
}

/// The estimates that have values by group, by name.
fn by_group(estimates: &BTreeMap<String, Estimate>) -> impl Iterator<Item = (&String, &Estimate)> {
    estimates.iter().filter(|(_, estimate)| !estimate.groups.is_empty())
}

/// Forest plot of a parameter: its value for each group with its 95 % interval, and the mean over groups.
fn plot(name: &str, estimate: &Estimate) -> Block {
    let outlying = estimate.distribution.as_ref().map_or(&[][..], |d| &d.outlying);
    let bar = |(group, e): (&String, &Estimate)| Bar {
        name: group.clone(),
        tone: if outlying.contains(group) { Tone::Series(1) } else { Tone::Series(0) },
        value: Some(e.value),
        interval: Some(e.ci95).filter(|[low, high]| low < high),
    };
    let mean = estimate.distribution.as_ref().map_or(estimate.value, |d| d.mean);
    let figure = Bars {
        title: format!("{name} by group"),
        value: Axis::linear(name, &estimate.unit),
        groups: vec![BarGroup { label: String::new(), bars: estimate.groups.iter().map(bar).collect() }],
        references: vec![Reference { value: mean, label: "mean".to_owned() }],
        shape: BarShape::Dot,
    };
    let caption = match &estimate.distribution {
        None => {
            "Values with 95 % intervals; with fewer than five groups their distribution is not estimated."
                .to_owned()
        }
        Some(over_groups) => caption(over_groups, &estimate.unit),
    };
    Block::Figure(Box::new(FigureBlock { figure: figure.into(), caption }))
}

/// Caption of a forest plot: the distribution over groups, and the groups that do not belong to it.
fn caption(over_groups: &GroupDistribution, unit: &str) -> String {
    let with_unit = |value: f64| format!("{} {unit}", significant(value, 3)).trim_end().to_owned();
    let [low, high] = over_groups.sd_ci95.map(with_unit);
    let outlying: Vec<String> = over_groups.outlying.iter().map(|name| format!("`{name}`")).collect();
    let outlying = match &outlying[..] {
        [] => "No group is an outlier of this distribution.".to_owned(),
        [one] => format!("{one} does not belong to the distribution of the others."),
        several => format!("{} do not belong to the distribution of the others.", several.join(", ")),
    };
    format!(
        "Values with 95 % intervals. Over groups: mean {}, standard deviation {} (95 % interval {low} to {high}). {outlying}",
        with_unit(over_groups.mean),
        with_unit(over_groups.sd)
    )
}
