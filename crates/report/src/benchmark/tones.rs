//! Assignment of colours to the models of a report.

use super::{BenchmarkReport, Protocol};
use crate::figure::Tone;

/// Models of a report in the order of their colours; the subject has the first one.
pub(super) struct Tones<'a>(Vec<&'a str>);

impl<'a> Tones<'a> {
    pub(super) fn from_report(report: &'a BenchmarkReport) -> Self {
        let curves = report.errors.iter().filter(|e| e.protocol != Protocol::Floor).map(|e| &e.model);
        let forecasts = report.forecasts.iter().map(|f| &f.model);
        let learning = report.learning.iter().map(|l| &l.model);
        let mut names = vec![report.subject.as_str()];
        // Trained models come before baselines, so that they get the most distinct colours.
        for name in learning.chain(forecasts).chain(curves) {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        Self(names)
    }

    pub(super) fn get(&self, model: &str) -> Tone {
        let index = self.0.iter().position(|name| *name == model);
        index.and_then(|i| u8::try_from(i).ok()).map_or(Tone::Muted, Tone::Series)
    }
}

/// Distinct values of `key` over the items, in order of appearance.
pub(super) fn distinct<'a, T>(items: &'a [T], key: impl Fn(&'a T) -> &'a str) -> Vec<&'a str> {
    let mut distinct = Vec::new();
    for item in items.iter().map(key) {
        if !distinct.contains(&item) {
            distinct.push(item);
        }
    }
    distinct
}
