//! What the world says of the nodes of the tree.

use innermodel::kinds::{Engine, Transform as Plain};
use innermodel::language::model::Node;
use innermodel::{Folders, Kind, NodeRef, Pose, ROOT, Transform};
use property_graph::{Element, Id, NodeId, Snapshot, Value};
use std::collections::{BTreeSet, HashMap};
use std::path::Path;

/// Millimetres in a metre: the world has metres.
const METRE: f64 = 1000.0;

/// What the world says of a node.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Part {
    pub(crate) parent: String,
    /// Where it is in its parent, in metres.
    pub(crate) pose: [f64; 6],
    /// As in a file, but without its pose; empty for a frame.
    pub(crate) element: String,
    /// Of a joint.
    pub(crate) position: Option<f64>,
    /// Name, type and value of each attribute that was added.
    pub(crate) attributes: Vec<String>,
}

/// The frames of which a value has changed between two versions of a world. `None` if it is more than that.
pub(crate) fn touched(shown: &Snapshot, world: &Snapshot) -> Option<BTreeSet<NodeId>> {
    use property_graph::Change as Of;
    let holds = |of: &Snapshot, edge: property_graph::EdgeId| {
        let edge = of.edge(edge);
        edge.is_ok_and(|edge| of.schema().is_a(edge.type_name(), "RT"))
    };
    let mut touched = BTreeSet::new();
    for change in world.since(shown) {
        match change {
            Of::Attribute(Element::Node(node), name) => {
                if world.frame(node).is_ok() {
                    // Ids in the tree depend on names.
                    if world.text(name) == "name" {
                        return None;
                    }
                    touched.insert(node);
                }
            }
            Of::Attribute(Element::Edge(edge), _) => {
                if holds(world, edge) {
                    touched.insert(world.edge(edge).ok()?.to());
                }
            }
            Of::NodeAdded(node) if world.frame(node).is_ok() => return None,
            Of::NodeRemoved(node, _) if shown.frame(node).is_ok() => return None,
            Of::EdgeAdded(edge) if holds(world, edge) => return None,
            Of::EdgeRemoved(edge, _) if holds(shown, edge) => return None,
            Of::NodeAdded(_) | Of::NodeRemoved(..) | Of::EdgeAdded(_) | Of::EdgeRemoved(..) => {}
        }
    }
    Some(touched)
}

/// What a node of the world says, which is at a pose in a parent.
pub(crate) fn part_of(node: &property_graph::NodeRef<'_>, pose: Pose, parent: String) -> Part {
    let ([x, y, z], [rx, ry, rz]) = (pose.translation, pose.rotation);
    let attributes = match node.get("attributes") {
        Some(Value::Texts(all)) => all.iter().map(|text| text.to_string()).collect(),
        _ => Vec::new(),
    };
    let element = node.get("element").and_then(Value::as_str);
    Part {
        parent,
        pose: [x, y, z, rx, ry, rz],
        element: element.unwrap_or_default().to_owned(),
        position: node.get("position").and_then(Value::as_f64),
        attributes,
    }
}

/// A node as its element says it.
pub(crate) fn described(
    id: &str,
    element: &str,
    place: &Path,
    folders: &Folders,
) -> Result<Node, String> {
    if element.is_empty() {
        return Ok(Node::new(id, Kind::Transform(Plain::default())));
    }
    let text = format!("<innerModel>{element}</innerModel>");
    let read = innermodel::read_text(&text, place, folders);
    let (mut document, _) = read.map_err(|error| error.to_string())?;
    match (document.nodes.pop(), document.nodes.is_empty()) {
        (Some(node), true) => Ok(node),
        _ => Err("expected one element without children".to_owned()),
    }
}

/// The pose of a node in millimetres; that of a joint at 0.
pub(crate) fn rest(kind: &Kind, part: &Part) -> Pose {
    let [x, y, z, rx, ry, rz] = part.pose;
    let pose = Pose::new(x * METRE, y * METRE, z * METRE, rx, ry, rz);
    match (kind, part.position) {
        (Kind::Joint(joint), Some(position)) if position != 0.0 => {
            let turned = Transform::about(joint.axis, position);
            (Transform::of(&pose) * turned.inverse()).pose()
        }
        (kind, _) if kind.has_pose() => pose,
        _ => Pose::default(),
    }
}

/// What the world has to say of a node.
pub(crate) fn part(node: &NodeRef<'_>) -> Part {
    let kind = node.kind();
    let pose = match kind {
        Kind::Joint(_) | Kind::Prismatic(_) => node.local().pose(),
        _ => node.pose(),
    };
    let [x, y, z] = pose.translation.map(|length| length / METRE);
    let [rx, ry, rz] = pose.rotation;
    let is_frame = matches!(kind, Kind::Transform(Plain { engine: Engine::Static, mass, .. }) if *mass == 0.0)
        && node.allowed().is_empty();
    let position = node.position();
    Part {
        parent: node
            .parent()
            .map_or_else(String::new, |above| above.id().to_owned()),
        pose: [x, y, z, rx, ry, rz],
        element: if is_frame {
            String::new()
        } else {
            node.element_at_rest()
        },
        position: position
            .filter(|position| *position != 0.0 || matches!(kind, Kind::Prismatic(_))),
        attributes: node
            .attributes()
            .flat_map(|(name, form, value)| [name, form, value].map(str::to_owned))
            .collect(),
    }
}

/// The frames of the world, parents before their children.
pub(crate) fn read(world: &Snapshot) -> Vec<(String, (Id, Part))> {
    let mut nodes = HashMap::new();
    let mut names: HashMap<&str, usize> = HashMap::new();
    for node in world.nodes() {
        if let Ok(frame) = world.frame(node.node_id()) {
            nodes.insert(frame.node(), node);
            *names.entry(node.name()).or_default() += 1;
        }
    }
    let mut found = Vec::new();
    let mut rest = vec![(world.tree().root().node_id(), ROOT.to_owned())];
    while let Some((key, above)) = rest.pop() {
        let Ok(frame) = world.tree().node(key) else {
            continue;
        };
        let is_top = frame.parent().is_none();
        let mut below: Vec<_> = frame
            .children()
            .filter_map(|child| Some((child, *nodes.get(&child.node_id())?)))
            .collect();
        below.sort_unstable_by_key(|(_, node)| node.id());
        for (child, node) in below {
            if is_top && node.name() == ROOT {
                rest.push((child.node_id(), ROOT.to_owned()));
                continue;
            }
            let id = id_of(&node, &names);
            let part = part_of(&node, child.pose(), above.clone());
            found.push((id.clone(), (node.id(), part)));
            rest.push((child.node_id(), id));
        }
    }
    found
}

/// The id of a node in the tree: its name, or one that no other node has.
fn id_of(node: &property_graph::NodeRef<'_>, names: &HashMap<&str, usize>) -> String {
    let (name, id) = (node.name(), node.id());
    if !name.is_empty() && name != ROOT && names.get(name) == Some(&1) {
        return name.to_owned();
    }
    let mut own = format!("{name}#{}:{}", id.writer(), id.count());
    while names.contains_key(own.as_str()) {
        own.push('_');
    }
    own
}
