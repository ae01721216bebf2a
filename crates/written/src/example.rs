//! Model files to start from, each complete and commented.

/// Name and text of each example.
pub const EXAMPLES: [(&str, &str); 5] = [
    ("pendulum", include_str!("../models/pendulum.toml")),
    ("mass-spring-stop", include_str!("../models/mass-spring-stop.toml")),
    ("cart-pole", include_str!("../models/cart-pole.toml")),
    ("tanks", include_str!("../models/tanks.toml")),
    ("servo", include_str!("../models/servo.toml")),
];

/// Text of the example of that name.
pub fn example(name: &str) -> Option<&'static str> {
    EXAMPLES.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}
