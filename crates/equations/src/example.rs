//! Complete and commented model files to start from.

/// Name and text of each example model file.
pub const EXAMPLES: [(&str, &str); 5] = [
    ("pendulum", include_str!("../models/pendulum.toml")),
    ("mass-spring-stop", include_str!("../models/mass-spring-stop.toml")),
    ("cart-pole", include_str!("../models/cart-pole.toml")),
    ("tanks", include_str!("../models/tanks.toml")),
    ("servo", include_str!("../models/servo.toml")),
];

/// Returns the text of the example model with this name; `None` if there is none.
pub fn example(name: &str) -> Option<&'static str> {
    EXAMPLES.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}
