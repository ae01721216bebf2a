//! Polynomial fit to one channel between two events: smooth motion lies in the span of low-degree
//! polynomials, and the residuals are noise.

use crate::linear::Square;
use crate::record::Record;

/// Samples of one channel of one record between two events, with the basis of a polynomial fit to them.
pub(crate) struct Arc {
    pub channel: usize,
    /// Measured values, in the unit of the channel.
    pub y: Vec<f64>,
    /// Legendre polynomials evaluated at the samples, `[sample][degree]`.
    pub basis: Vec<Vec<f64>>,
    /// Absolute rate of change of the fitted polynomial at each sample, in the unit of the channel per
    /// second.
    pub speed: Vec<f64>,
    /// Whether each sample follows the one before it without a gap.
    pub linked: Vec<bool>,
    /// Index of the record, and indices of the samples in it.
    pub place: (usize, Vec<usize>),
}

/// Values of the Legendre polynomials of degrees 0 to `p - 1` at the point `u`, from -1 to 1.
fn legendre(u: f64, p: usize) -> Vec<f64> {
    let mut l = vec![1.0, u];
    for i in 2..p {
        let k = i as f64;
        l.push(((2.0 * k - 1.0) * u * l[i - 1] - (k - 1.0) * l[i - 2]) / k);
    }
    l.truncate(p);
    l
}

impl Arc {
    /// Creates the arc of `samples` of a channel; `None` if they are too few for its polynomial.
    pub fn new(data: &Record, samples: Vec<usize>, channel: usize, record: usize) -> Option<Self> {
        let (times, y) = (&data.data.times, &data.data.values[channel]);
        let p = (samples.len() / 5).clamp(4, 6);
        if samples.len() < p + 3 {
            return None;
        }
        let (a, b) = (times[samples[0]], times[samples[samples.len() - 1]]);
        let basis: Vec<_> =
            samples.iter().map(|&k| legendre(2.0 * (times[k] - a) / (b - a) - 1.0, p)).collect();
        let mut arc = Arc {
            channel,
            y: samples.iter().map(|&k| y[k]).collect(),
            basis,
            speed: Vec::new(),
            linked: samples
                .iter()
                .enumerate()
                .map(|(i, &k)| i > 0 && data.data.is_correlated_with(samples[i - 1], k))
                .collect(),
            place: (record, samples),
        };
        let fitted: Vec<f64> = arc.y.iter().zip(arc.residuals()).map(|(y, r)| y - r).collect();
        let n = fitted.len();
        arc.speed = (0..n)
            .map(|i| {
                let (low, high) = (i.saturating_sub(1), (i + 1).min(n - 1));
                let s = &arc.place.1;
                ((fitted[high] - fitted[low]) / (times[s[high]] - times[s[low]])).abs()
            })
            .collect();
        Some(arc)
    }

    /// Residuals of the ordinary least-squares fit of the polynomial, in the unit of the channel.
    pub fn residuals(&self) -> Vec<f64> {
        let p = self.basis[0].len();
        let mut h = Square::zero(p);
        let mut g = vec![0.0; p];
        for (row, y) in self.basis.iter().zip(&self.y) {
            for i in 0..p {
                g[i] += row[i] * y;
                for j in 0..p {
                    *h.at_mut(i, j) += row[i] * row[j];
                }
            }
        }
        h.cholesky().solve(&mut g);
        let fit = |row: &[f64]| row.iter().zip(&g).map(|(a, b)| a * b).sum::<f64>();
        self.basis.iter().zip(&self.y).map(|(row, y)| y - fit(row)).collect()
    }

    /// Terms of the restricted likelihood: residual sum of squares, ln|V| + ln|X'V⁻¹X|, and degrees of
    /// freedom. The noise has the correlation `rho` between neighbouring samples and grows with speed by
    /// `growth` = jitter/sd.
    pub fn restricted(&self, rho: f64, growth: f64) -> (f64, f64, f64) {
        let p = self.basis[0].len();
        let scale: Vec<f64> = self.speed.iter().map(|v| (1.0 + (growth * v).powi(2)).sqrt()).collect();
        let innovation = 1.0 / (1.0 - rho * rho).sqrt();
        let mut h = Square::zero(p + 1);
        let (mut log_v, mut row) = (0.0, vec![0.0; p + 1]);
        for k in 0..self.y.len() {
            log_v += 2.0 * scale[k].ln();
            let value = |k: usize, i: usize| if i < p { self.basis[k][i] } else { self.y[k] } / scale[k];
            for (i, r) in row.iter_mut().enumerate() {
                *r = value(k, i);
                if self.linked[k] {
                    *r = (*r - rho * value(k - 1, i)) * innovation;
                }
            }
            if self.linked[k] {
                log_v += (1.0 - rho * rho).ln();
            }
            for i in 0..=p {
                for j in 0..=i {
                    *h.at_mut(i, j) += row[i] * row[j];
                }
            }
        }
        for i in 0..=p {
            for j in 0..i {
                *h.at_mut(j, i) = h.at(i, j);
            }
        }
        let x = h.sub(&(0..p).collect::<Vec<_>>()).cholesky();
        let mut g: Vec<f64> = (0..p).map(|i| h.at(i, p)).collect();
        x.forward(&mut g);
        let rss = h.at(p, p) - g.iter().map(|v| v * v).sum::<f64>();
        (rss, log_v + x.log_det, (self.y.len() - p) as f64)
    }
}
