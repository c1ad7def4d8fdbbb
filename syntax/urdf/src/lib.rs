//! The links and joints of a URDF, with their locations, for all that read robots from it.
//!
//! The source of the format: <https://wiki.ros.org/urdf/XML>.
//!
#![doc = include_str!("example.md")]

mod cycle;
mod mimic;
mod xacro;

use rc_diagnostics::{Diagnostic, Diagnostics, Name, SourceId, SourceMap, Span};
use rc_xml::XmlSource;
use roxmltree::{Document, Node as Xml};
use std::collections::{BTreeMap, HashMap};

/// What to do with a joint that no tree has.
const IS_A_TREE: &str =
    "a URDF is a tree: leave one of these joints out; a `.kdsl` file closes a loop by `loop`";

/// The kinds of motion of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointType {
    /// It does not move.
    Fixed,
    /// It turns about its axis within limits.
    Revolute,
    /// It turns about its axis without limits.
    Continuous,
    /// It slides along its axis within limits.
    Prismatic,
    /// It moves in all six ways.
    Floating,
    /// It moves in a plane, and turns about its normal.
    Planar,
    /// It turns about each axis through its origin. Files of Bullet have it.
    Spherical,
}

impl JointType {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Fixed,
        Self::Revolute,
        Self::Continuous,
        Self::Prismatic,
        Self::Floating,
        Self::Planar,
        Self::Spherical,
    ];

    /// The word of URDF.
    pub fn word(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Revolute => "revolute",
            Self::Continuous => "continuous",
            Self::Prismatic => "prismatic",
            Self::Floating => "floating",
            Self::Planar => "planar",
            Self::Spherical => "spherical",
        }
    }
}

/// The parsed text of a robot, and the errors in it.
pub struct Reader<'a> {
    /// The text.
    pub text: XmlSource<'a>,
    /// The findings so far.
    pub found: Diagnostics,
}

/// A joint with its name and those of its links.
pub struct Edge<'d> {
    /// The joint.
    pub xml: Xml<'d, 'd>,
    /// Its name.
    pub name: Name,
    /// The link that it is fixed to.
    pub parent: Name,
    /// The link that it moves.
    pub child: Name,
}

/// The contents of a robot.
pub struct Structure<'d> {
    /// The links by their names, which differ.
    pub links: BTreeMap<String, Xml<'d, 'd>>,
    /// The joints, in the order of the file.
    pub joints: Vec<Edge<'d>>,
    /// All other elements.
    pub others: Vec<Xml<'d, 'd>>,
}

impl<'a> Reader<'a> {
    /// The reader of a text.
    pub fn new(sources: &'a SourceMap, source: SourceId) -> Self {
        Self {
            text: XmlSource {
                source,
                text: sources.text(source),
                root: "robot",
                not_supported: "xml-not-supported",
            },
            found: Diagnostics::new(),
        }
    }

    /// Parses the text. There is no document if the text is not XML.
    pub fn parse(&mut self) -> Option<Document<'a>> {
        match self.text.parse() {
            Ok(document) => Some(document),
            Err(problem) => {
                self.found.push(problem);
                None
            }
        }
    }

    /// The outermost element, unless it is not a robot or has macros of xacro.
    pub fn robot<'d>(&mut self, document: &'d Document<'a>) -> Option<Xml<'d, 'd>> {
        let top = document.root_element();
        let tag = self.text.tag(top);
        if top.tag_name().name() != "robot" {
            let message = format!("expected `<robot>`, found `<{}>`", self.text.slice(tag));
            self.error("not-a-urdf", tag, message);
            return None;
        }
        if let Some(macros) = xacro::unexpanded(&self.text, top) {
            self.found.push(macros);
            return None;
        }
        Some(top)
    }

    /// The links and joints. Names that are used twice or name nothing are errors, as are a second
    /// joint above a link, joints that form a cycle, and joints that follow each other in a circle.
    pub fn structure<'d>(&mut self, top: Xml<'d, 'd>) -> Structure<'d> {
        let mut links: BTreeMap<String, Xml<'d, 'd>> = BTreeMap::new();
        let mut joints: Vec<Edge<'d>> = Vec::new();
        let mut others = Vec::new();
        for xml in top.children().filter(Xml::is_element) {
            let tag = xml.tag_name().name();
            match tag {
                "link" => {
                    let Some(name) = self.attribute(xml, "name") else {
                        continue;
                    };
                    if name.text.is_empty() {
                        self.error("bad-value", name.span, "a link has no name".to_owned());
                        continue;
                    }
                    let first = links.get(&name.text);
                    if let Some(first) = first.and_then(|xml| self.text.attribute(*xml, "name")) {
                        let message = format!("duplicate link `{}`", name.text);
                        self.duplicate(name.span, message, first.span);
                        continue;
                    }
                    links.insert(name.text, xml);
                }
                "joint" => joints.extend(self.edge(xml)),
                _ => others.push(xml),
            }
        }
        let mut children: HashMap<&str, Span> = HashMap::new();
        let mut names: HashMap<&str, Span> = HashMap::new();
        for edge in &joints {
            let name = &edge.name;
            let first = *names.entry(&name.text).or_insert(name.span);
            if first != name.span {
                let message = format!("duplicate joint `{}`", name.text);
                self.duplicate(name.span, message, first);
            }
            for link in [&edge.parent, &edge.child] {
                if !links.contains_key(&link.text) {
                    let message = format!("there is no link `{}`", link.text);
                    let error = Diagnostic::error("unknown-link", link.span, message);
                    let names = links.keys().map(String::as_str);
                    self.found.push(error.suggest(&link.text, names));
                }
            }
            let child = &edge.child;
            let first = *children.entry(&child.text).or_insert(child.span);
            if first != child.span {
                let message = format!("the link `{}` has two joints above it", child.text);
                let error = Diagnostic::error("duplicate-id", child.span, message);
                let error = error.label(first, "first used here");
                self.found.push(error.help(IS_A_TREE));
            }
        }
        if !self.found.has_errors() {
            for (span, message) in cycle::cycles(&joints) {
                let error = Diagnostic::error("unknown-link", span, message);
                self.found.push(error.help(IS_A_TREE));
            }
        }
        let followers = joints.iter().filter_map(|edge| {
            let leader = self.text.attribute(child(edge.xml, "mimic")?, "joint")?;
            Some((edge.name.text.clone(), leader))
        });
        for (span, message) in mimic::circles(&followers.collect()) {
            self.error("mimic-circle", span, message);
        }
        if links.is_empty() && !self.found.has_errors() {
            let message = "`<robot>` has no `<link>`".to_owned();
            self.error("not-a-urdf", self.text.tag(top), message);
        }
        Structure {
            links,
            joints,
            others,
        }
    }

    /// An error at `span`.
    pub fn error(&mut self, code: &'static str, span: Span, message: String) {
        self.found.push(Diagnostic::error(code, span, message));
    }

    /// An error of a name at `span` that is already used at `first`.
    fn duplicate(&mut self, span: Span, message: String, first: Span) {
        let error = Diagnostic::error("duplicate-id", span, message);
        self.found.push(error.label(first, "first used here"));
    }

    /// An attribute that has to be there.
    pub fn attribute(&mut self, xml: Xml<'_, '_>, name: &str) -> Option<Name> {
        let found = self.text.attribute(xml, name);
        if found.is_none() {
            let tag = self.text.tag(xml);
            let message = format!("`<{}>` has no attribute `{name}`", self.text.slice(tag));
            self.error("missing-attribute", tag, message);
        }
        found
    }

    /// The numbers of an attribute; the default where it is missing or wrong.
    pub fn numbers<const N: usize>(
        &mut self,
        xml: Xml<'_, '_>,
        name: &str,
        default: [f64; N],
    ) -> [f64; N] {
        let Some(value) = self.text.attribute(xml, name) else {
            return default;
        };
        let words = value.text.split_whitespace();
        let numbers: Option<Vec<f64>> = words
            .map(|word| word.parse().ok().filter(|n: &f64| n.is_finite()))
            .collect();
        numbers
            .and_then(|all| all.try_into().ok())
            .unwrap_or_else(|| {
                let count = if N == 1 {
                    "a number".to_owned()
                } else {
                    format!("{N} numbers")
                };
                let message = format!("expected {count} for `{name}`, found `{}`", value.text);
                self.error("bad-number", value.span, message);
                default
            })
    }

    /// The type of a joint. An unknown one is an error.
    pub fn joint_type(&mut self, joint: Xml<'_, '_>) -> Option<JointType> {
        let form = self.attribute(joint, "type")?;
        let known = JointType::ALL;
        let found = known.into_iter().find(|known| known.word() == form.text);
        if found.is_none() {
            let message = format!("unknown type of a joint `{}`", form.text);
            let error = Diagnostic::error("bad-value", form.span, message);
            let words = known.map(JointType::word);
            self.found.push(error.suggest(&form.text, words));
        }
        found
    }

    /// The number of an attribute; the default where it is missing or wrong.
    pub fn number(&mut self, xml: Xml<'_, '_>, name: &str, default: f64) -> f64 {
        self.numbers(xml, name, [default])[0]
    }

    fn edge<'d>(&mut self, xml: Xml<'d, 'd>) -> Option<Edge<'d>> {
        let name = self.attribute(xml, "name");
        let mut link = |tag: &str| {
            let Some(end) = child(xml, tag) else {
                let span = self.text.tag(xml);
                self.error(
                    "missing-attribute",
                    span,
                    format!("the joint has no `<{tag}>`"),
                );
                return None;
            };
            self.attribute(end, "link")
        };
        let (parent, child) = (link("parent"), link("child"));
        Some(Edge {
            xml,
            name: name?,
            parent: parent?,
            child: child?,
        })
    }
}

/// The first element with this name inside.
pub fn child<'a, 'd>(xml: Xml<'a, 'd>, tag: &str) -> Option<Xml<'a, 'd>> {
    xml.children().find(|child| child.has_tag_name(tag))
}
