//! Finds where within a step an event function first falls through zero.

/// Number of equidistant points of a step at which the sign of an event function is checked.
const LOOKS: usize = 8;
/// Maximum number of halvings of the first interval, in search of an excursion above zero shorter than it.
const HALVINGS: usize = 50;
/// Number of bisections of the bracketed crossing: to the rounding error of its position in the step.
const BISECTIONS: usize = 52;

/// First passage of an event function through zero within a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Crossing {
    /// The function does not fall through zero.
    None,
    /// The function first falls through zero at this fraction of the step.
    At(f64),
    /// The function rises from zero and falls again within less than the resolution (Zeno behaviour).
    Zeno,
}

/// Finds the first fraction of a step at which `g` falls from above zero to zero or below.
///
/// `rising` is whether `g` rises at the start. After an event `g` is zero there up to rounding, and only its
/// rate shows that it leaves zero.
pub(super) fn first_crossing(mut g: impl FnMut(f64) -> f64, rising: bool) -> Crossing {
    let begin = g(0.0);
    let mut above = (begin > 0.0).then_some(0.0);
    let mut below = 0.0;
    for look in 1..=LOOKS {
        let share = look as f64 / LOOKS as f64;
        let value = g(share);
        if value > 0.0 {
            above = Some(share);
        } else if let Some(low) = above {
            return Crossing::At(bisect(g, low, share));
        } else if look == 1 {
            below = value;
        }
    }
    if above.is_some() || !rising || below >= begin {
        // Never above and not falling either: it has been below all the time.
        return Crossing::None;
    }
    // It rises and is lower at the first look than at the start: the hop lies in between.
    let mut share = 1.0 / LOOKS as f64;
    for _ in 0..HALVINGS {
        let high = share;
        share *= 0.5;
        if g(share) > 0.0 {
            return Crossing::At(bisect(g, share, high));
        }
    }
    Crossing::Zeno
}

/// Upper end of the bracket of a crossing after bisection; `g` is above zero at `low` and not at `high`.
fn bisect(mut g: impl FnMut(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if g(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    //! Contract: the first crossing is found, a function that rises from zero is not taken for one that
    //! falls, and a short excursion above zero is found or reported as Zeno behaviour.
    use super::*;

    #[test]
    fn the_first_of_two_crossings_is_found() {
        let Crossing::At(share) = first_crossing(|s| (9.0 * s).cos(), false) else { panic!("a crossing") };
        assert!((share - std::f64::consts::FRAC_PI_2 / 9.0).abs() < 1e-14, "{share}");
    }

    #[test]
    fn a_function_that_leaves_zero_crosses_when_it_comes_back() {
        for hop in [0.7, 0.03, 1e-9] {
            let g = |s: f64| s * (hop - s);
            let Crossing::At(share) = first_crossing(g, true) else { panic!("a crossing for {hop}") };
            assert!((share - hop).abs() < 1e-12 * (1.0 + hop), "{hop} {share}");
        }
        assert_eq!(first_crossing(|s| s, true), Crossing::None);
        assert_eq!(first_crossing(|s| -s - 1e-3, false), Crossing::None);
        assert_eq!(first_crossing(|s| -s * s - 1e-12, true), Crossing::Zeno);
    }
}
