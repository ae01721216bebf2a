//! Colours of figures and pages for light and dark mode.
//!
//! Tests check that the five series can be distinguished with every common kind of colour vision, and that
//! contrasts suffice. Dashes and marker shapes also distinguish the series.

/// Colours of light mode: page background, text, muted text, rules, grid, panel, accent, five series.
pub(crate) const LIGHT: [(&str, &str); 12] = [
    ("bg", "#fcfcfa"),
    ("ink", "#1d2127"),
    ("muted", "#5c6470"),
    ("rule", "#d9dbd7"),
    ("grid", "#ecedea"),
    ("panel", "#f4f4f0"),
    ("accent", "#2b62c4"),
    ("s0", "#2b62c4"),
    ("s1", "#d64a12"),
    ("s2", "#10564f"),
    ("s3", "#b868b0"),
    ("s4", "#629a2a"),
];

/// Colours of dark mode, with the names of [`LIGHT`].
pub(crate) const DARK: [(&str, &str); 12] = [
    ("bg", "#16181c"),
    ("ink", "#e8e9ea"),
    ("muted", "#a2a9b4"),
    ("rule", "#3a3f47"),
    ("grid", "#262a30"),
    ("panel", "#1e2126"),
    ("accent", "#8ab4fa"),
    ("s0", "#5a96f5"),
    ("s1", "#e0702c"),
    ("s2", "#8fe8c4"),
    ("s3", "#c58fc6"),
    ("s4", "#f0e468"),
];

/// Number of different colours for series.
pub(crate) const SERIES: u8 = 5;

fn variables(colours: &[(&str, &str)]) -> String {
    colours.iter().map(|(name, value)| format!("--{name}:{value};")).collect()
}

/// CSS custom properties under `selector`, with dark colours for screens in dark mode.
pub(crate) fn variables_css(selector: &str) -> String {
    format!(
        "{selector}{{color-scheme:light dark;{}}}\n@media screen and (prefers-color-scheme:dark){{{selector}{{{}}}}}\n",
        variables(&LIGHT),
        variables(&DARK)
    )
}

/// CSS of the classes that figures use.
pub(crate) fn figure_css() -> String {
    let mut css = String::from(
        ".fig{display:block;width:100%;height:auto;overflow:visible;font-family:system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif;font-variant-numeric:tabular-nums}\n\
         .fig text{fill:var(--ink)}.fig .mu{fill:var(--muted)}.fig .ti{font-weight:600}.fig .en{text-anchor:end}.fig .mi{text-anchor:middle}\n\
         .fig .ha{paint-order:stroke;stroke:var(--bg);stroke-width:4px;stroke-linejoin:round}\n\
         .fig .gr{stroke:var(--grid);stroke-width:1;fill:none}.fig .ax{stroke:var(--rule);stroke-width:1;fill:none}.fig .ze{stroke:var(--muted);stroke-width:1;fill:none;opacity:.55}\n\
         .fig .ln{fill:none;stroke-width:1.7;stroke-linejoin:round;stroke-linecap:round;stroke:var(--k)}.fig .th{stroke-width:1.1}\n\
         .fig .rf{fill:none;stroke:var(--ink);stroke-width:1;stroke-dasharray:1.5 3;stroke-linecap:round}.fig .ev{fill:none;stroke:var(--muted);stroke-width:1;stroke-dasharray:2 3;opacity:.8}\n\
         .fig .b9{fill:var(--k);fill-opacity:.16;stroke:var(--k);stroke-opacity:.35;stroke-width:.6}.fig .b5{fill:var(--k);fill-opacity:.3}\n\
         .fig .pt{fill:var(--k);fill-opacity:.85;stroke:var(--bg);stroke-width:.6}.fig .br{fill:var(--k);fill-opacity:.75}.fig .iv{fill:none;stroke:var(--k);stroke-width:1.6;stroke-linecap:round}\n\
         .fig .ld{fill:none;stroke:var(--k);stroke-width:.8;opacity:.7}.fig .pn{fill:var(--panel)}.fig .bg{fill:var(--bg)}\n\
         .fig .ki{--k:var(--ink)}.fig .km{--k:var(--muted)}.fig .km.ln{stroke-dasharray:5 3}\n",
    );
    let dashes = ["", "7 3.5", "2 3.5", "9 3 2 3", "4 2.5"];
    for (i, dash) in dashes.iter().enumerate() {
        css.push_str(&format!(".fig .k{i}{{--k:var(--s{i})}}"));
        if !dash.is_empty() {
            css.push_str(&format!(".fig .k{i}.ln{{stroke-dasharray:{dash}}}"));
        }
    }
    css.push_str(".fig .so.ln{stroke-dasharray:none}\n");
    css
}

#[cfg(test)]
mod tests {
    //! Contract: contrasts of WCAG 2.2 (text 4.5:1, graphics 3:1) in both modes, and series that remain
    //! distinguishable with protanopia, deuteranopia and tritanopia (matrices of Machado, Oliveira and
    //! Fernandes, IEEE TVCG 15, 2009; distance in CIELAB, where 2.3 is just noticeable).
    use super::*;

    type Rgb = [f64; 3];

    fn rgb(hex: &str) -> Rgb {
        let linear = |start: usize| {
            let c = f64::from(u8::from_str_radix(&hex[start..start + 2], 16).expect("hex colour")) / 255.0;
            if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        [linear(1), linear(3), linear(5)]
    }

    fn contrast(a: Rgb, b: Rgb) -> f64 {
        let y = |c: Rgb| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2] + 0.05;
        (y(a) / y(b)).max(y(b) / y(a))
    }

    fn lab(c: Rgb) -> Rgb {
        let c = c.map(|v| v.clamp(0.0, 1.0));
        let f = |v: f64| {
            if v > 0.008_856 { v.cbrt() } else { 7.787 * v + 16.0 / 116.0 }
        };
        let x = f((0.4124 * c[0] + 0.3576 * c[1] + 0.1805 * c[2]) / 0.950_47);
        let y = f(0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]);
        let z = f((0.0193 * c[0] + 0.1192 * c[1] + 0.9505 * c[2]) / 1.088_83);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    fn get(colours: &[(&str, &str)], name: &str) -> Rgb {
        rgb(colours.iter().find(|c| c.0 == name).expect("named colour").1)
    }

    #[test]
    fn text_and_marks_have_enough_contrast() {
        for colours in [&LIGHT, &DARK] {
            for background in ["bg", "panel"].map(|name| get(colours, name)) {
                for text in ["ink", "muted", "accent"] {
                    assert!(contrast(get(colours, text), background) >= 4.5, "{text}");
                }
                for i in 0..SERIES {
                    assert!(contrast(get(colours, &format!("s{i}")), background) >= 3.0, "s{i}");
                }
            }
        }
    }

    #[test]
    fn series_are_distinguishable_with_every_kind_of_colour_vision() {
        let views = [
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            [
                [0.152_286, 1.052_583, -0.204_868],
                [0.114_503, 0.786_281, 0.099_216],
                [-0.003_882, -0.048_116, 1.051_998],
            ],
            [
                [0.367_322, 0.860_646, -0.227_968],
                [0.280_085, 0.672_501, 0.047_413],
                [-0.011_820, 0.042_940, 0.968_881],
            ],
            [
                [1.255_528, -0.076_749, -0.178_779],
                [-0.078_411, 0.930_809, 0.147_602],
                [0.004_733, 0.691_367, 0.303_900],
            ],
        ];
        for colours in [&LIGHT, &DARK] {
            for view in views {
                let perceived: Vec<Rgb> = (0..SERIES)
                    .map(|i| get(colours, &format!("s{i}")))
                    .map(|c| lab(view.map(|row: Rgb| row.iter().zip(c).map(|(a, b)| a * b).sum())))
                    .collect();
                for (i, a) in perceived.iter().enumerate() {
                    for b in &perceived[i + 1..] {
                        let distance = a.iter().zip(b).map(|(p, q)| (p - q).powi(2)).sum::<f64>().sqrt();
                        assert!(distance > 12.0, "{distance}");
                    }
                }
            }
        }
    }
}
