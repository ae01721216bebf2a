//! Writes XML elements as text.

/// An XML element with its attributes and the elements in it.
pub(super) struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    children: Vec<Element>,
}

impl Element {
    /// Creates an element without attributes or children.
    pub fn new(name: &'static str) -> Self {
        Element { name, attributes: Vec::new(), children: Vec::new() }
    }

    /// The element with a further attribute.
    pub fn with(mut self, name: &'static str, value: impl ToString) -> Self {
        self.attributes.push((name, value.to_string()));
        self
    }

    /// The element with a further attribute, if there is a value for it.
    pub fn with_some(self, name: &'static str, value: Option<String>) -> Self {
        match value {
            Some(value) => self.with(name, value),
            None => self,
        }
    }

    /// The element with further elements in it.
    pub fn containing(mut self, children: impl IntoIterator<Item = Element>) -> Self {
        self.children.extend(children);
        self
    }

    /// The XML document whose root is this element.
    pub fn document(&self) -> String {
        let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        self.write(0, &mut text);
        text
    }

    fn write(&self, depth: usize, text: &mut String) {
        let indent = "  ".repeat(depth);
        *text += &format!("{indent}<{}", self.name);
        for (name, value) in &self.attributes {
            *text += &format!(" {name}=\"{}\"", escaped(value));
        }
        if self.children.is_empty() {
            *text += "/>\n";
            return;
        }
        *text += ">\n";
        self.children.iter().for_each(|child| child.write(depth + 1, text));
        *text += &format!("{indent}</{}>\n", self.name);
    }
}

/// Escapes the value of an attribute; characters that XML does not allow become underscores.
fn escaped(value: &str) -> String {
    let mut text = String::with_capacity(value.len());
    for c in value.chars() {
        match c {
            '&' => text += "&amp;",
            '<' => text += "&lt;",
            '>' => text += "&gt;",
            '"' => text += "&quot;",
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => text.push('_'),
            c => text.push(c),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    //! Contract: what is written reads back as the same elements and attributes.
    use super::*;

    #[test]
    fn values_are_escaped() {
        let text = Element::new("a").with("b", "<\"&\n>").containing([Element::new("c")]).document();
        assert!(text.ends_with("<a b=\"&lt;&quot;&amp;_&gt;\">\n  <c/>\n</a>\n"), "{text}");
    }
}
