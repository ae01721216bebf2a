//! The tabulated effect of a result, and the closed-form term nearest to it.

use crate::addition::{Addition, Tabulated};
use crate::answer::AnswerParts;
use crate::estimate::with_three_digits;
use crate::result::Unexplained;
use augsim_system::NORMAL_95;

/// Text of the closed-form term nearest to a table, by least squares over its knots weighted by their
/// precisions.
fn closed_term(law: &Tabulated, values: &[f64], sd: &[f64]) -> String {
    let (n, table) = (values.len(), &law.table);
    let x: Vec<f64> =
        (0..n).map(|i| table.first + (table.last - table.first) * i as f64 / (n - 1) as f64).collect();
    let weight: Vec<f64> = sd.iter().map(|s| 1.0 / (s * s).max(1e-18)).collect();
    let name = &law.feature.name;
    type Shape<'s> = (String, Box<dyn Fn(f64) -> f64 + 's>);
    let mut shapes: Vec<Shape<'_>> = vec![
        (name.to_string(), Box::new(|v| v)),
        (format!("{name}²"), Box::new(|v| v * v)),
        (format!("sqrt|{name}|"), Box::new(|v: f64| v.abs().sqrt())),
        (format!("|{name}|"), Box::new(|v: f64| v.abs())),
    ];
    // A pole between the knots is not a plausible effect.
    if table.first * table.last > 0.0 {
        shapes.push((format!("1/{name}"), Box::new(|v| 1.0 / v)));
    }
    for i in 0..n - 1 {
        let edge = 0.5 * (x[i] + x[i + 1]);
        shapes.push((format!("step({name} > {edge:.3})"), Box::new(move |v| f64::from(u8::from(v > edge)))));
    }
    let mut best: Option<(f64, String)> = None;
    for (label, f) in shapes {
        let basis: Vec<f64> = x.iter().map(|&v| f(v)).collect();
        if basis.iter().any(|b| !b.is_finite()) {
            continue;
        }
        let sum = |g: &dyn Fn(usize) -> f64| (0..n).map(|i| weight[i] * g(i)).sum::<f64>();
        let (w, b, bb) = (sum(&|_| 1.0), sum(&|i| basis[i]), sum(&|i| basis[i] * basis[i]));
        let (y, by) = (sum(&|i| values[i]), sum(&|i| basis[i] * values[i]));
        let det = w * bb - b * b;
        if det <= 1e-12 * w * bb {
            continue;
        }
        let (slope, offset) = ((w * by - b * y) / det, (bb * y - b * by) / det);
        let squared_residuals = sum(&|i| (values[i] - offset - slope * basis[i]).powi(2));
        if best.as_ref().is_none_or(|(m, _)| squared_residuals < *m) {
            let (target, sign) = (&law.target.quantity.name, if slope < 0.0 { '-' } else { '+' });
            let [offset, slope] = [offset, slope.abs()].map(with_three_digits);
            best = Some((squared_residuals, format!("{target} += {offset} {sign} {slope} * {label}")));
        }
    }
    best.map_or_else(String::new, |b| b.1)
}

/// Describes a tabulated effect for the result, from the values at its knots and their standard deviations.
fn table_in_result(law: &Tabulated, values: &[f64], sd: &[f64]) -> Unexplained {
    let table = &law.table;
    let step = (table.last - table.first) / (table.knots - 1) as f64;
    Unexplained {
        place: law.target.location.clone(),
        target: law.target.quantity.name.clone(),
        feature: law.feature.name.clone(),
        term: closed_term(law, values, sd),
        table: (0..table.knots).map(|i| [table.first + step * i as f64, values[i], sd[i]]).collect(),
    }
}

/// The effect of a result that the library does not have: the first table of the final set; `None` without
/// tables.
pub(crate) fn unexplained(parts: &AnswerParts<'_>) -> Option<Unexplained> {
    let set = parts.full;
    let (h, theta, ci95) = (&set.fit.hypothesis, &set.fit.theta, set.ci95());
    for (n, a) in h.additions.iter().enumerate() {
        if let Addition::Table(law) = a {
            let range = h.entries_of_addition(n);
            let sd: Vec<f64> = range.clone().map(|i| (ci95[i][1] - ci95[i][0]) / (2.0 * NORMAL_95)).collect();
            return Some(table_in_result(law, &theta[range], &sd));
        }
    }
    None
}
