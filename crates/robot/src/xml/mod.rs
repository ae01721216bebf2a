//! XML documents of limited size, and typed access to their attributes.

mod element;
mod lines;

pub(crate) use element::Element;
pub(crate) use lines::Lines;

use roxmltree::{Document, Error, ParsingOptions};

use crate::error::DescriptionError;

/// Largest description file, bytes. The largest published descriptions, of humanoids, have below 1 MB.
pub const MAX_FILE_BYTES: usize = 16 << 20;
/// Largest number of elements, texts and comments of a file.
const MAX_NODES: u32 = 500_000;
/// Largest number of attributes of an element. The parser compares each attribute with all others of its element.
const MAX_ATTRIBUTES: usize = 200;
/// Longest name of an element or class, bytes. Names of links without an element of their own are made of several.
const MAX_NAME: usize = 200;
/// Deepest nesting of elements; bodies of MJCF files are read recursively.
const MAX_DEPTH: usize = 250;

/// Parses a description file within limits of its size.
///
/// Document type definitions are refused, and with them entities that expand to gigabytes or read other files.
pub(crate) fn parse<'t>(text: &'t str, file: &str) -> Result<Document<'t>, DescriptionError> {
    check_size(text, file)?;
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| explain(&error, file))?;
    check_elements(&document, file)?;
    Ok(document)
}

/// Refuses texts that are too long, and elements with too many attributes.
fn check_size(text: &str, file: &str) -> Result<(), DescriptionError> {
    if text.len() > MAX_FILE_BYTES {
        let problem = format!("the file has {} bytes, and at most {MAX_FILE_BYTES} are read", text.len());
        return Err(DescriptionError::of_file(file, problem, "check that it is a description of a robot"));
    }
    match most_attributes(text) {
        count if count > MAX_ATTRIBUTES => {
            let problem = format!("an element has {count} attributes, and at most {MAX_ATTRIBUTES} are read");
            Err(DescriptionError::of_file(file, problem, "check that it is a description of a robot"))
        }
        _ => Ok(()),
    }
}

/// Upper bound of the number of attributes of any element: equals signs between `<` and `>`, outside quotes and comments.
fn most_attributes(text: &str) -> usize {
    let mut most = 0;
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        if let Some(comment) = rest.strip_prefix("<!--") {
            let Some(end) = comment.find("-->") else { return most };
            rest = &comment[end..];
            continue;
        }
        let mut quote = None;
        let mut count = 0;
        let mut end = rest.len();
        for (k, byte) in rest.bytes().enumerate() {
            match (quote, byte) {
                (None, b'>') => {
                    end = k;
                    break;
                }
                (None, b'=') => count += 1,
                (None, b'"' | b'\'') => quote = Some(byte),
                (Some(open), _) if open == byte => quote = None,
                _ => {}
            }
        }
        most = most.max(count);
        rest = &rest[end..];
    }
    most
}

/// Refuses elements that are nested too deeply, and names that are too long.
fn check_elements(document: &Document, file: &str) -> Result<(), DescriptionError> {
    let error = |node: roxmltree::Node, problem: String, remedy: &str| {
        let line = Lines::new(document.input_text()).line(node.range().start);
        DescriptionError::at(file, line, problem, remedy)
    };
    let mut pending = vec![(document.root_element(), 1)];
    while let Some((node, depth)) = pending.pop() {
        if depth > MAX_DEPTH {
            let problem = format!("elements are nested deeper than {MAX_DEPTH} levels");
            return Err(error(node, problem, "split the robot into parts"));
        }
        let names =
            node.attributes().filter(|attribute| matches!(attribute.name(), "name" | "class" | "childclass"));
        let lengths = names.map(|attribute| attribute.value().len());
        let lengths = lengths.chain(node.attributes().map(|attribute| attribute.name().len()));
        let longest = lengths.fold(node.tag_name().name().len(), usize::max);
        if longest > MAX_NAME {
            let problem = format!("a name has {longest} bytes, and at most {MAX_NAME} are read");
            return Err(error(node, problem, "give a shorter name"));
        }
        pending.extend(node.children().filter(|child| child.is_element()).map(|child| (child, depth + 1)));
    }
    Ok(())
}

/// The parser's error, with the remedy.
fn explain(error: &Error, file: &str) -> DescriptionError {
    match error {
        Error::DtdDetected => DescriptionError::of_file(
            file,
            "the file has a document type definition (<!DOCTYPE>), which could expand to any size",
            "remove it and write entities out",
        ),
        Error::NodesLimitReached | Error::AttributesLimitReached | Error::NamespacesLimitReached => {
            let problem = format!("the file has more than {MAX_NODES} elements, texts and comments");
            DescriptionError::of_file(file, problem, "check that it is a description of a robot")
        }
        Error::UnknownNamespace(prefix, at) if prefix == "xacro" => {
            DescriptionError::at(file, at.row as usize, XACRO, xacro_remedy(file))
        }
        Error::UnknownNamespace(prefix, at) => {
            let problem = format!("the prefix `{prefix}:` is not declared");
            let remedy = format!("add xmlns:{prefix}=\"{prefix}\" to the first element");
            DescriptionError::at(file, at.row as usize, problem, remedy)
        }
        Error::NoRootNode => DescriptionError::of_file(
            file,
            "the file has no XML element",
            "give a URDF file (<robot>) or an MJCF file (<mujoco>)",
        ),
        Error::UnclosedRootNode | Error::UnexpectedEndOfStream => DescriptionError::of_file(
            file,
            "the file ends before its last element is closed",
            "check that the file is complete",
        ),
        _ => {
            let problem = format!("this is not well-formed XML: {error}");
            DescriptionError::at(
                file,
                error.pos().row as usize,
                problem,
                "correct it, or save the file again",
            )
        }
    }
}

/// Problem of a file with macros of ROS.
const XACRO: &str = "the file has xacro macros, which only ROS expands";

/// Remedy for a file with macros of ROS.
fn xacro_remedy(file: &str) -> String {
    format!("expand them first: xacro {file} > out.urdf")
}

/// The error of a file with macros of ROS, at a line.
pub(crate) fn xacro_error(file: &str, line: usize) -> DescriptionError {
    DescriptionError::at(file, line, XACRO, xacro_remedy(file))
}
