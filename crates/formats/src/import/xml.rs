//! XML of OpenCV's `FileStorage`, of Metashape and of XMP as a tree of values.

use roxmltree::{Document, Node, ParsingOptions};
use serde_json::{Map, Value};

use super::{literal::MAX_DEPTH, old_calibration::NotImported};

/// Most elements and texts in a file. A calibration has tens, OpenCV's with every corner has
/// hundreds.
const MAX_NODES: u32 = 10_000;
/// Most attributes of an element: the parser compares each with each. XMP has tens.
const MAX_ATTRIBUTES: usize = 256;

/// Name and contents of the root element. An element with elements is an object, one of numbers a
/// number or a list, another one a text; a repeated element counts once.
pub(super) fn parse(text: &str) -> Result<(String, Value), NotImported> {
    let malformed = |reason: String| NotImported::Malformed { reason };
    // Within an element's tag, whatever its values hold, no `<` is allowed.
    if text.split('<').any(|tag| tag.matches('=').take(MAX_ATTRIBUTES + 1).count() > MAX_ATTRIBUTES)
    {
        return Err(malformed("an element with too many attributes".into()));
    }
    let options =
        ParsingOptions { allow_dtd: false, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options);
    let document = document.map_err(|err| malformed(err.to_string()))?;
    let root = document.root_element();
    let name = root.tag_name().name();
    let tree = if name == "xmpmeta" { xmp(root) } else { value(root, 0) };
    let tree = tree.ok_or_else(|| malformed("nested too deeply".into()))?;
    Ok((name.to_owned(), tree))
}

/// Properties in XMP: attributes or elements of `<rdf:Description>`.
fn xmp(root: Node<'_, '_>) -> Option<Value> {
    let mut map = Map::new();
    let is_description = |node: &Node<'_, '_>| node.tag_name().name() == "Description";
    for description in root.descendants().filter(is_description) {
        for attribute in description.attributes() {
            map.insert(attribute.name().to_owned(), plain(attribute.value()));
        }
        for child in description.children().filter(Node::is_element) {
            map.insert(child.tag_name().name().to_owned(), value(child, 0)?);
        }
    }
    Some(Value::Object(map))
}

fn value(node: Node<'_, '_>, depth: usize) -> Option<Value> {
    if depth > MAX_DEPTH {
        return None;
    }
    let mut map = Map::new();
    for child in node.children().filter(Node::is_element) {
        map.insert(child.tag_name().name().to_owned(), value(child, depth + 1)?);
    }
    if !map.is_empty() {
        return Some(Value::Object(map));
    }
    Some(plain(node.text().unwrap_or_default()))
}

/// A number, several as a list, or another text.
fn plain(text: &str) -> Value {
    let text = text.trim();
    let numbers: Option<Vec<Value>> = text.split_ascii_whitespace().map(number).collect();
    match numbers {
        Some(mut one) if one.len() == 1 => one.remove(0),
        Some(numbers) if !numbers.is_empty() => Value::Array(numbers),
        _ => Value::String(text.to_owned()),
    }
}

fn number(word: &str) -> Option<Value> {
    if let Ok(whole) = word.parse::<i64>() {
        return Some(whole.into());
    }
    serde_json::Number::from_f64(word.parse().ok()?).map(Value::Number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_are_counted_before_they_are_compared() {
        let with = |count: usize| {
            let all: String = (0..count).map(|i| format!(" a{i}=\">\"")).collect();
            parse(&format!("<calibration{all}><f>7</f></calibration>"))
        };
        let (root, tree) = with(MAX_ATTRIBUTES).expect("as many as allowed");
        assert_eq!((root.as_str(), tree["f"].as_i64()), ("calibration", Some(7)));
        // The parser alone takes minutes for these.
        with(1_000_000).expect_err("too many");
    }
}
