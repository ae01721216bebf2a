//! Maps from data values to pixels, linear or logarithmic.

use super::{text, ticks};
use crate::figure::{Axis, Scale as Kind};

/// Magnitude from which values count as missing, since their differences could overflow.
const MAX_MAGNITUDE: f64 = 1e150;

/// Whether a value is finite and small enough to be drawn.
pub(crate) fn drawable(value: f64) -> bool {
    value.is_finite() && value.abs() < MAX_MAGNITUDE
}

/// Smallest and largest value that can be drawn; `None` if there is none.
pub(crate) fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().filter(|v| drawable(*v)).fold(None, |range, v| match range {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

/// A map from a range of data values to a range of pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    kind: Kind,
    pub(crate) low: f64,
    pub(crate) high: f64,
    start: f64,
    end: f64,
    integer: bool,
}

impl Scale {
    /// Fits the scale of an axis to data, padded by `pad` of their range unless the axis has its own domain.
    ///
    /// `None` if nothing can be drawn: no data, or no positive data on a logarithmic axis.
    pub(crate) fn fit(
        axis: &Axis,
        values: impl IntoIterator<Item = f64>,
        pad: f64,
        pixels: (f64, f64),
    ) -> Option<Self> {
        let log = axis.scale == Kind::Log;
        let valid = values.into_iter().filter(|v| !log || *v > 0.0);
        let (mut low, mut high) = extent(valid)?;
        if axis.include_zero && !log {
            (low, high) = (low.min(0.0), high.max(0.0));
        }
        if low == high && log {
            (low, high) = (low / 2.0, high * 2.0);
        } else if low == high {
            let half = if low == 0.0 { 1.0 } else { low.abs() * 0.1 };
            (low, high) = (low - half, high + half);
        } else if log {
            let margin = (high / low).powf(pad);
            (low, high) = (low / margin, high * margin);
        } else {
            let margin = (high - low) * pad;
            // If the axis ends at zero because it must include it, no padding is added at that end.
            low = if low == 0.0 && axis.include_zero { 0.0 } else { low - margin };
            high = if high == 0.0 && axis.include_zero { 0.0 } else { high + margin };
        }
        if let Some([a, b]) = axis.domain
            && drawable(a)
            && drawable(b)
            && a < b
            && (!log || a > 0.0)
        {
            (low, high) = (a, b);
        }
        Some(Self { kind: axis.scale, low, high, start: pixels.0, end: pixels.1, integer: axis.integer })
    }

    /// Maps the same data range to other pixels.
    pub(crate) fn with_pixels(self, start: f64, end: f64) -> Self {
        Self { start, end, ..self }
    }

    /// Pixel position of `value`; `None` if it cannot be drawn.
    ///
    /// Values far outside the range are moved to one range width beyond it, so that clipped marks have no
    /// huge coordinates.
    pub(crate) fn pixel(&self, value: f64) -> Option<f64> {
        if !drawable(value) || (self.kind == Kind::Log && value <= 0.0) {
            return None;
        }
        let fraction = match self.kind {
            Kind::Linear => (value - self.low) / (self.high - self.low),
            Kind::Log => (value / self.low).ln() / (self.high / self.low).ln(),
        };
        Some(self.start + fraction.clamp(-1.0, 2.0) * (self.end - self.start))
    }

    /// Whether `value` lies in the data range of the scale.
    pub(crate) fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Tick values with their labels, and the power of ten taken out of all labels (0 for none).
    pub(crate) fn ticks(&self, target: usize) -> (Vec<(f64, String)>, i32) {
        match self.kind {
            Kind::Linear => {
                let is_allowed =
                    |positions: &Vec<f64>| !self.integer || positions.iter().all(|t| t.fract() == 0.0);
                let positions = (2..=target.max(2))
                    .rev()
                    .map(|target| ticks::linear(self.low, self.high, target))
                    .find(is_allowed)
                    .unwrap_or_else(|| ticks::linear(self.low, self.high, target));
                let power = common_power(self.low.abs().max(self.high.abs()));
                let shown: Vec<f64> = positions.iter().map(|t| t / 10f64.powi(power)).collect();
                let decimals = ticks::decimals(&shown);
                let labels = shown.iter().map(|t| text::fixed(*t, decimals));
                (positions.iter().copied().zip(labels).collect(), power)
            }
            Kind::Log => {
                let positions = ticks::logarithmic(self.low, self.high, target);
                let is_plain = positions.iter().all(|t| (0.0009..20_000.0).contains(t));
                let label = |t: f64| {
                    let mantissa = t / 10f64.powi(t.log10().floor() as i32);
                    if is_plain {
                        text::fixed(t, ticks::decimals(&[t]))
                    } else if (mantissa - 1.0).abs() < 1e-6 || (mantissa - 10.0).abs() < 1e-6 {
                        format!("10{}", text::superscript(t.log10().round() as i32))
                    } else {
                        text::significant(t, 1)
                    }
                };
                (positions.iter().map(|t| (*t, label(*t))).collect(), 0)
            }
        }
    }
}

/// Power of ten, a multiple of three, taken out of very small or large tick labels; 0 for others.
fn common_power(largest: f64) -> i32 {
    if largest > 0.0 && !(0.01..1e6).contains(&largest) {
        (largest.log10() / 3.0).floor() as i32 * 3
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    //! Contract: for any data, a scale maps to finite pixels, or there is no scale.
    use super::*;

    #[test]
    fn no_constant_and_non_finite_data_are_handled() {
        let axis = Axis::linear("height", "m");
        assert!(Scale::fit(&axis, [f64::NAN, f64::INFINITY], 0.05, (0.0, 1.0)).is_none());
        let constant = Scale::fit(&axis, [0.0, 0.0], 0.05, (0.0, 10.0)).expect("constant data have a scale");
        assert_eq!(constant.pixel(0.0), Some(5.0));
        assert_eq!(constant.pixel(f64::NAN), None);
        assert!(Scale::fit(&Axis::log("loss", ""), [0.0, -1.0], 0.05, (0.0, 1.0)).is_none());
    }

    #[test]
    fn far_outliers_have_bounded_coordinates() {
        let axis = Axis::linear("height", "m").with_domain(0.0, 1.0);
        let scale = Scale::fit(&axis, [0.0, 1e9], 0.0, (0.0, 100.0)).expect("data");
        assert_eq!(scale.pixel(1e9), Some(200.0));
    }

    #[test]
    fn tiny_values_put_their_power_of_ten_into_the_label() {
        let scale = Scale::fit(&Axis::linear("residual", "m"), [0.0, 4e-4], 0.0, (0.0, 1.0)).expect("data");
        let (ticks, power) = scale.ticks(5);
        assert_eq!(power, -6);
        assert_eq!(ticks.last().map(|t| t.1.as_str()), Some("400"));
    }
}
