//! SVG path data of polylines with gaps and of areas between two lines, simplified to screen resolution.

use super::text::coordinate;

/// A point of a figure, in pixels.
pub(crate) type Point = (f64, f64);

/// Largest distance by which simplification may move a line, px.
const TOLERANCE: f64 = 0.12;

/// Splits points at missing values into runs without gaps.
pub(crate) fn runs(points: impl IntoIterator<Item = Option<Point>>) -> Vec<Vec<Point>> {
    let mut runs = vec![Vec::new()];
    for point in points {
        match (point, runs.last_mut()) {
            (Some(p), Some(run)) => run.push(p),
            (None, Some(run)) if !run.is_empty() => runs.push(Vec::new()),
            _ => {}
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// SVG path data of a polyline; a run of one point becomes a dot (zero-length line with round caps).
pub(crate) fn line(runs: &[Vec<Point>]) -> String {
    let mut d = String::new();
    for run in runs {
        push(&mut d, &thin(run));
        if run.len() == 1 {
            d.push_str("h0");
        }
    }
    d
}

/// SVG path data of the areas between a lower and an upper line, one area per run without gaps.
pub(crate) fn area(pairs: impl IntoIterator<Item = Option<(f64, f64, f64)>>) -> String {
    let mut d = String::new();
    let mut lower: Vec<Point> = Vec::new();
    let mut upper: Vec<Point> = Vec::new();
    let mut close = |lower: &mut Vec<Point>, upper: &mut Vec<Point>| {
        if lower.len() > 1 {
            let mut outline = thin(upper);
            outline.extend(thin(lower).into_iter().rev());
            push(&mut d, &outline);
            d.push('z');
        }
        lower.clear();
        upper.clear();
    };
    for pair in pairs {
        match pair {
            Some((x, low, high)) => {
                lower.push((x, low));
                upper.push((x, high));
            }
            None => close(&mut lower, &mut upper),
        }
    }
    close(&mut lower, &mut upper);
    d
}

fn push(d: &mut String, points: &[Point]) {
    for (i, (x, y)) in points.iter().enumerate() {
        d.push(if i == 0 { 'M' } else { 'L' });
        d.push_str(&coordinate(*x));
        d.push(' ');
        d.push_str(&coordinate(*y));
    }
}

/// Reduces points to the extremes of each pixel column, then drops points on straight lines.
fn thin(points: &[Point]) -> Vec<Point> {
    simplify(&columns(points))
}

/// First, lowest, highest and last point of each pixel column, in their order.
fn columns(points: &[Point]) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::with_capacity(points.len());
    let mut column: Vec<Point> = Vec::new();
    let flush = |column: &mut Vec<Point>, kept: &mut Vec<Point>| {
        let y = |i: usize| column.get(i).map_or(0.0, |p: &Point| p.1);
        let lowest = (0..column.len()).min_by(|a, b| y(*a).total_cmp(&y(*b))).unwrap_or(0);
        let highest = (0..column.len()).max_by(|a, b| y(*a).total_cmp(&y(*b))).unwrap_or(0);
        let last = column.len().saturating_sub(1);
        kept.extend(
            (column.iter().enumerate())
                .filter(|(i, _)| [0, lowest, highest, last].contains(i))
                .map(|(_, p)| *p),
        );
        column.clear();
    };
    for point in points {
        if column.first().is_some_and(|first| first.0.floor() != point.0.floor()) {
            flush(&mut column, &mut kept);
        }
        column.push(*point);
    }
    flush(&mut column, &mut kept);
    kept
}

/// Simplifies a polyline by the Ramer-Douglas-Peucker algorithm, with an explicit stack.
///
/// Source: Ramer, Computer Graphics and Image Processing 1, 1972.
fn simplify(points: &[Point]) -> Vec<Point> {
    let mut keep = vec![false; points.len()];
    let mut stack = vec![(0, points.len().saturating_sub(1))];
    for end in [0, points.len().saturating_sub(1)] {
        if let Some(k) = keep.get_mut(end) {
            *k = true;
        }
    }
    while let Some((first, last)) = stack.pop() {
        let (Some(a), Some(b)) = (points.get(first), points.get(last)) else {
            continue;
        };
        let farthest = (first + 1..last)
            .filter_map(|i| points.get(i).map(|p| (distance(*p, *a, *b), i)))
            .max_by(|p, q| p.0.total_cmp(&q.0));
        if let Some((off, middle)) = farthest
            && off > TOLERANCE
        {
            if let Some(k) = keep.get_mut(middle) {
                *k = true;
            }
            stack.push((first, middle));
            stack.push((middle, last));
        }
    }
    points.iter().zip(keep).filter(|(_, k)| *k).map(|(p, _)| *p).collect()
}

/// Distance of `p` from the segment between `a` and `b`, px.
fn distance(p: Point, a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length = dx * dx + dy * dy;
    let s = if length > 0.0 { (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / length).clamp(0.0, 1.0) } else { 0.0 };
    (p.0 - a.0 - s * dx).hypot(p.1 - a.1 - s * dy)
}

#[cfg(test)]
mod tests {
    //! Contract: simplification keeps ends, extremes and gaps, and moves nothing visibly.
    use super::*;

    #[test]
    fn a_straight_line_keeps_its_two_ends() {
        let points: Vec<Point> = (0..1000).map(|i| (f64::from(i) * 0.3, f64::from(i) * 0.1)).collect();
        assert_eq!(line(&[points]), "M0 0L299.7 99.9");
    }

    #[test]
    fn gaps_split_and_single_points_are_dots() {
        let d = line(&runs([Some((0.0, 0.0)), Some((5.0, 1.0)), None, None, Some((9.0, 2.0))]));
        assert_eq!(d, "M0 0L5 1M9 2h0");
    }

    #[test]
    fn a_spike_in_a_dense_line_is_kept() {
        let points: Vec<Point> =
            (0..10_000).map(|i| (f64::from(i) * 0.02, if i == 5003 { 50.0 } else { 0.0 })).collect();
        assert!(line(&[points]).contains(" 50"));
    }

    #[test]
    fn areas_are_closed_at_gaps() {
        let d = area([Some((0.0, 0.0, 2.0)), Some((4.0, 0.0, 2.0)), None, Some((6.0, 0.0, 1.0))]);
        assert_eq!(d, "M0 2L4 2L4 0L0 0z");
    }
}
