//! The view of a prefix: how many rows, which columns, how well.

use crate::Usage;
use crate::prefix_length::Seen;
use crate::usage::{Inapplicable, Takes, UnknownName};
use augsim_trainer::filter::Sensor;
use std::str::FromStr;

impl FromStr for Seen {
    type Err = Usage;

    fn from_str(word: &str) -> Result<Self, Usage> {
        let refuse = || Usage::option("--seen", word, Takes::PrefixLength);
        match word.strip_suffix('s') {
            None => word.parse().map(Seen::Rows).map_err(|_| refuse()),
            Some(seconds) => {
                let s: f64 = seconds.trim().parse().map_err(|_| refuse())?;
                if s.is_finite() && s >= 0.0 { Ok(Seen::Seconds(s)) } else { Err(refuse()) }
            }
        }
    }
}

/// Columns that are seen, and their noise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct View {
    /// The columns; all where none is named.
    pub columns: Vec<String>,
    /// Standard deviations: one number for every column, or `column=number` each.
    pub sensor_sd: Vec<String>,
}

impl View {
    /// The sensor of a model with these columns; 0 where no deviation is stated.
    ///
    /// # Errors
    /// A column that is not there, or a deviation that is no number of 0 or more.
    pub fn sensor(&self, columns: &[String]) -> anyhow::Result<Sensor> {
        let place = |option: &'static str, name: &str| {
            let known = || UnknownName::Column { option, name: name.to_owned(), known: columns.to_vec() };
            columns.iter().position(|c| c == name).ok_or_else(|| Usage::Unknown(known()))
        };
        let all = self.columns.is_empty();
        let mut sd: Vec<Option<f64>> = vec![all.then_some(0.0); columns.len()];
        for name in &self.columns {
            sd[place("--seen-columns", name)?] = Some(0.0);
        }
        for word in &self.sensor_sd {
            let (name, number) = word.split_once('=').map_or((None, word.as_str()), |(n, v)| (Some(n), v));
            let value = number.trim().parse().ok().filter(|v: &f64| v.is_finite() && *v >= 0.0);
            let value = value.ok_or_else(|| Usage::option("--sensor-sd", word, Takes::Deviation))?;
            match name {
                None => sd.iter_mut().flatten().for_each(|sd| *sd = value),
                Some(name) => {
                    let seen = &mut sd[place("--sensor-sd", name)?];
                    if seen.is_none() {
                        let (word, column) = (word.clone(), name.to_owned());
                        return Err(Usage::Inapplicable(Inapplicable::SensorOfUnseen { word, column }).into());
                    }
                    *seen = Some(value);
                }
            }
        }
        Ok(Sensor::new(sd)?)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: what is typed means one thing, or is refused with what may be typed.
    use super::*;

    #[test]
    fn samples_are_counted_and_seconds_are_measured_from_the_first_sample() {
        let times = [0.5, 0.6, 0.7, 0.8];
        let rows = |word: &str| word.parse::<Seen>().map(|s| s.rows(&times)).map_err(|e| e.to_string());
        assert_eq!((rows("3"), rows("0.2s"), rows("0s"), rows("9s")), (Ok(3), Ok(3), Ok(1), Ok(4)));
        for wrong in ["0.2", "-1", "-1s", "NaNs", "", "s", "three"] {
            assert!(rows(wrong).is_err_and(|e| e.contains("such as 65")), "{wrong}");
        }
    }

    #[test]
    fn deviations_belong_to_columns_that_are_seen() {
        let columns = ["height_m".to_owned(), "velocity_m_s".to_owned()];
        let sensor = |seen: &[&str], sd: &[&str]| {
            let words = |list: &[&str]| list.iter().map(|w| (*w).to_owned()).collect();
            View { columns: words(seen), sensor_sd: words(sd) }.sensor(&columns)
        };
        let sd = |seen: &[&str], sd: &[&str]| sensor(seen, sd).map(|s| s.sd().to_vec()).ok();
        assert_eq!(sd(&[], &[]), Some(vec![Some(0.0), Some(0.0)]));
        assert_eq!(sd(&["height_m"], &["0.002"]), Some(vec![Some(0.002), None]));
        assert_eq!(sd(&[], &["velocity_m_s=0.1"]), Some(vec![Some(0.0), Some(0.1)]));
        for (seen, sd) in [(&["x_m"][..], "0"), (&[], "-1"), (&["height_m"], "velocity_m_s=1"), (&[], "z=1")]
        {
            assert!(sensor(seen, &[sd]).is_err(), "{seen:?} {sd}");
        }
    }
}
