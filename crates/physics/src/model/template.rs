//! Model files to start from, each complete and commented.

/// Name and text of each template.
pub const TEMPLATES: [(&str, &str); 2] =
    [("ball", include_str!("../../models/ball.toml")), ("push", include_str!("../../models/push.toml"))];

/// Text of the template of that name.
pub fn template(name: &str) -> Option<&'static str> {
    TEMPLATES.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    //! Contract: a template is a model as it stands, and what it suggests is one too.
    use super::*;
    use crate::model::ModelFile;

    #[test]
    fn templates_and_their_suggestions_are_models() {
        for (name, text) in TEMPLATES {
            ModelFile::parse(text, name).unwrap_or_else(|e| panic!("{e}"));
            // A suggestion is a line that would be TOML; prose has no equals sign after its first word.
            let uncomment = |line: &str| match line.strip_prefix("# ") {
                Some(rest) if rest.starts_with("[[") || rest.split(' ').nth(1) == Some("=") => {
                    rest.to_owned()
                }
                _ => line.to_owned(),
            };
            let all: String = text.lines().map(|line| uncomment(line) + "\n").collect();
            let all = if all.contains("polygon_m") { all.replace("object = \"rect1\"\n", "") } else { all };
            assert_ne!(all, text);
            ModelFile::parse(&all, name).unwrap_or_else(|e| panic!("{e}\n{all}"));
        }
    }
}
