//! From URDF to a document.

mod bodies;

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
use rc_urdf::{Edge, JointType, Structure, child};
use roxmltree::Node as Xml;
use std::collections::{BTreeMap, HashSet};

/// How deep links may be nested.
const MAX_DEPTH: usize = 512;

/// Elements that are read, or mean nothing for a tree of frames.
const KNOWN: [&str; 4] = ["link", "joint", "material", "origin"];

/// Reads a robot. The document is complete unless an error was found. Warnings list what a tree of
/// InnerModel cannot express.
///
/// A link is a node with its name, a joint that moves one with the name of the joint. If both names
/// are equal and the axis is x, y or z, the joint is the link.
pub fn read(sources: &SourceMap, source: SourceId) -> (Document, Diagnostics) {
    let mut urdf = rc_urdf::Reader::new(sources, source);
    let Some(text) = urdf.parse() else {
        return (Document::default(), urdf.found);
    };
    let Some(top) = urdf.robot(&text) else {
        return (Document::default(), urdf.found);
    };
    let mut reader = Reader {
        urdf,
        document: Document::default(),
        ids: HashSet::new(),
        colours: BTreeMap::new(),
    };
    reader.robot(top);
    (reader.document, reader.urdf.found)
}

struct Reader<'a> {
    urdf: rc_urdf::Reader<'a>,
    document: Document,
    ids: HashSet<String>,
    /// Materials with a name, and their colours as `#rrggbb`.
    colours: BTreeMap<String, String>,
}

fn pose(place: &Placement) -> Pose {
    Pose {
        translation: place.translation,
        rotation: angles(&place.rotation),
    }
}

impl Reader<'_> {
    fn misses(&mut self, span: Span, message: String) {
        self.urdf
            .found
            .push(Diagnostic::warning("lost-on-import", span, message));
    }

    fn robot<'d>(&mut self, top: Xml<'d, 'd>) {
        let Structure {
            links,
            joints: edges,
            others,
        } = self.urdf.structure(top);
        for xml in others {
            let (tag, span) = (xml.tag_name().name(), self.urdf.text.tag(xml));
            if tag == "material" {
                let name = self.urdf.text.attribute(xml, "name");
                if let (Some(name), Some(colour)) = (name, self.colour(xml)) {
                    self.colours.insert(name.text, colour);
                }
                continue;
            }
            let message = format!("InnerModel has no words for `<{tag}>`");
            let finding = Diagnostic::warning("lost-on-import", span, message);
            let finding = finding.did_you_mean(tag, nearest(tag, KNOWN));
            self.urdf.found.push(finding);
        }
        let mut below: BTreeMap<&str, Vec<&Edge<'d>>> = BTreeMap::new();
        let mut children: HashSet<&str> = HashSet::new();
        for edge in &edges {
            children.insert(&edge.child.text);
            below.entry(&edge.parent.text).or_default().push(edge);
        }
        if self.urdf.found.has_errors() {
            return;
        }
        self.ids.extend(links.keys().cloned());
        let tops = links
            .iter()
            .filter(|(name, _)| !children.contains(name.as_str()));
        let tops: Vec<(&String, &Xml<'d, 'd>)> = tops.collect();
        // The links still to read: their node, and how deep they are.
        let mut rest: Vec<(&str, Option<usize>, usize)> = Vec::new();
        for (name, _) in tops {
            let frame = Node::new(name, Kind::Transform(Transform::default()));
            let node = (name != ROOT).then(|| self.push(frame));
            rest.push((name, node, 0));
        }
        while let Some((name, node, depth)) = rest.pop() {
            let Some(xml) = links.get(name) else { continue };
            self.link(*xml, name, node);
            if depth == MAX_DEPTH {
                let message = format!("links are nested more than {MAX_DEPTH} deep");
                return self
                    .urdf
                    .error("nested-too-deep", self.urdf.text.tag(*xml), message);
            }
            for edge in below.get(name).into_iter().flatten() {
                let inner = self.joint(edge, node);
                rest.push((&edge.child.text, Some(inner), depth + 1));
            }
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

    /// The lengths of an attribute in millimetres; the default, in metres, where it is missing or
    /// wrong.
    fn lengths<const N: usize>(
        &mut self,
        xml: Xml<'_, '_>,
        name: &str,
        default: [f64; N],
    ) -> [f64; N] {
        let lengths = self.urdf.numbers(xml, name, default).map(|n| n * METRE);
        if lengths.iter().all(|length| length.is_finite()) {
            return lengths;
        }
        if let Some(value) = self.urdf.text.attribute(xml, name) {
            let message = format!("`{name}` is too great, found `{}`", value.text);
            self.urdf.error("bad-value", value.span, message);
        }
        default.map(|n| n * METRE)
    }

    /// The place of the child `origin`, in the frame and unit of InnerModel.
    fn origin(&mut self, xml: Xml<'_, '_>) -> Placement {
        let Some(origin) = child(xml, "origin") else {
            return Placement::HERE;
        };
        let place = Placement {
            translation: self.lengths(origin, "xyz", [0.0; 3]),
            rotation: of_rpy(self.urdf.numbers(origin, "rpy", [0.0; 3])),
        };
        place.changed(&transposed(&TO_URDF), 1.0)
    }

    /// Says how a joint follows another one: InnerModel couples no joints.
    fn mimic(&mut self, mimic: Xml<'_, '_>, joint: &Name, form: JointType) {
        let Some(leader) = self.urdf.attribute(mimic, "joint") else {
            return;
        };
        let (multiplier, offset) = (
            self.urdf.number(mimic, "multiplier", 1.0),
            self.urdf.number(mimic, "offset", 0.0),
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
            self.urdf.error("unknown-joint", leader.span, message);
            return;
        };
        // Positions of a prismatic joint become millimetres.
        let prismatic = JointType::Prismatic.word();
        let unit = |form: &str| if form == prismatic { METRE } else { 1.0 };
        let own = unit(form.word());
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
        self.misses(self.urdf.text.tag(mimic), message);
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
        let form = self.urdf.joint_type(xml).unwrap_or(JointType::Fixed);
        if let Some(mimic) = child(xml, "mimic") {
            self.mimic(mimic, &edge.name, form);
        }
        for tag in ["dynamics", "calibration", "safety_controller"] {
            if let Some(lost) = child(xml, tag) {
                let message = format!("InnerModel has no words for `<{tag}>` of a joint");
                self.misses(self.urdf.text.tag(lost), message);
            }
        }
        let turns = matches!(form, JointType::Revolute | JointType::Continuous);
        if !turns && form != JointType::Prismatic {
            if form != JointType::Fixed {
                let message = format!(
                    "a {} joint becomes a transform, which moves freely",
                    form.word()
                );
                let place = self.urdf.text.attribute(xml, "type");
                let place = place.map_or_else(|| self.urdf.text.tag(xml), |form| form.span);
                self.misses(place, message);
            }
            let kind = Kind::Transform(Transform::default());
            return self.push(Node {
                parent,
                pose: pose(&here),
                ..Node::new(link, kind)
            });
        }
        let axis = child(xml, "axis");
        let axis = axis.map_or([1.0, 0.0, 0.0], |axis| {
            self.urdf.numbers(axis, "xyz", [1.0, 0.0, 0.0])
        });
        // A rotation changes its sense where the hand changes.
        let sense = if turns { -1.0 } else { 1.0 };
        let axis = apply(&transposed(&TO_URDF), &axis).map(|n| n * sense);
        let (axis, turn) = self.axis(&axis, xml);
        let (mut min, mut max) = (f64::NEG_INFINITY, f64::INFINITY);
        let limit = child(xml, "limit");
        let max_speed = limit.map_or(0.0, |limit| self.max_speed(limit, turns));
        if form != JointType::Continuous
            && let Some(limit) = limit
        {
            let mut bound = |name: &str| {
                let [bound] = if turns {
                    self.urdf.numbers(limit, name, [0.0])
                } else {
                    self.lengths(limit, name, [0.0])
                };
                bound
            };
            (min, max) = (bound("lower"), bound("upper"));
            if min > max {
                let message = "`lower` is greater than `upper`".to_owned();
                self.urdf
                    .error("bad-value", self.urdf.text.tag(limit), message);
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
            self.urdf.numbers(limit, "velocity", [0.0])
        } else {
            self.lengths(limit, "velocity", [0.0])
        };
        if speed < 0.0
            && let Some(value) = self.urdf.text.attribute(limit, "velocity")
        {
            let message = format!("`velocity` cannot be negative, found `{}`", value.text);
            self.urdf.error("bad-value", value.span, message);
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
            self.urdf
                .error("bad-value", self.urdf.text.tag(xml), message);
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
