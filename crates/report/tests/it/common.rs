//! Checks that every figure and page must pass, for any data.

#![allow(dead_code, reason = "each test binary uses a part")]

use roxmltree::{Document, Node, ParsingOptions};

const SVG: &str = "http://www.w3.org/2000/svg";

/// Bounding box: left, top, right and bottom, in pixels.
type Box4 = (f64, f64, f64, f64);

/// Parses the numbers of an attribute such as path data.
pub fn numbers(text: &str) -> Vec<f64> {
    text.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'))
        .filter(|s| !s.is_empty())
        .map(|s| s.parse().unwrap_or_else(|_| panic!("not a number: {s:?} in {text:?}")))
        .collect()
}

fn attribute(node: Node, name: &str) -> f64 {
    let value = node.attribute(name).unwrap_or_else(|| panic!("{name} is missing"));
    value.parse().unwrap_or_else(|_| panic!("{name} is not a number: {value}"))
}

fn has_class(node: Node, class: &str) -> bool {
    node.attribute("class").is_some_and(|c| c.split(' ').any(|c| c == class))
}

/// Estimated bounding box of a text, for a font of medium width (half an em per character on average).
fn text_box(node: Node) -> Box4 {
    let size = attribute(node, "font-size");
    let width = node.text().unwrap_or_default().chars().count() as f64 * size * 0.5;
    let (x, y) = (attribute(node, "x"), attribute(node, "y"));
    let left = if has_class(node, "en") {
        x - width
    } else if has_class(node, "mi") {
        x - width / 2.0
    } else {
        x
    };
    (left, y - size * 0.7, left + width, y + size * 0.15)
}

/// Checks one `<svg>` element that is a figure.
pub fn check_figure(svg: Node) {
    let view = numbers(svg.attribute("viewBox").expect("viewBox"));
    let (width, height) = (view[2], view[3]);
    assert_eq!(svg.attribute("role"), Some("img"));
    let child = |name: &str| svg.children().find(|n| n.has_tag_name((SVG, name)));
    let title = child("title").expect("a figure has a title element").text().unwrap_or_default();
    assert!(child("desc").and_then(|n| n.text()).is_some_and(|t| !t.is_empty()), "{title}: description");

    let mut boxes: Vec<(Node, Box4)> = Vec::new();
    for node in svg.descendants().filter(Node::is_element) {
        for attribute in node.attributes() {
            let value = attribute.value();
            assert!(
                !value.contains("NaN") && !value.contains("inf"),
                "{title}: {}={value}",
                attribute.name()
            );
            if ["d", "x", "y", "width", "height", "cx", "cy", "r"].contains(&attribute.name()) {
                numbers(value);
            }
        }
        if node.has_tag_name((SVG, "text")) && node.attribute("transform").is_none() {
            let b = text_box(node);
            let inside = b.0 >= -1.0 && b.2 <= width + 1.0 && b.1 >= -1.0 && b.3 <= height + 1.0;
            assert!(inside, "{title}: {:?} leaves the figure of {width} by {height}: {b:?}", node.text());
            boxes.push((node, b));
        }
    }
    for (i, (first, a)) in boxes.iter().enumerate() {
        for (second, b) in &boxes[i + 1..] {
            let apart = a.2 <= b.0 || b.2 <= a.0 || a.3 <= b.1 || b.3 <= a.1;
            assert!(apart, "{title} ({width}): {:?} overlaps {:?}", first.text(), second.text());
        }
    }
    check_plot(svg, &boxes, title);
}

/// Checks that the plot area clips its marks, and that only labels with a halo extend into it.
fn check_plot(svg: Node, boxes: &[(Node, Box4)], title: &str) {
    let Some(plot) = svg.descendants().find(|n| has_class(*n, "plot")) else { return };
    let (left, top) = (attribute(plot, "x"), attribute(plot, "y"));
    let (right, bottom) = (left + attribute(plot, "width"), top + attribute(plot, "height"));
    assert_eq!(plot.attribute("overflow"), Some("hidden"));
    let view = numbers(plot.attribute("viewBox").expect("viewBox"));
    for (shown, wanted) in view.iter().zip([left, top, right - left, bottom - top]) {
        assert!((shown - wanted).abs() < 0.11, "{title}: marks are not scaled: {view:?}");
    }
    for (node, b) in boxes.iter().filter(|(node, _)| !has_class(*node, "ha")) {
        let outside = b.2 <= left || b.0 >= right || b.3 <= top || b.1 >= bottom;
        assert!(outside, "{title}: {:?} lies in the plot area", node.text());
    }
}

/// Parses an SVG file and checks it as a figure.
pub fn check_svg(svg: &str) {
    let document = Document::parse(svg).unwrap_or_else(|e| panic!("not XML: {e}\n{svg}"));
    check_figure(document.root_element());
}

/// Parses a page as XML, checks it and its figures, and returns the number of figures.
///
/// The only void elements of a page are `meta`; they are closed before parsing.
pub fn check_page(html: &str) -> usize {
    let close_meta = |piece: &str| match piece.rfind("<meta ") {
        Some(at) if piece.ends_with('>') => format!("{}{}/>", &piece[..at], &piece[at..piece.len() - 1]),
        _ => piece.to_owned(),
    };
    let xml: String = html.split_inclusive('>').map(close_meta).collect();
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document =
        Document::parse_with_options(&xml, options).unwrap_or_else(|e| panic!("not well-formed: {e}"));
    let mut ids: Vec<&str> = document.descendants().filter_map(|n| n.attribute("id")).collect();
    let count = ids.len();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), count, "ids are unique");
    for node in document.descendants().filter(Node::is_element) {
        let name = node.tag_name().name();
        assert!(!["script", "link", "iframe", "img", "object"].contains(&name), "<{name}> in a page");
        for attribute in node.attributes() {
            let (name, value) = (attribute.name(), attribute.value());
            assert!(!name.starts_with("on") && name != "src", "{name}");
            if name == "href" {
                let target = value.strip_prefix('#').expect("links stay in the page");
                assert!(ids.contains(&target), "link to nowhere: {target}");
            }
            if name == "aria-labelledby" {
                assert!(value.split(' ').all(|id| ids.contains(&id)), "{value}");
            }
        }
    }
    assert!(!html.contains("@import") && !html.contains("url(") && !html.contains("NaN"));
    let figures = || document.descendants().filter(|n| n.attribute("role") == Some("img"));
    figures().for_each(check_figure);
    figures().count()
}
