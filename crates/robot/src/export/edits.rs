//! Replacements in the text of an XML file, which leave everything else as it is.

use std::ops::Range;

use super::number::{comment, number, numbers};
use crate::xml::Element;

/// Replacements in a text, applied together.
pub(super) struct Edits<'t> {
    text: &'t str,
    list: Vec<(Range<usize>, String)>,
}

impl<'t> Edits<'t> {
    /// No replacement of a text.
    pub fn new(text: &'t str) -> Edits<'t> {
        Edits { text, list: Vec::new() }
    }

    /// The text with all replacements; those at the same position in the order in which they were made.
    pub fn apply(mut self) -> String {
        self.list.sort_by_key(|(range, _)| range.start);
        let mut written = String::with_capacity(self.text.len());
        let mut position = 0;
        for (range, replacement) in &self.list {
            written.push_str(&self.text[position..range.start.max(position)]);
            written.push_str(replacement);
            position = range.end.max(position);
        }
        written.push_str(&self.text[position..]);
        written
    }

    /// Sets an attribute.
    pub fn set(&mut self, element: Element, name: &str, value: &str) {
        match element.node().attribute_node(name) {
            Some(attribute) => self.list.push((attribute.range_value(), value.into())),
            None => {
                let end = self.attributes_end(element);
                self.list.push((end..end, format!(" {name}=\"{value}\"")));
            }
        }
    }

    /// Sets an attribute to a number, unless it has it.
    pub fn set_number(&mut self, element: Element, name: &str, value: f64) {
        if element.number(name) != Ok(Some(value)) {
            self.set(element, name, &number(value));
        }
    }

    /// Sets an attribute to three numbers, unless it has them.
    pub fn set_vector(&mut self, element: Element, name: &str, value: [f64; 3]) {
        if element.vector(name) != Ok(Some(value)) {
            self.set(element, name, &numbers(&value));
        }
    }

    /// Removes an attribute, with the space before it.
    pub fn remove(&mut self, element: Element, name: &str) {
        if let Some(attribute) = element.node().attribute_node(name) {
            let Range { start, end } = attribute.range();
            let before = self.text[..start].trim_end().len();
            self.list.push((before..end, String::new()));
        }
    }

    /// Adds an element inside another one: before the others, or behind them.
    pub fn insert(&mut self, parent: Element, xml: &str, is_first: bool) {
        let outer = self.indent(parent.range().start).unwrap_or_default().to_owned();
        let line = self.line_break();
        let inner = match parent.children().next().and_then(|child| self.indent(child.range().start)) {
            Some(indent) => indent.to_owned(),
            None => format!("{outer}  "),
        };
        let start_tag = self.start_tag_end(parent);
        if self.text[..start_tag].ends_with("/>") {
            let name = self.qualified_name(parent);
            let before = self.text[..start_tag - 2].trim_end().len();
            let replacement = format!(">{line}{inner}{xml}{line}{outer}</{name}>");
            self.list.push((before..start_tag, replacement));
            return;
        }
        let last = parent.children().last().map(|child| child.range().end);
        let at = if is_first { start_tag } else { last.unwrap_or(start_tag) };
        let is_only = last.is_none() && !self.text[at..].starts_with(['\n', '\r']);
        let end = if is_only { format!("{line}{outer}") } else { String::new() };
        self.list.push((at..at, format!("{line}{inner}{xml}{end}")));
    }

    /// Adds a comment before an element, on a line of its own if the element begins one.
    pub fn comment_before(&mut self, element: Element, words: &str) {
        let start = element.range().start;
        let after = match self.indent(start) {
            Some(indent) => format!("{}{indent}", self.line_break()),
            None => String::new(),
        };
        self.list.push((start..start, format!("{}{after}", comment(words))));
    }

    /// The spaces before a position, if there is nothing else before it in its line.
    fn indent(&self, position: usize) -> Option<&'t str> {
        let start = self.text[..position].rfind('\n').map_or(0, |end| end + 1);
        let before = &self.text[start..position];
        before.trim().is_empty().then_some(before)
    }

    /// How the lines of the text end.
    fn line_break(&self) -> &'static str {
        if self.text.contains("\r\n") { "\r\n" } else { "\n" }
    }

    /// Name of an element with its prefix.
    fn qualified_name(&self, element: Element) -> &'t str {
        let tag = &self.text[element.range()][1..];
        let end = tag.find(|letter: char| letter.is_ascii_whitespace() || matches!(letter, '/' | '>'));
        &tag[..end.unwrap_or(tag.len())]
    }

    /// Position behind the last attribute of an element, or behind its name.
    fn attributes_end(&self, element: Element) -> usize {
        let name_end = element.range().start + 1 + self.qualified_name(element).len();
        element.node().attributes().map(|attribute| attribute.range().end).max().unwrap_or(name_end)
    }

    /// Position behind the first tag of an element.
    fn start_tag_end(&self, element: Element) -> usize {
        // Namespaces are no attributes of the parser, so quotes are skipped here as well.
        let mut quote = None;
        let from = self.attributes_end(element);
        for (k, byte) in self.text[from..].bytes().enumerate() {
            match (quote, byte) {
                (None, b'>') => return from + k + 1,
                (None, b'"' | b'\'') => quote = Some(byte),
                (Some(open), _) if open == byte => quote = None,
                _ => {}
            }
        }
        element.range().end
    }
}
