//! An element of a description file, with its attributes as numbers, vectors and words.

use std::ops::Range;

use roxmltree::Node;

use super::Lines;
use crate::error::DescriptionError;

/// An element, with what its error messages need.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Element<'a> {
    node: Node<'a, 'a>,
    file: &'a str,
    lines: &'a Lines,
}

impl<'a> Element<'a> {
    /// The element of a node.
    pub fn new(node: Node<'a, 'a>, file: &'a str, lines: &'a Lines) -> Element<'a> {
        Element { node, file, lines }
    }

    /// Name of the element, without its prefix.
    pub fn tag(&self) -> &'a str {
        self.node.tag_name().name()
    }

    /// The node of the parser.
    pub fn node(&self) -> Node<'a, 'a> {
        self.node
    }

    /// Line of the element, from 1.
    pub fn line(&self) -> usize {
        self.lines.line(self.node.range().start)
    }

    /// Bytes of the element in the file.
    pub fn range(&self) -> Range<usize> {
        self.node.range()
    }

    /// The element as a message shows it: its tag, and its name where it has one.
    pub fn title(&self) -> String {
        match self.attribute("name") {
            Some(name) => format!("{} `{name}`", self.tag()),
            None => format!("<{}>", self.tag()),
        }
    }

    /// Elements directly inside this one, in the order of the file.
    pub fn children(&self) -> impl Iterator<Item = Element<'a>> + use<'a> {
        let Element { file, lines, node } = *self;
        node.children().filter(Node::is_element).map(move |node| Element { node, file, lines })
    }

    /// First element directly inside this one with a tag.
    pub fn child(&self, tag: &str) -> Option<Element<'a>> {
        self.children().find(|child| child.tag() == tag)
    }

    /// Value of an attribute.
    pub fn attribute(&self, name: &str) -> Option<&'a str> {
        self.node.attribute(name)
    }

    /// Value of an attribute that the format demands.
    pub fn required(&self, name: &str) -> Result<&'a str, DescriptionError> {
        self.attribute(name).ok_or_else(|| {
            self.error(format!("{} has no attribute `{name}`", self.title()), format!("add {name}=\"...\""))
        })
    }

    /// Number in an attribute; `None` if the element lacks it.
    pub fn number(&self, name: &str) -> Result<Option<f64>, DescriptionError> {
        Ok(self.vector::<1>(name)?.map(|[number]| number))
    }

    /// Exactly `N` numbers in an attribute, separated by spaces; `None` if the element lacks it.
    pub fn vector<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>, DescriptionError> {
        let Some(numbers) = self.numbers(name, N)? else { return Ok(None) };
        match <[f64; N]>::try_from(numbers.as_slice()) {
            Ok(vector) => Ok(Some(vector)),
            Err(_) => {
                let expected =
                    if N == 1 { "1 number".into() } else { format!("{N} numbers separated by spaces") };
                let problem =
                    format!("{}: {name} has {} numbers instead of {N}", self.title(), numbers.len());
                Err(self.error(problem, format!("write {expected}")))
            }
        }
    }

    /// At most `limit` numbers in an attribute, separated by spaces; `None` if the element lacks it.
    ///
    /// A list that is longer is cut after `limit + 1` numbers, which lets the caller refuse it.
    pub fn numbers(&self, name: &str, limit: usize) -> Result<Option<Vec<f64>>, DescriptionError> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        let words = text.split_ascii_whitespace().take(limit + 1);
        words.map(|word| self.parse_number(name, word)).collect::<Result<_, _>>().map(Some)
    }

    /// A finite number.
    fn parse_number(&self, name: &str, word: &str) -> Result<f64, DescriptionError> {
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ if word.contains("${") => Err(super::xacro_error(self.file, self.line())),
            _ => {
                let problem =
                    format!("{}: {name}=\"{}\" is not a finite number", self.title(), shorten(word));
                Err(self.error(problem, "write a decimal number such as 0.25"))
            }
        }
    }

    /// Whether an attribute is `true` (or `enable`); `None` if the element lacks it.
    pub fn is_true(&self, name: &str) -> Result<Option<bool>, DescriptionError> {
        match self.attribute(name) {
            None => Ok(None),
            Some("true" | "enable") => Ok(Some(true)),
            Some("false" | "disable") => Ok(Some(false)),
            Some(other) => {
                let problem =
                    format!("{}: {name}=\"{}\" is neither true nor false", self.title(), shorten(other));
                Err(self.error(problem, "write true or false"))
            }
        }
    }

    /// An error at the line of this element.
    pub fn error(&self, problem: impl Into<String>, remedy: impl Into<String>) -> DescriptionError {
        DescriptionError::at(self.file, self.line(), problem, remedy)
    }
}

/// The first characters of a word of the user, for a message.
fn shorten(word: &str) -> String {
    const MAX_SHOWN: usize = 40;
    match word.char_indices().nth(MAX_SHOWN) {
        Some((end, _)) => format!("{}...", &word[..end]),
        None => word.into(),
    }
}
