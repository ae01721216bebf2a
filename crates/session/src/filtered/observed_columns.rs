//! Options of the observed prefix: its length, the observed columns and their measurement noise.

use crate::Usage;
use crate::prefix_length::PrefixLength;
use crate::usage::{Inapplicable, Takes, UnknownName};
use augsim_trainer::filter::Sensor;
use std::str::FromStr;

impl FromStr for PrefixLength {
    type Err = Usage;

    fn from_str(word: &str) -> Result<Self, Usage> {
        let refuse = || Usage::option("--seen", word, Takes::PrefixLength);
        match word.strip_suffix('s') {
            None => word.parse().map(PrefixLength::Rows).map_err(|_| refuse()),
            Some(seconds) => {
                let s: f64 = seconds.trim().parse().map_err(|_| refuse())?;
                if s.is_finite() && s >= 0.0 { Ok(PrefixLength::Seconds(s)) } else { Err(refuse()) }
            }
        }
    }
}

/// User options on the columns that a filter observes, and on their measurement noise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ObservedColumns {
    /// Names of the observed columns; empty means all.
    pub columns: Vec<String>,
    /// Standard deviations of the noise: one number for all columns, or `column=number` for one.
    pub sensor_sd: Vec<String>,
}

impl ObservedColumns {
    /// Builds the sensor of a model with these columns; a standard deviation that is not given is 0.
    ///
    /// # Errors
    /// An unknown column, or a standard deviation that is not a number of at least 0.
    pub fn sensor(&self, columns: &[String]) -> anyhow::Result<Sensor> {
        let index_of = |option: &'static str, name: &str| {
            let known = || UnknownName::Column { option, name: name.to_owned(), known: columns.to_vec() };
            columns.iter().position(|c| c == name).ok_or_else(|| Usage::Unknown(known()))
        };
        let is_all = self.columns.is_empty();
        let mut sd: Vec<Option<f64>> = vec![is_all.then_some(0.0); columns.len()];
        for name in &self.columns {
            sd[index_of("--seen-columns", name)?] = Some(0.0);
        }
        for word in &self.sensor_sd {
            let (name, number) = word.split_once('=').map_or((None, word.as_str()), |(n, v)| (Some(n), v));
            let value = number.trim().parse().ok().filter(|v: &f64| v.is_finite() && *v >= 0.0);
            let value = value.ok_or_else(|| Usage::option("--sensor-sd", word, Takes::Deviation))?;
            match name {
                None => sd.iter_mut().flatten().for_each(|sd| *sd = value),
                Some(name) => {
                    let column_sd = &mut sd[index_of("--sensor-sd", name)?];
                    if column_sd.is_none() {
                        let (word, column) = (word.clone(), name.to_owned());
                        return Err(
                            Usage::Inapplicable(Inapplicable::SensorOfUnobserved { word, column }).into()
                        );
                    }
                    *column_sd = Some(value);
                }
            }
        }
        Ok(Sensor::new(sd)?)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: option values are parsed unambiguously, or refused with a list of valid forms.
    use super::*;

    #[test]
    fn prefix_is_a_sample_count_or_seconds_from_the_first_sample() {
        let times = [0.5, 0.6, 0.7, 0.8];
        let rows =
            |word: &str| word.parse::<PrefixLength>().map(|s| s.rows(&times)).map_err(|e| e.to_string());
        assert_eq!((rows("3"), rows("0.2s"), rows("0s"), rows("9s")), (Ok(3), Ok(3), Ok(1), Ok(4)));
        for wrong in ["0.2", "-1", "-1s", "NaNs", "", "s", "three"] {
            assert!(rows(wrong).is_err_and(|e| e.contains("such as 65")), "{wrong}");
        }
    }

    #[test]
    fn standard_deviations_are_accepted_for_observed_columns_only() {
        let columns = ["height_m".to_owned(), "velocity_m_s".to_owned()];
        let sensor = |seen: &[&str], sd: &[&str]| {
            let words = |list: &[&str]| list.iter().map(|w| (*w).to_owned()).collect();
            ObservedColumns { columns: words(seen), sensor_sd: words(sd) }.sensor(&columns)
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
