//! Point markers with a shape for each series, so that colour is never the only difference.

use maud::{Markup, html};

use super::text::coordinate;
use crate::figure::Tone;

/// Draws the marker of `tone`, centred at `(x, y)`, with a radius of about `r` px.
pub(crate) fn marker(tone: Tone, x: f64, y: f64, r: f64) -> Markup {
    let class = format!("pt {}", tone.class());
    let c = coordinate;
    let d = match tone {
        Tone::Series(1) => {
            format!("M{} {}h{}v{}h{}z", c(x - r * 0.9), c(y - r * 0.9), c(r * 1.8), c(r * 1.8), c(-r * 1.8))
        }
        Tone::Series(2) => format!(
            "M{} {}L{} {}L{} {}z",
            c(x),
            c(y - r * 1.2),
            c(x + r * 1.1),
            c(y + r * 0.8),
            c(x - r * 1.1),
            c(y + r * 0.8)
        ),
        Tone::Series(3) => format!(
            "M{} {}L{} {}L{} {}L{} {}z",
            c(x),
            c(y - r * 1.25),
            c(x + r * 1.25),
            c(y),
            c(x),
            c(y + r * 1.25),
            c(x - r * 1.25),
            c(y)
        ),
        Tone::Series(4) => format!(
            "M{} {}L{} {}L{} {}z",
            c(x),
            c(y + r * 1.2),
            c(x + r * 1.1),
            c(y - r * 0.8),
            c(x - r * 1.1),
            c(y - r * 0.8)
        ),
        _ => return html! { circle class=(class) cx=(c(x)) cy=(c(y)) r=(c(r)) {} },
    };
    html! { path class=(class) d=(d) {} }
}
