//! Changes of the text of a file. Unchanged parts stay as their user wrote them: comments, order,
//! attributes, spellings and units.

use crate::elements::{Element, element};
use crate::read::xml;
use crate::units::Units;
use rc_diagnostics::xml::unchecked;
use rc_diagnostics::{SourceMap, Span};
use rc_xml::XmlSource;
use roxmltree::{Document, Node};
use std::ops::Range;

/// Decimals of a length that is written in millimetres.
const LENGTH_DECIMALS: usize = 9;
/// Decimals of other numbers.
const DECIMALS: usize = 12;

/// Value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Lengths in millimetres. They are written in the unit of the file, with commas between them.
    Lengths(Vec<f64>),
    /// A number without a unit, or an angle in radians.
    Number(f64),
    /// A text as a reader of the file gets it.
    Text(String),
}

impl Value {
    /// A length in millimetres.
    pub fn length(length: f64) -> Self {
        Self::Lengths(vec![length])
    }

    fn written(&self, units: Units) -> String {
        match self {
            Self::Lengths(lengths) => {
                let decimals = match units {
                    Units::Millimetres => LENGTH_DECIMALS,
                    Units::Metres => DECIMALS,
                };
                let one = units.length(1.0);
                let written = lengths.iter().map(|length| number(length / one, decimals));
                written.collect::<Vec<_>>().join(",")
            }
            Self::Number(value) => number(*value, DECIMALS),
            Self::Text(text) => text.clone(),
        }
    }
}

/// A number without zeros at its end.
fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    let is_zero = matches!(text, "" | "-" | "-0");
    (if is_zero { "0" } else { text }).to_owned()
}

/// Whether elements with this tag have an attribute. `name` is its first spelling, such as `tx`.
pub fn has_attribute(tag: &str, name: &str) -> bool {
    element(tag).is_some_and(|element| rank(element, name).is_some())
}

/// Whether elements with this tag may contain others.
pub fn has_children(tag: &str) -> bool {
    element(tag).is_some_and(|element| element.children)
}

/// The unit that a file names for its lengths: `millimetres` or `metres`. Without a name, it has
/// millimetres, or those of the file that includes it.
pub fn units(text: &str) -> Option<&'static str> {
    let own = Parsed::new(text)?.units?;
    let mut words = Units::WORDS.into_iter();
    words.find(|(_, units)| *units == own).map(|(word, _)| word)
}

/// The place of an attribute among those of its element, for any of its spellings.
fn rank(element: &Element, name: &str) -> Option<usize> {
    let mut all = element.attributes();
    all.position(|names| names.contains(&name))
}

/// A parsed text.
struct Parsed<'a> {
    text: &'a str,
    xml: XmlSource<'a>,
    document: Document<'a>,
    /// Those of the file itself.
    units: Option<Units>,
}

impl<'a> Parsed<'a> {
    fn new(text: &'a str) -> Option<Self> {
        // Only offsets are used, so any name of the source will do.
        let source = SourceMap::new().add("", "");
        let xml = xml(source, text);
        let document = xml.parse().ok()?;
        let units = Units::of(xml, document.root_element()).ok().flatten();
        Some(Self {
            text,
            xml,
            document,
            units,
        })
    }

    /// The unit of its lengths, if no file includes it.
    fn length_units(&self) -> Units {
        self.units.unwrap_or(Units::Millimetres)
    }

    /// The element whose tag is at a location.
    fn element(&self, tag: Span) -> Option<Node<'_, 'a>> {
        let start = tag.start.checked_sub(1)?;
        let mut all = self.document.descendants();
        all.find(|node| node.is_element() && node.range().start == start)
    }

    fn spliced(&self, range: Range<usize>, new: &str) -> Option<String> {
        let (before, after) = (self.text.get(..range.start)?, self.text.get(range.end..)?);
        Some([before, new, after].concat())
    }

    fn line_feed(&self) -> &'static str {
        if self.text.contains("\r\n") {
            "\r\n"
        } else {
            "\n"
        }
    }

    /// The white space at the start of a line, if there is nothing else before `at`.
    fn indentation(&self, at: usize) -> Option<&'a str> {
        let before = self.text.get(..at)?;
        let start = before.rfind('\n').map_or(0, |feed| feed + 1);
        let before = before.get(start..)?;
        before.trim().is_empty().then_some(before)
    }
}

/// Sets an attribute of the element whose tag is at `tag`. An existing one keeps its spelling, its
/// place and its quotes; a new one gets the place that the documentation lists. `name` is the first
/// spelling, such as `tx`.
///
/// `None` if the text is not well-formed, has no element there, or the element has no such
/// attribute.
pub fn set(text: &str, tag: Span, name: &str, value: &Value) -> Option<String> {
    let parsed = Parsed::new(text)?;
    let node = parsed.element(tag)?;
    let element = element(node.tag_name().name())?;
    let own = rank(element, name)?;
    let value = unchecked(&value.written(parsed.length_units()));
    let mut before: Option<(usize, usize)> = None;
    for attribute in node.attributes().filter(|a| a.namespace().is_none()) {
        let Some(rank) = rank(element, attribute.name()) else {
            continue;
        };
        if rank == own {
            let span = parsed.xml.attribute_value(&attribute).span;
            return parsed.spliced(span.start..span.end, &value);
        }
        let is_last = before.is_none_or(|(last, _)| last < rank);
        if rank < own && is_last {
            before = Some((rank, attribute.range().end));
        }
    }
    let at = before.map_or(parsed.xml.tag(node).end, |(_, end)| end);
    parsed.spliced(at..at, &format!(" {name}=\"{value}\""))
}

/// Adds an element as the last one in the element whose tag is at `parent`; `None` is the outermost
/// element. It gets a line of its own, indented as its siblings.
///
/// `None` if the text is not well-formed, or has no element there.
pub fn add(
    text: &str,
    parent: Option<Span>,
    tag: &str,
    attributes: &[(&str, Value)],
) -> Option<String> {
    let parsed = Parsed::new(text)?;
    let above = match parent {
        Some(tag) => parsed.element(tag)?,
        None => parsed.document.root_element(),
    };
    let mut new = format!("<{tag}");
    for (name, value) in attributes {
        let value = unchecked(&value.written(parsed.length_units()));
        new.push_str(&format!(" {name}=\"{value}\""));
    }
    new.push_str("/>");
    let feed = parsed.line_feed();
    let outer = parsed.indentation(above.range().start).unwrap_or_default();
    let siblings = above.children().rev().filter(Node::is_element);
    let mut inner = siblings.filter_map(|child| parsed.indentation(child.range().start));
    let inner = inner.next().map(str::to_owned);
    let inner = inner.unwrap_or_else(|| format!("{outer}    "));
    let end = above.range().end;
    let written = text.get(above.range())?;
    if let Some(open) = written.strip_suffix("/>") {
        let name = parsed.xml.slice(parsed.xml.tag(above));
        let at = above.range().start + open.trim_end().len();
        let content = format!(">{feed}{inner}{new}{feed}{outer}</{name}>");
        return parsed.spliced(at..end, &content);
    }
    let close = above.range().start + written.rfind("</")?;
    match parsed.indentation(close) {
        Some(indentation) => {
            let at = close - indentation.len();
            parsed.spliced(at..at, &format!("{inner}{new}{feed}"))
        }
        None => parsed.spliced(close..close, &format!("{feed}{inner}{new}{feed}{outer}")),
    }
}

/// Removes the element whose tag is at `tag` with all in it, and its line if nothing else is there.
///
/// `None` if the text is not well-formed, or has no element there.
pub fn remove(text: &str, tag: Span) -> Option<String> {
    let parsed = Parsed::new(text)?;
    let mut range = parsed.element(tag)?.range();
    let after = text.get(range.end..)?;
    let rest = after.find('\n').map_or(after, |feed| &after[..=feed]);
    if let Some(indentation) = parsed.indentation(range.start)
        && rest.trim().is_empty()
    {
        range = range.start - indentation.len()..range.end + rest.len();
    }
    parsed.spliced(range, "")
}
