//! Templates of model files, each complete and commented.

/// Name and text of each template of a model file.
pub const TEMPLATES: [(&str, &str); 2] =
    [("ball", include_str!("../../models/ball.toml")), ("push", include_str!("../../models/push.toml"))];

/// Text of the template with this name; `None` if there is none.
pub fn template(name: &str) -> Option<&'static str> {
    TEMPLATES.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    //! Contract: each template is a valid model, and so is the template with all suggested lines enabled.
    use super::*;
    use crate::model::ModelFile;

    #[test]
    fn templates_and_their_suggestions_are_models() {
        for (name, text) in TEMPLATES {
            ModelFile::parse(text, name).unwrap_or_else(|e| panic!("{e}"));
            // A suggestion is a comment that is valid TOML; prose has no equals sign after its first word.
            let uncomment = |line: &str| match line.strip_prefix("# ") {
                Some(line) if line.starts_with("[[") || line.split(' ').nth(1) == Some("=") => {
                    line.to_owned()
                }
                _ => line.to_owned(),
            };
            let enabled: String = text.lines().map(|line| uncomment(line) + "\n").collect();
            // `object` and `polygon_m` are alternatives.
            let enabled = if enabled.contains("polygon_m") {
                enabled.replace("object = \"rect1\"\n", "")
            } else {
                enabled
            };
            assert_ne!(enabled, text);
            ModelFile::parse(&enabled, name).unwrap_or_else(|e| panic!("{e}\n{enabled}"));
        }
    }
}
