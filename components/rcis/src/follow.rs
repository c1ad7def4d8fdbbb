//! A tree of another component that the scene follows.

use crate::elements::{self, MOST_NODES};
use innermodel::{Edit, Error, Kind, NewNode, NodeRef, Pose, ROOT};
use innermodel_simulation::World;
use rc_diagnostics::foreign::clean;
use rcis_generated::{Attribute, Followed, Node, Unmade};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::Path;

/// What the tree says of a node.
#[derive(Clone, Debug)]
struct Said {
    parent: String,
    kind: Kind,
    /// In millimetres; of a joint, at position 0.
    pose: Pose,
    allowed: Vec<String>,
    /// Of a joint.
    position: f64,
    attributes: Vec<Attribute>,
}

impl Said {
    /// Reads a node that a client sends.
    fn read(scene: &Path, node: Node) -> Result<Self, String> {
        let document = elements::read(scene, &node.element);
        let mut document = document.map_err(|refused| refused.text())?;
        match (document.nodes.pop(), document.nodes.is_empty()) {
            (Some(described), true) if described.id == node.id => Ok(Self {
                parent: node.parent,
                kind: described.kind,
                pose: described.pose,
                allowed: described.allowed,
                position: node.position,
                attributes: node.attributes,
            }),
            _ => Err("expected one element with the id of the node, and none in it".to_owned()),
        }
    }

    /// A node that the scene had before the tree said anything of it.
    fn of(node: &NodeRef<'_>) -> Self {
        let parent = node.parent().map(|above| above.id().to_owned());
        let attributes = node.attributes().map(|(name, form, value)| Attribute {
            name: name.to_owned(),
            type_: form.to_owned(),
            value: value.to_owned(),
        });
        Self {
            parent: parent.unwrap_or_default(),
            kind: node.kind().clone(),
            pose: node.pose(),
            allowed: node.allowed().to_vec(),
            position: node.position().unwrap_or_default(),
            attributes: attributes.collect(),
        }
    }
}

/// Nodes by their ids.
type Nodes = Vec<(String, Said)>;

/// The nodes of the tree, as it said them the last time.
#[derive(Debug, Default)]
pub(crate) struct Following {
    said: HashMap<String, Said>,
}

impl Following {
    /// Makes in a world what the tree has: the operation `follow` of `Simulation`.
    pub(crate) fn follow(
        &mut self,
        world: &mut World,
        scene: &Path,
        (whole, removed, nodes): (bool, Vec<String>, Vec<Node>),
    ) -> Followed {
        let gone: Vec<String> = if whole {
            let wanted: HashSet<&str> = nodes.iter().map(|node| node.id.as_str()).collect();
            let tree = world.tree();
            let others = tree.nodes().skip(1);
            let others = others.filter(|node| !wanted.contains(node.id()) && !is_of_person(node));
            let others = others.map(|node| node.id().to_owned());
            // What a client has removed, too.
            let known = self.said.keys();
            let known = known.filter(|id| !wanted.contains(id.as_str())).cloned();
            others.chain(known).collect()
        } else {
            let known = removed
                .into_iter()
                .filter(|id| self.said.contains_key(id.as_str()));
            known.collect()
        };
        let mut unmade = Vec::new();
        let mut wanted = Vec::new();
        for node in nodes {
            let id = node.id.clone();
            match Said::read(scene, node) {
                Ok(said) => wanted.push((id, said)),
                Err(what) => unmade.push(Unmade { id, what }),
            }
        }
        if !gone.is_empty() || !wanted.is_empty() {
            let said = &self.said;
            let ids: Vec<String> = wanted.iter().map(|(id, _)| id.clone()).collect();
            let made = world.edit(|edit| make(edit, said, &gone, wanted));
            match made {
                Ok((made, impossible)) => {
                    for id in &gone {
                        self.said.remove(id);
                    }
                    self.said.extend(made);
                    unmade.extend(impossible);
                }
                // Nothing has changed.
                Err(error) => unmade.extend(ids.into_iter().map(|id| Unmade {
                    id,
                    what: clean(&error.to_string()),
                })),
            }
        }
        Followed {
            nodes: i32::try_from(self.said.len()).unwrap_or(i32::MAX),
            unmade,
        }
    }
}

/// Whether a node is below a person, whose skeleton goes with it.
fn is_of_person(node: &NodeRef<'_>) -> bool {
    let above = std::iter::successors(node.parent(), NodeRef::parent);
    above
        .into_iter()
        .any(|node| matches!(node.kind(), Kind::Human(_)))
}

/// Changes the scene. Returns the nodes that are made, and those that cannot be.
fn make(
    edit: &mut Edit,
    said: &HashMap<String, Said>,
    gone: &[String],
    wanted: Nodes,
) -> Result<(Nodes, Vec<Unmade>), Error> {
    // Out of the way first: no order of moves closes a circle, and what moves away from a node that is
    // removed stays.
    for (id, new) in &wanted {
        let there = edit.snapshot().node(id.as_str());
        let parent = match (there, said.get(id)) {
            (Ok(there), None) => Said::of(&there).parent,
            (Ok(_), Some(old)) => old.parent.clone(),
            (Err(_), _) => continue,
        };
        if parent != new.parent {
            // One that cannot be there is moved to its parent directly.
            let _ = edit.move_to(id.as_str(), ROOT);
        }
    }
    hold(edit, said, gone);
    for id in gone {
        if edit.snapshot().node(id.as_str()).is_ok() {
            edit.remove(id.as_str())?;
        }
    }
    let (mut made, mut unmade) = (Vec::new(), Vec::new());
    for (id, new) in wanted {
        match edit.attempt(|edit| put(edit, &id, said.get(&id), &new)) {
            Ok(()) => made.push((id, new)),
            Err(what) => unmade.push(Unmade { id, what }),
        }
    }
    Ok((made, unmade))
}

/// Puts nodes of the tree that a client has moved below ones that are removed back below their
/// parents: the tree still has them.
fn hold(edit: &mut Edit, said: &HashMap<String, Said>, gone: &[String]) {
    let all: HashSet<&str> = gone.iter().map(String::as_str).collect();
    let stays = |node: &NodeRef<'_>| said.contains_key(node.id()) && !all.contains(node.id());
    let tree = edit.snapshot();
    let removed = gone.iter().filter_map(|id| tree.node(id.as_str()).ok());
    let below = removed.flat_map(|node| node.subtree().skip(1));
    let moved = below.filter(|node| stays(node) && !node.parent().as_ref().is_some_and(stays));
    let moved: BTreeSet<String> = moved.map(|node| node.id().to_owned()).collect();
    for id in moved {
        let parent = said.get(&id).map_or(ROOT, |said| said.parent.as_str());
        if edit.move_to(id.as_str(), parent).is_err() {
            let _ = edit.move_to(id.as_str(), ROOT);
        }
    }
}

/// Adds a node, or changes of the one that is there what the tree says anew.
fn put(edit: &mut Edit, id: &str, said: Option<&Said>, new: &Said) -> Result<(), String> {
    let is_joint = matches!(new.kind, Kind::Joint(_) | Kind::Prismatic(_));
    let there = edit.snapshot().node(id).ok();
    let Some(there) = there else {
        if edit.snapshot().len() > MOST_NODES {
            return Err(format!("a world has at most {MOST_NODES} nodes"));
        }
        let node = NewNode {
            id: id.to_owned(),
            kind: new.kind.clone(),
            pose: new.pose,
            allowed: new.allowed.clone(),
        };
        return add(edit, node, new, is_joint).map_err(|error| clean(&error.to_string()));
    };
    let old = said.map_or_else(|| Said::of(&there), Said::clone);
    change(edit, id, &old, new, is_joint).map_err(|error| clean(&error.to_string()))
}

fn add(edit: &mut Edit, node: NewNode, new: &Said, is_joint: bool) -> Result<(), Error> {
    let id = edit.add(new.parent.as_str(), node)?;
    if is_joint {
        edit.set_joint(id, new.position)?;
    }
    for Attribute { name, type_, value } in &new.attributes {
        edit.add_attribute(id, name, type_, value)?;
    }
    Ok(())
}

fn change(edit: &mut Edit, id: &str, old: &Said, new: &Said, is_joint: bool) -> Result<(), Error> {
    if old.parent != new.parent {
        edit.move_to(id, new.parent.as_str())?;
    }
    if old.kind != new.kind {
        edit.set_kind(id, new.kind.clone())?;
    }
    if old.allowed != new.allowed {
        edit.set_allowed(id, new.allowed.clone())?;
    }
    if old.pose != new.pose && new.kind.has_pose() {
        edit.set_pose(id, new.pose)?;
    }
    if is_joint && old.position != new.position {
        edit.set_joint(id, new.position)?;
    }
    if old.attributes != new.attributes {
        let here = edit.snapshot().node(id)?;
        let names: Vec<String> = here
            .attributes()
            .map(|(name, ..)| name.to_owned())
            .collect();
        for name in names {
            edit.remove_attribute(id, &name)?;
        }
        for Attribute { name, type_, value } in &new.attributes {
            edit.add_attribute(id, name, type_, value)?;
        }
    }
    Ok(())
}
