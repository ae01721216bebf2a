//! Curves of scores over settings: mean and interval over the tasks that share a setting value.

use super::file::Value;
use super::row::Row;
use serde::Serialize;
use std::collections::BTreeMap;

/// Name of the setting of the seed, whose values are repetitions of an experiment.
const SEED: &str = "seed";
/// Maximum number of series in one figure, so that they stay distinguishable.
const MAX_SERIES: usize = 5;

/// Curve of one score over one setting that has several values in the sweep.
#[derive(Debug, Clone, Serialize)]
pub struct Curve {
    /// Name of the score.
    pub score: String,
    /// Name of the setting on the horizontal axis.
    pub over: String,
    /// Names of the settings with a series for each value; the score is averaged over all other settings.
    pub by: Vec<String>,
    /// Series of the curve, one per combination of values of the settings in `by`.
    pub series: Vec<Series>,
}

/// One series of a curve: the score over the setting for fixed values of other settings.
#[derive(Debug, Clone, Serialize)]
pub struct Series {
    /// Name of the series: values of the settings in `by`; empty if there are none.
    pub name: String,
    /// Points of the series, in the order of the setting's values.
    pub points: Vec<Point>,
}

/// A point of a series: the score at one value of the setting.
#[derive(Debug, Clone, Serialize)]
pub struct Point {
    /// Value of the setting on the horizontal axis.
    pub at: Value,
    /// Statistics of the score over the tasks with this value.
    #[serde(flatten)]
    pub summary: Summary,
}

/// Statistics of a score over several tasks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Number of tasks with the score.
    pub tasks: usize,
    /// Mean of the score.
    pub mean: f64,
    /// Standard deviation of the score between tasks; `None` for one task.
    pub sd: Option<f64>,
    /// 95 % interval of the mean, from Student's distribution; `None` for one task.
    pub ci95: Option<[f64; 2]>,
    /// Smallest value of the score.
    pub min: f64,
    /// Largest value of the score.
    pub max: f64,
}

impl Summary {
    /// Computes the statistics of these values; `None` if there are none.
    pub fn from_values(values: &[f64]) -> Option<Self> {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        let sd = (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt());
        let half = sd.map(|sd| student_975(values.len() - 1) * sd / n.sqrt());
        Some(Summary {
            tasks: values.len(),
            mean,
            sd,
            ci95: half.map(|half| [mean - half, mean + half]),
            min: values.iter().copied().reduce(f64::min)?,
            max: values.iter().copied().reduce(f64::max)?,
        })
    }
}

/// Returns the 0.975 quantile of Student's distribution with `degrees` degrees of freedom.
///
/// Beyond the table, the first two terms of its expansion in 1 / degrees (Abramowitz and Stegun 26.7.5) have
/// an error below 5e-4.
fn student_975(degrees: usize) -> f64 {
    const TABLE: [f64; 20] = [
        12.706_205, 4.302_653, 3.182_446, 2.776_445, 2.570_582, 2.446_912, 2.364_624, 2.306_004, 2.262_157,
        2.228_139, 2.200_985, 2.178_813, 2.160_369, 2.144_787, 2.131_450, 2.119_905, 2.109_816, 2.100_922,
        2.093_024, 2.085_963,
    ];
    let normal = 1.959_963_985_f64;
    match degrees.checked_sub(1).and_then(|k| TABLE.get(k)) {
        Some(&quantile) => quantile,
        None => {
            let n = degrees as f64;
            let first = (normal.powi(3) + normal) / (4.0 * n);
            let second = (5.0 * normal.powi(5) + 16.0 * normal.powi(3) + 3.0 * normal) / (96.0 * n * n);
            normal + first + second
        }
    }
}

/// Makes the curve of each numeric score over each setting with several values (`crossed`).
pub fn curves(rows: &[Row], crossed: &[String], scores: &[String]) -> Vec<Curve> {
    let mut curves = Vec::new();
    for score in scores {
        for over in crossed {
            curves.extend(curve(rows, crossed, score, over));
        }
    }
    curves
}

fn curve(rows: &[Row], crossed: &[String], score: &str, over: &str) -> Option<Curve> {
    let numbers: Vec<(&Row, f64)> = rows.iter().filter_map(|row| Some((row, row.number(score)?))).collect();
    if numbers.is_empty() {
        return None;
    }
    let by = split(&numbers, crossed, over);
    let mut series: BTreeMap<Vec<SortKey>, BTreeMap<SortKey, PointScores>> = BTreeMap::new();
    for (row, number) in numbers {
        let Some(at) = row.settings.get(over) else { continue };
        let values: Vec<SortKey> =
            by.iter().filter_map(|name| row.settings.get(*name)).map(SortKey::from_value).collect();
        let place = series.entry(values).or_default().entry(SortKey::from_value(at));
        place.or_insert_with(|| PointScores { at: at.clone(), scores: Vec::new() }).scores.push(number);
    }
    let point = |g: PointScores| Summary::from_values(&g.scores).map(|summary| Point { at: g.at, summary });
    let series = series.into_iter().map(|(values, points)| Series {
        name: values.iter().map(|value| value.1.as_str()).collect::<Vec<_>>().join(", "),
        points: points.into_values().filter_map(point).collect(),
    });
    let by = by.into_iter().cloned().collect();
    Some(Curve { score: score.to_owned(), over: over.to_owned(), by, series: series.collect() })
}

/// Chooses the settings that get a series per value.
///
/// They are the settings with several values except seeds, as many as fit in one figure.
fn split<'a>(rows: &[(&Row, f64)], crossed: &'a [String], over: &str) -> Vec<&'a String> {
    let mut by = Vec::new();
    let mut series = 1;
    for name in crossed.iter().filter(|name| *name != over && *name != SEED) {
        let mut values: Vec<String> =
            rows.iter().filter_map(|(row, _)| row.settings.get(name)).map(ToString::to_string).collect();
        values.sort_unstable();
        values.dedup();
        if values.len() > 1 && series * values.len() <= MAX_SERIES {
            series *= values.len();
            by.push(name);
        }
    }
    by
}

/// Scores of the tasks that share one value of the setting.
struct PointScores {
    at: Value,
    scores: Vec<f64>,
}

/// Sort key of setting values: numbers by size, then texts.
#[derive(Debug, Clone, PartialEq)]
struct SortKey(Option<f64>, String);

impl SortKey {
    fn from_value(value: &Value) -> Self {
        SortKey(value.number(), value.to_string())
    }
}

impl Eq for SortKey {}

impl PartialOrd for SortKey {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for SortKey {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let size = |key: &SortKey| key.0.unwrap_or(f64::INFINITY);
        size(self).total_cmp(&size(other)).then_with(|| self.1.cmp(&other.1))
    }
}

#[cfg(test)]
mod tests {
    //! Contract: means and intervals follow the textbook; a curve averages over seeds and separates other settings.
    use super::*;

    #[test]
    fn computes_the_student_interval_of_a_mean() {
        let s = Summary::from_values(&[1.0, 2.0, 3.0]).unwrap();
        assert_eq!((s.tasks, s.mean, s.sd), (3, 2.0, Some(1.0)));
        let [low, high] = s.ci95.unwrap();
        // t(0.975, 2) / sqrt(3) = 2.484138.
        assert!((low + 0.484_138).abs() < 1e-5 && (high - 4.484_138).abs() < 1e-5, "{low} {high}");
        assert_eq!(Summary::from_values(&[5.0]).unwrap().ci95, None);
        assert!(Summary::from_values(&[]).is_none());
    }

    #[test]
    fn approximates_quantiles_beyond_the_table() {
        // From tables: 21, 30, 60 and 120 degrees.
        for (degrees, quantile) in [(21, 2.079_614), (30, 2.042_272), (60, 2.000_298), (120, 1.979_930)] {
            assert!((student_975(degrees) - quantile).abs() < 1e-3, "{degrees}: {}", student_975(degrees));
        }
    }

    fn row(size: i64, net: &str, seed: i64, score: f64) -> Row {
        let settings = BTreeMap::from([
            ("size".to_owned(), Value::Integer(size)),
            ("net".to_owned(), Value::Text(net.to_owned())),
            ("seed".to_owned(), Value::Integer(seed)),
        ]);
        Row::done(settings, BTreeMap::from([("mm".to_owned(), serde_json::json!(score))]))
    }

    #[test]
    fn averages_over_seeds_and_separates_other_settings() {
        let rows = [
            row(1000, "a", 1, 4.0),
            row(250, "a", 1, 1.0),
            row(250, "a", 2, 3.0),
            row(1000, "b", 1, 7.0),
            row(250, "b", 1, 9.0),
        ];
        let names = ["net", "seed", "size"].map(str::to_owned);
        let all = curves(&rows, &names, &["mm".to_owned()]);
        let over_size = all.iter().find(|c| c.over == "size").unwrap();
        assert_eq!(over_size.by, ["net"]);
        let points = |k: usize| -> Vec<(String, usize, f64)> {
            over_size.series[k]
                .points
                .iter()
                .map(|p| (p.at.to_string(), p.summary.tasks, p.summary.mean))
                .collect()
        };
        assert_eq!((over_size.series[0].name.as_str(), over_size.series[1].name.as_str()), ("a", "b"));
        assert_eq!(points(0), [("250".to_owned(), 2, 2.0), ("1000".to_owned(), 1, 4.0)]);
        assert_eq!(points(1), [("250".to_owned(), 1, 9.0), ("1000".to_owned(), 1, 7.0)]);
        // Series with numeric names are sorted by number, not by digits.
        let over_net = all.iter().find(|c| c.over == "net").unwrap();
        assert_eq!(over_net.series.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["250", "1000"]);
    }
}
