//! From URDF to a document.

mod bodies;
mod mimic;
mod xacro;

use super::METRE;
use super::write::NO_SPEED;
use crate::matrix::{
    IDENTITY, Matrix, Placement, TO_URDF, Vector, angles, apply, between, of_rpy, transposed, unit,
};
use innermodel_language::Pose;
use innermodel_language::model::{
    Axis, Document, Encoder, Joint, Kind, Node, Prismatic, ROOT, Transform,
};
use rc_diagnostics::{Diagnostic, Diagnostics, Name, SourceId, SourceMap, Span, nearest};
use rc_xml::XmlSource;
use roxmltree::Node as Xml;
use std::collections::{BTreeMap, HashMap, HashSet};

/// How deep links may be nested.
const MAX_DEPTH: usize = 512;

/// Elements that are read, or mean nothing for a tree of frames.
const KNOWN: [&str; 4] = ["link", "joint", "material", "origin"];

/// Reads a robot. The document is complete unless an error was found. Warnings tell what a tree of
/// InnerModel has no words for.
///
/// A link is a node with its name, a joint that moves one with the name of the joint. If both names
/// are equal and the axis is x, y or z, the joint is the link.
pub fn read(sources: &SourceMap, source: SourceId) -> (Document, Diagnostics) {
    let mut found = Diagnostics::new();
    let text = XmlSource {
        source,
        text: sources.text(source),
        root: "robot",
        not_supported: "xml-not-supported",
    };
    let document = match text.parse() {
        Ok(document) => document,
        Err(problem) => {
            found.push(problem);
            return (Document::default(), found);
        }
    };
    let top = document.root_element();
    if top.tag_name().name() != "robot" {
        let message = format!(
            "expected `<robot>`, found `<{}>`",
            text.slice(text.tag(top))
        );
        found.push(Diagnostic::error("not-a-urdf", text.tag(top), message));
        return (Document::default(), found);
    }
    if let Some(macros) = xacro::unexpanded(&text, top) {
        found.push(macros);
        return (Document::default(), found);
    }
    let mut reader = Reader {
        text,
        found,
        document: Document::default(),
        ids: HashSet::new(),
        colours: BTreeMap::new(),
    };
    reader.robot(top);
    (reader.document, reader.found)
}

struct Reader<'a> {
    text: XmlSource<'a>,
    found: Diagnostics,
    document: Document,
    ids: HashSet<String>,
    /// Materials with a name, and their colours as `#rrggbb`.
    colours: BTreeMap<String, String>,
}

/// A joint with its name and those of its links.
struct Edge<'d> {
    xml: Xml<'d, 'd>,
    name: Name,
    parent: Name,
    child: Name,
}

fn pose(place: &Placement) -> Pose {
    Pose {
        translation: place.translation,
        rotation: angles(&place.rotation),
    }
}

impl Reader<'_> {
    fn error(&mut self, code: &'static str, span: Span, message: String) {
        self.found.push(Diagnostic::error(code, span, message));
    }

    /// An error of a name at `span` that is already used at `first`.
    fn duplicate(&mut self, span: Span, message: String, first: Span) {
        let error = Diagnostic::error("duplicate-id", span, message);
        self.found.push(error.label(first, "first used here"));
    }

    fn misses(&mut self, span: Span, message: String) {
        self.found
            .push(Diagnostic::warning("lost-on-import", span, message));
    }

    fn robot<'d>(&mut self, top: Xml<'d, 'd>) {
        let mut links: BTreeMap<String, Xml<'d, 'd>> = BTreeMap::new();
        let mut edges: Vec<Edge<'d>> = Vec::new();
        for xml in top.children().filter(Xml::is_element) {
            let (tag, span) = (xml.tag_name().name(), self.text.tag(xml));
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
                "joint" => edges.extend(self.edge(xml)),
                "material" => {
                    let name = self.text.attribute(xml, "name");
                    if let (Some(name), Some(colour)) = (name, self.colour(xml)) {
                        self.colours.insert(name.text, colour);
                    }
                }
                _ => {
                    let message = format!("InnerModel has no words for `<{tag}>`");
                    let finding = Diagnostic::warning("lost-on-import", span, message);
                    self.found
                        .push(finding.did_you_mean(tag, nearest(tag, KNOWN)));
                }
            }
        }
        let mut below: BTreeMap<&str, Vec<&Edge<'d>>> = BTreeMap::new();
        let mut children: HashMap<&str, Span> = HashMap::new();
        let mut names: HashMap<&str, Span> = HashMap::new();
        for edge in &edges {
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
                self.duplicate(child.span, message, first);
            }
            below.entry(&edge.parent.text).or_default().push(edge);
        }
        let followers = edges.iter().filter_map(|edge| {
            let leader = self.text.attribute(child_of(edge.xml, "mimic")?, "joint")?;
            Some((edge.name.text.clone(), leader))
        });
        for (span, message) in mimic::circles(&followers.collect()) {
            self.error("mimic-circle", span, message);
        }
        if self.found.has_errors() {
            return;
        }
        if links.is_empty() {
            let message = "`<robot>` has no `<link>`".to_owned();
            return self.error("not-a-urdf", self.text.tag(top), message);
        }
        self.ids.extend(links.keys().cloned());
        let tops = links
            .iter()
            .filter(|(name, _)| !children.contains_key(name.as_str()));
        let tops: Vec<(&String, &Xml<'d, 'd>)> = tops.collect();
        let mut left = links.len();
        // The links still to read: their node, and how deep they are.
        let mut rest: Vec<(&str, Option<usize>, usize)> = Vec::new();
        for (name, _) in tops {
            let frame = Node::new(name, Kind::Transform(Transform::default()));
            let node = (name != ROOT).then(|| self.push(frame));
            rest.push((name, node, 0));
        }
        while let Some((name, node, depth)) = rest.pop() {
            left -= 1;
            let Some(xml) = links.get(name) else { continue };
            self.link(*xml, name, node);
            if depth == MAX_DEPTH {
                let message = format!("links are nested more than {MAX_DEPTH} deep");
                return self.error("nested-too-deep", self.text.tag(*xml), message);
            }
            for edge in below.get(name).into_iter().flatten() {
                let inner = self.joint(edge, node);
                rest.push((&edge.child.text, Some(inner), depth + 1));
            }
        }
        if left > 0 {
            let span = self.text.tag(top);
            self.error(
                "unknown-link",
                span,
                "the joints of some links form a circle".to_owned(),
            );
        }
    }

    /// Adds a node, and returns its place.
    fn push(&mut self, node: Node) -> usize {
        self.document.nodes.push(node);
        self.document.nodes.len() - 1
    }

    /// An id like `wanted` that no node has.
    fn fresh(&mut self, wanted: &str) -> String {
        let mut id = wanted.to_owned();
        let mut number = 1;
        while id == ROOT || id.is_empty() || !self.ids.insert(id.clone()) {
            number += 1;
            id = format!("{wanted}_{number}");
        }
        id
    }

    /// An attribute that has to be there.
    fn attribute(&mut self, xml: Xml<'_, '_>, name: &str) -> Option<Name> {
        let found = self.text.attribute(xml, name);
        if found.is_none() {
            let tag = self.text.tag(xml);
            let message = format!("`<{}>` has no attribute `{name}`", self.text.slice(tag));
            self.error("missing-attribute", tag, message);
        }
        found
    }

    /// The numbers of an attribute; the default where it is missing or wrong.
    fn numbers<const N: usize>(
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

    fn number(&mut self, xml: Xml<'_, '_>, name: &str, default: f64) -> f64 {
        self.numbers(xml, name, [default])[0]
    }

    /// The lengths of an attribute in millimetres; the default, in metres, where it is missing or
    /// wrong.
    fn lengths<const N: usize>(
        &mut self,
        xml: Xml<'_, '_>,
        name: &str,
        default: [f64; N],
    ) -> [f64; N] {
        let lengths = self.numbers(xml, name, default).map(|n| n * METRE);
        if lengths.iter().all(|length| length.is_finite()) {
            return lengths;
        }
        if let Some(value) = self.text.attribute(xml, name) {
            let message = format!("`{name}` is too great, found `{}`", value.text);
            self.error("bad-value", value.span, message);
        }
        default.map(|n| n * METRE)
    }

    /// The place of the child `origin`, in the frame and unit of InnerModel.
    fn origin(&mut self, xml: Xml<'_, '_>) -> Placement {
        let Some(origin) = child_of(xml, "origin") else {
            return Placement::HERE;
        };
        let place = Placement {
            translation: self.lengths(origin, "xyz", [0.0; 3]),
            rotation: of_rpy(self.numbers(origin, "rpy", [0.0; 3])),
        };
        place.changed(&transposed(&TO_URDF), 1.0)
    }

    fn edge<'d>(&mut self, xml: Xml<'d, 'd>) -> Option<Edge<'d>> {
        let name = self.attribute(xml, "name");
        let mut link = |tag: &str| {
            let Some(end) = child_of(xml, tag) else {
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

    /// Says how a joint follows another one: InnerModel couples no joints.
    fn mimic(&mut self, mimic: Xml<'_, '_>, joint: &Name, form: &str) {
        let Some(leader) = self.attribute(mimic, "joint") else {
            return;
        };
        let (multiplier, offset) = (
            self.number(mimic, "multiplier", 1.0),
            self.number(mimic, "offset", 0.0),
        );
        let of_leader = mimic.parent().and_then(|joint| {
            let mut joints = joint
                .parent()?
                .children()
                .filter(|c| c.has_tag_name("joint"));
            joints.find(|joint| joint.attribute("name") == Some(&leader.text))
        });
        let Some(of_leader) = of_leader else {
            let message = format!("there is no joint `{}`", leader.text);
            self.error("unknown-joint", leader.span, message);
            return;
        };
        // Positions of a prismatic joint become millimetres.
        let unit = |form: &str| if form == "prismatic" { METRE } else { 1.0 };
        let own = unit(form);
        let multiplier = multiplier * own / unit(of_leader.attribute("type").unwrap_or_default());
        let (joint, leader, offset) = (&joint.text, &leader.text, offset * own);
        let sum = match offset {
            0.0 => String::new(),
            below if below < 0.0 => format!(" - {}", -below),
            _ => format!(" + {offset}"),
        };
        let message = format!(
            "InnerModel couples no joints: move `{joint}` to {multiplier} * `{leader}`{sum} \
            wherever you move `{leader}`"
        );
        self.misses(self.text.tag(mimic), message);
    }

    /// Adds a joint and the node of the link below it, which it returns.
    fn joint(&mut self, edge: &Edge<'_>, parent: Option<usize>) -> usize {
        let xml = edge.xml;
        let here = self.origin(xml);
        // The root of the tree has this id.
        let is_root = edge.child.text == ROOT;
        let link = if is_root {
            self.fresh(ROOT)
        } else {
            edge.child.text.clone()
        };
        let link = &link;
        let form = self.text.attribute(xml, "type");
        let form = form.unwrap_or_else(|| Name::new("", self.text.tag(xml)));
        if let Some(mimic) = child_of(xml, "mimic") {
            self.mimic(mimic, &edge.name, &form.text);
        }
        for tag in ["dynamics", "calibration", "safety_controller"] {
            if let Some(lost) = child_of(xml, tag) {
                let message = format!("InnerModel has no words for `<{tag}>` of a joint");
                self.misses(self.text.tag(lost), message);
            }
        }
        let turns = matches!(form.text.as_str(), "revolute" | "continuous");
        if !turns && form.text != "prismatic" {
            if !["fixed", "floating", "planar"].contains(&form.text.as_str()) {
                let known = [
                    "fixed",
                    "revolute",
                    "continuous",
                    "prismatic",
                    "floating",
                    "planar",
                ];
                let message = format!("unknown type of a joint `{}`", form.text);
                let error = Diagnostic::error("bad-value", form.span, message);
                self.found.push(error.suggest(&form.text, known));
            } else if form.text != "fixed" {
                let message = format!(
                    "a {} joint becomes a transform, which moves freely",
                    form.text
                );
                self.misses(form.span, message);
            }
            let kind = Kind::Transform(Transform::default());
            return self.push(Node {
                parent,
                pose: pose(&here),
                ..Node::new(link, kind)
            });
        }
        let axis = child_of(xml, "axis");
        let axis = axis.map_or([1.0, 0.0, 0.0], |axis| {
            self.numbers(axis, "xyz", [1.0, 0.0, 0.0])
        });
        // A rotation changes its sense where the hand changes.
        let sense = if turns { -1.0 } else { 1.0 };
        let axis = apply(&transposed(&TO_URDF), &axis).map(|n| n * sense);
        let (axis, turn) = self.axis(&axis, xml);
        let (mut min, mut max) = (f64::NEG_INFINITY, f64::INFINITY);
        let limit = child_of(xml, "limit");
        let max_speed = limit.map_or(0.0, |limit| self.max_speed(limit, turns));
        if form.text != "continuous"
            && let Some(limit) = limit
        {
            let mut bound = |name: &str| {
                let [bound] = if turns {
                    self.numbers(limit, name, [0.0])
                } else {
                    self.lengths(limit, name, [0.0])
                };
                bound
            };
            (min, max) = (bound("lower"), bound("upper"));
            if min > max {
                let message = "`lower` is greater than `upper`".to_owned();
                self.error("bad-value", self.text.tag(limit), message);
            }
        }
        let named = &edge.name.text;
        let is_link = named == link && turn == IDENTITY && (turns || here == Placement::HERE);
        let id = if is_link {
            named.clone()
        } else {
            self.fresh(named)
        };
        let turned = here.then_inner(&Placement {
            rotation: turn,
            translation: [0.0; 3],
        });
        let moving = if turns {
            self.push(Node {
                parent,
                pose: pose(&turned),
                ..Node::new(
                    &id,
                    Kind::Joint(Joint {
                        axis,
                        min,
                        max,
                        home: 0.0,
                        max_speed,
                        encoder: Encoder::default(),
                        port: 0,
                        low: [0.0; 3],
                        high: [0.0; 3],
                    }),
                )
            })
        } else {
            // A prismatic joint has no pose of its own.
            let base = (turned != Placement::HERE).then(|| {
                let base = self.fresh(&format!("{id}_base"));
                self.push(Node {
                    parent,
                    pose: pose(&turned),
                    ..Node::new(&base, Kind::Transform(Transform::default()))
                })
            });
            self.push(Node {
                parent: base.or(parent),
                ..Node::new(
                    &id,
                    Kind::Prismatic(Prismatic {
                        axis,
                        min,
                        max,
                        home: 0.0,
                        max_speed,
                        encoder: Encoder::default(),
                        position: 0.0,
                        offset: 0.0,
                        port: 0,
                    }),
                )
            })
        };
        if is_link {
            return moving;
        }
        let back = Placement {
            rotation: transposed(&turn),
            translation: [0.0; 3],
        };
        self.push(Node {
            parent: Some(moving),
            pose: pose(&back),
            ..Node::new(link, Kind::Transform(Transform::default()))
        })
    }

    /// The greatest speed of a joint. An export marks the velocity of a joint without one, since
    /// URDF demands a velocity.
    fn max_speed(&mut self, limit: Xml<'_, '_>, turns: bool) -> f64 {
        let [speed] = if turns {
            self.numbers(limit, "velocity", [0.0])
        } else {
            self.lengths(limit, "velocity", [0.0])
        };
        if speed < 0.0
            && let Some(value) = self.text.attribute(limit, "velocity")
        {
            let message = format!("`velocity` cannot be negative, found `{}`", value.text);
            self.error("bad-value", value.span, message);
        }
        let is_none = limit
            .children()
            .any(|inside| inside.is_comment() && inside.text() == Some(NO_SPEED));
        if is_none { 0.0 } else { speed }
    }

    /// An axis of InnerModel, and the rotation that takes it to the wanted one.
    fn axis(&mut self, wanted: &Vector, xml: Xml<'_, '_>) -> (Axis, Matrix) {
        let Some(wanted) = unit(wanted) else {
            let message = "the axis of the joint is 0".to_owned();
            self.error("bad-value", self.text.tag(xml), message);
            return (Axis::Z, IDENTITY);
        };
        for axis in [Axis::X, Axis::Y, Axis::Z] {
            if wanted[axis.index()] > 1.0 - 1e-12 {
                return (axis, IDENTITY);
            }
        }
        (Axis::Z, between(&[0.0, 0.0, 1.0], &wanted))
    }
}

fn child_of<'a, 'd>(xml: Xml<'a, 'd>, tag: &str) -> Option<Xml<'a, 'd>> {
    xml.children().find(|child| child.has_tag_name(tag))
}
