//! The tree as a part of the world that all components share: what requests change is written there,
//! and what others change there is made in the tree.
//!
//! Each node of the tree is a `Part` of the world below another one, and is named by its id. A frame
//! that another component has made may be a `Frame` without more. Of two changes at once, the world
//! says which one holds, also of those that exclude each other.

use crate::parts::{Part, described, part, part_of, read, rest, touched};
use innermodel::language::model::Node;
use innermodel::{Change, Edit, Folders, InnerModel, Kind, NewNode, NodeRef, Pose, ROOT};
use innermodel::{Snapshot as Tree, Time};
use property_graph::{Element, Error, Graph, Id, NodeId, Schema, Snapshot, Value};
use rc_diagnostics::foreign::clean;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

/// How many problems are reported at once.
const MOST_REPORTED: usize = 32;

/// What joins the tree with the world.
pub(crate) struct Front {
    /// The nodes that both have, by their ids in the tree.
    parts: HashMap<String, (Id, Part)>,
    /// Their ids in the tree, by those in the world.
    names: HashMap<Id, String>,
    /// The version of the tree that the world has.
    told: Arc<Tree>,
    /// The version of the world that the tree shows.
    shown: Option<Arc<Snapshot>>,
    /// The problems that were there after the last change of the world.
    problems: BTreeSet<String>,
}

/// What a change of the tree is for the world.
struct News {
    gone: Vec<String>,
    /// Parents come before their children.
    parts: Vec<(String, Part)>,
}

/// A tree as the initial contents of a world.
pub(crate) fn start(tree: &Tree, schema: &Arc<Schema>) -> Result<Arc<Snapshot>, Error> {
    // Equal files are equal contents.
    let graph = Graph::new(Arc::clone(schema), 1);
    let nodes = tree.nodes().skip(1);
    let news = News {
        gone: Vec::new(),
        parts: nodes
            .map(|node| (node.id().to_owned(), part(&node)))
            .collect(),
    };
    graph.change(Time::ZERO, |edit| news.write(edit, &HashMap::new()))?;
    Ok(graph.snapshot())
}

impl Front {
    /// A tree that is in no world so far.
    pub(crate) fn new(told: Arc<Tree>) -> Self {
        Self {
            parts: HashMap::new(),
            names: HashMap::new(),
            told,
            shown: None,
            problems: BTreeSet::new(),
        }
    }

    /// Notes that the world starts with the tree. What it is by now follows.
    pub(crate) fn started(&mut self, start: &Snapshot) {
        self.have(read(start).into_iter().collect());
        self.shown = None;
    }

    /// Notes the nodes that both have.
    fn have(&mut self, parts: Parts) {
        let names = parts.iter().map(|(id, (of, _))| (*of, id.clone()));
        self.names = names.collect();
        self.parts = parts;
    }

    /// Writes what has changed in the tree into the world. `change` makes a change there. If the world
    /// refuses it, the tree is what it was.
    pub(crate) fn tell<E>(
        &mut self,
        model: &InnerModel,
        time: Time,
        change: impl FnOnce(
            &dyn Fn(&mut property_graph::Edit) -> Result<Vec<NodeId>, Error>,
        ) -> Result<(Vec<NodeId>, Arc<Snapshot>), E>,
    ) -> Result<(), E> {
        let now = model.snapshot();
        let news = News::between(&self.told, &now);
        if news.gone.is_empty() && news.parts.is_empty() {
            return Ok(());
        }
        let parts = &self.parts;
        let (nodes, after) = match change(&|edit| news.write(edit, parts)) {
            Ok(made) => made,
            Err(error) => {
                model.restore(time, &self.told);
                return Err(error);
            }
        };
        for gone in &news.gone {
            if let Some((of, _)) = self.parts.remove(gone) {
                self.names.remove(&of);
            }
        }
        for ((id, part), node) in news.parts.into_iter().zip(nodes) {
            // The world may hide one at once. The next look at it removes it here, too.
            let of = after.node(node).map_or(Id::new(0, 0), |node| node.id());
            self.names.insert(of, id.clone());
            if let Some((old, _)) = self.parts.insert(id, (of, part))
                && old != of
            {
                self.names.remove(&old);
            }
        }
        self.told = now;
        Ok(())
    }

    /// Makes what has changed in the world in the tree. Returns what cannot be made there, if
    /// it is new.
    pub(crate) fn follow(
        &mut self,
        world: &Arc<Snapshot>,
        model: &InnerModel,
        time: Time,
        (place, folders): (&Path, &Folders),
    ) -> Vec<String> {
        let shown = self.shown.replace(Arc::clone(world));
        if let Some(shown) = shown {
            if shown.version() == world.version() {
                return Vec::new();
            }
            let is_whole = self.problems.is_empty();
            if is_whole && self.follow_values(&shown, world, model, time, (place, folders)) {
                return Vec::new();
            }
        }
        let wanted = read(world);
        let is_same = wanted.len() == self.parts.len()
            && wanted
                .iter()
                .all(|(id, own)| self.parts.get(id) == Some(own));
        if is_same {
            return Vec::new();
        }
        let described = |id: &str, element: &str| described(id, element, place, folders);
        let known = std::mem::take(&mut self.parts);
        let made = model.change(time, |edit| {
            Ok::<_, std::convert::Infallible>(follow(edit, known, wanted, &described))
        });
        let Ok((parts, problems)) = made;
        self.have(parts);
        self.told = model.snapshot();
        let problems: BTreeSet<String> = problems.into_iter().collect();
        let new = problems.difference(&self.problems).cloned();
        let mut new: Vec<String> = new.collect();
        if let Some(more @ 1..) = new.len().checked_sub(MOST_REPORTED) {
            new.truncate(MOST_REPORTED);
            new.push(format!("{more} more nodes"));
        }
        self.problems = problems;
        new
    }

    /// Makes what has changed since a version, in a time that depends on that alone. Returns whether that
    /// was possible: if frames have come, gone or moved to another parent, it needs the whole world.
    fn follow_values(
        &mut self,
        shown: &Snapshot,
        world: &Snapshot,
        model: &InnerModel,
        time: Time,
        (place, folders): (&Path, &Folders),
    ) -> bool {
        let Some(touched) = touched(shown, world) else {
            return false;
        };
        let mut changed = Vec::new();
        for node in touched {
            let Ok(node) = world.node(node) else {
                return false;
            };
            let known = self.names.get(&node.id());
            let known = known.and_then(|id| Some((id, &self.parts.get(id)?.1)));
            let Some((id, old)) = known else {
                return false;
            };
            let Ok(frame) = world.frame(node.node_id()) else {
                return false;
            };
            let Ok(frame) = world.tree().node(frame.node()) else {
                return false;
            };
            let pose = frame.pose();
            let part = part_of(&node, pose, old.parent.clone());
            if part != *old {
                changed.push((id.clone(), node.id(), part));
            }
        }
        if changed.is_empty() {
            return true;
        }
        let parts = &self.parts;
        let made = model.change(time, |edit| {
            for (id, _, part) in &changed {
                let described = |id: &str, element: &str| described(id, element, place, folders);
                put(
                    edit,
                    id,
                    parts.get(id).map(|(_, old)| old),
                    part,
                    &described,
                )?;
            }
            Ok::<_, String>(())
        });
        if made.is_err() {
            return false;
        }
        for (id, of, part) in changed {
            self.parts.insert(id, (of, part));
        }
        self.told = model.snapshot();
        true
    }
}

type Parts = HashMap<String, (Id, Part)>;

/// Makes the tree what the world has. Returns the nodes that both have, and what is impossible.
fn follow(
    edit: &mut Edit,
    mut known: Parts,
    wanted: Vec<(String, (Id, Part))>,
    described: &dyn Fn(&str, &str) -> Result<Node, String>,
) -> (Parts, Vec<String>) {
    let mut problems = Vec::new();
    // Out of the way first, so that no order of moves closes a circle.
    for (id, (_, part)) in &wanted {
        if known
            .get(id)
            .is_some_and(|(_, own)| own.parent != part.parent)
        {
            let moved = edit.move_to(id, ROOT);
            problems.extend(moved.err().map(|error| problem(id, &error.to_string())));
        }
    }
    let names: HashSet<&str> = wanted.iter().map(|(id, _)| id.as_str()).collect();
    for gone in known.keys().filter(|id| !names.contains(id.as_str())) {
        // It may have gone with its parent.
        let _ = edit.remove(gone.as_str());
    }
    drop(names);
    let mut parts = Parts::new();
    for (id, (of, part)) in wanted {
        // It has gone if its parent cannot be in the tree.
        let is_there = edit.snapshot().node(id.as_str()).is_ok();
        let own = known.remove(&id).filter(|_| is_there);
        if own.as_ref().is_some_and(|(_, own)| *own == part) {
            parts.insert(id, (of, part));
            continue;
        }
        let old = own.as_ref().map(|(_, own)| own);
        let mut made = edit.attempt(|edit| put(edit, &id, old, &part, described));
        if made.is_err() && is_there {
            // All instances have the same tree, also those that start now.
            let _ = edit.remove(id.as_str());
            made = edit.attempt(|edit| put(edit, &id, None, &part, described));
        }
        match made {
            Ok(()) => {
                parts.insert(id, (of, part));
            }
            // It is tried again after the next change of the world.
            Err(error) => problems.push(problem(&id, &error)),
        }
    }
    (parts, problems)
}

fn problem(id: &str, error: &str) -> String {
    format!("`{}`: {}", clean(id), clean(error.trim_end()))
}

/// Adds a node, or makes the one that is there what the world says.
fn put(
    edit: &mut Edit,
    id: &str,
    old: Option<&Part>,
    part: &Part,
    described: &dyn Fn(&str, &str) -> Result<Node, String>,
) -> Result<(), String> {
    let node = described(id, &part.element)?;
    let pose = rest(&node.kind, part);
    place(edit, id, old, part, (node, pose)).map_err(|error| error.to_string())
}

fn place(
    edit: &mut Edit,
    id: &str,
    old: Option<&Part>,
    part: &Part,
    (node, pose): (Node, Pose),
) -> Result<(), innermodel::Error> {
    match old {
        None => {
            edit.add(
                part.parent.as_str(),
                NewNode {
                    id: id.to_owned(),
                    kind: node.kind,
                    pose,
                    allowed: node.allowed,
                },
            )?;
        }
        Some(old) => {
            if old.parent != part.parent {
                edit.move_to(id, part.parent.as_str())?;
            }
            if old.element != part.element {
                edit.set_kind(id, node.kind)?;
                edit.set_allowed(id, node.allowed)?;
            }
            if edit.snapshot().node(id)?.kind().has_pose() {
                edit.set_pose(id, pose)?;
            }
        }
    }
    let here = edit.snapshot().node(id)?;
    if matches!(here.kind(), Kind::Joint(_) | Kind::Prismatic(_)) {
        edit.set_joint(id, part.position.unwrap_or_default())?;
    }
    if old.map_or(&[][..], |old| &old.attributes) != part.attributes {
        let here = edit.snapshot().node(id)?;
        let names = here.attributes().map(|(name, ..)| name.to_owned());
        for name in names.collect::<Vec<_>>() {
            edit.remove_attribute(id, &name)?;
        }
        for one in part.attributes.chunks_exact(3) {
            edit.add_attribute(id, &one[0], &one[1], &one[2])?;
        }
    }
    Ok(())
}

/// The ids of the nodes that have gone between two versions of a tree, and the nodes that have come
/// or changed, parents before their children.
pub(crate) fn changes<'t>(before: &Tree, now: &'t Tree) -> (Vec<String>, Vec<NodeRef<'t>>) {
    let (mut gone, mut changed) = (Vec::new(), BTreeSet::new());
    for change in now.since(before) {
        match change {
            Change::Removed { id, .. } => gone.push(id),
            Change::Added(node)
            | Change::Parent(node)
            | Change::Moved(node)
            | Change::Data(node) => {
                changed.insert(node);
            }
        }
    }
    let there = changed.into_iter().filter_map(|node| now.node(node).ok());
    // The root is no part of the world.
    let there = there.filter(|node| node.parent().is_some());
    let mut there: Vec<NodeRef<'_>> = there.collect();
    there.sort_by_key(NodeRef::depth);
    (gone, there)
}

impl News {
    fn between(before: &Tree, now: &Tree) -> Self {
        let (gone, there) = changes(before, now);
        let parts = there.iter();
        let parts = parts.map(|node| (node.id().to_owned(), part(node)));
        Self {
            gone,
            parts: parts.collect(),
        }
    }

    /// Writes it into a world. Returns the node of each part.
    fn write(
        &self,
        edit: &mut property_graph::Edit,
        known: &HashMap<String, (Id, Part)>,
    ) -> Result<Vec<NodeId>, Error> {
        for id in &self.gone {
            let node = known.get(id);
            if let Some(node) = node.and_then(|(of, _)| edit.snapshot().find_node(*of)) {
                edit.remove_node(node)?;
            }
        }
        let gone: HashSet<&String> = self.gone.iter().collect();
        let mut made: HashMap<&str, NodeId> = HashMap::new();
        // All that move are free before any of them gets a parent.
        let mut held = Vec::new();
        for (id, part) in &self.parts {
            let old = known.get(id).filter(|_| !gone.contains(id));
            let (node, moves) = match old {
                Some((of, own)) => {
                    // Another component may have removed it: made again, it would be a second one.
                    let node = edit.snapshot().find_node(*of).ok_or(Error::Removed)?;
                    let node = if is_more(part) {
                        more(edit, node)?
                    } else {
                        node
                    };
                    (node, own.parent != part.parent)
                }
                None => {
                    let node = edit.add_node("Part")?;
                    edit.set(node, "name", id.as_str())?;
                    (node, true)
                }
            };
            if moves {
                for edge in edges_above(edit.snapshot(), node) {
                    edit.remove_edge(edge)?;
                }
            }
            say(edit, node, part)?;
            made.insert(id, node);
            held.push((node, part));
        }
        for (node, part) in &held {
            let edge = match edges_above(edit.snapshot(), *node).first() {
                Some(edge) => *edge,
                None => {
                    let above = match made.get(part.parent.as_str()) {
                        Some(above) => *above,
                        None => above(edit, known, &part.parent)?,
                    };
                    edit.add_edge("RT", above, *node)?
                }
            };
            let pose = Value::from(part.pose);
            if edit.snapshot().get(edge, "pose") != Some(&pose) {
                edit.set(edge, "pose", pose)?;
            }
        }
        Ok(held.into_iter().map(|(node, _)| node).collect())
    }
}

/// Whether a part is more than a `Frame` says.
fn is_more(part: &Part) -> bool {
    !part.element.is_empty() || part.position.is_some() || !part.attributes.is_empty()
}

/// The edges that hold a node.
fn edges_above(world: &Snapshot, node: NodeId) -> Vec<property_graph::EdgeId> {
    let Some(relation) = world.symbol("RT") else {
        return Vec::new();
    };
    let edges = world.in_edges(node, Some(relation));
    edges.map(|edge| edge.edge_id()).collect()
}

/// A node as a `Part`: a `Frame` gets a successor with its edges.
fn more(edit: &mut property_graph::Edit, node: NodeId) -> Result<NodeId, Error> {
    let old = edit.snapshot().node(node)?;
    if old.type_name() != "Frame" {
        return Ok(node);
    }
    let name = old.name().to_owned();
    let ends = |edge: property_graph::EdgeRef<'_>| {
        let attributes = edge.attributes();
        let attributes = attributes.map(|(name, value)| (name.to_owned(), value.clone()));
        let attributes: Vec<_> = attributes.collect();
        (
            edge.type_name().to_owned(),
            edge.from(),
            edge.to(),
            attributes,
        )
    };
    let edges = old.in_edges().chain(old.out_edges());
    let edges: Vec<_> = edges.map(ends).collect();
    edit.remove_node(node)?;
    let new = edit.add_node("Part")?;
    edit.set(new, "name", name)?;
    for (relation, from, to, attributes) in edges {
        let [from, to] = [from, to].map(|end| if end == node { new } else { end });
        let edge = edit.add_edge(&relation, from, to)?;
        for (name, value) in attributes {
            edit.set(edge, &name, value)?;
        }
    }
    Ok(new)
}

/// Gives a node the attributes of a part.
fn say(edit: &mut property_graph::Edit, node: NodeId, part: &Part) -> Result<(), Error> {
    let element = (!part.element.is_empty()).then(|| Value::from(part.element.as_str()));
    let texts = part.attributes.iter().map(|text| text.as_str().into());
    let attributes = (!part.attributes.is_empty()).then(|| Value::Texts(texts.collect()));
    for (name, value) in [
        ("element", element),
        ("position", part.position.map(Value::from)),
        ("attributes", attributes),
    ] {
        let own = edit.snapshot().get(Element::Node(node), name);
        match value {
            Some(value) if own != Some(&value) => edit.set(node, name, value)?,
            None if own.is_some() => edit.unset(node, name)?,
            _ => {}
        }
    }
    Ok(())
}

/// The node of a parent. The root is there once it is needed.
fn above(
    edit: &mut property_graph::Edit,
    known: &HashMap<String, (Id, Part)>,
    id: &str,
) -> Result<NodeId, Error> {
    if id != ROOT {
        let node = known.get(id);
        let node = node.and_then(|(of, _)| edit.snapshot().find_node(*of));
        return node.ok_or(Error::Removed);
    }
    let world = edit.snapshot();
    let roots = world.named(ROOT);
    let roots = roots.filter(|node| edges_above(world, *node).is_empty());
    let root = roots.min_by_key(|node| world.node(*node).map(|node| node.id()).ok());
    match root {
        Some(root) => Ok(root),
        None => {
            let root = edit.add_node("Frame")?;
            edit.set(root, "name", ROOT)?;
            Ok(root)
        }
    }
}
