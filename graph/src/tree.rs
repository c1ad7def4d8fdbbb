//! Frames of the graph as nodes of an InnerModel, whose code composes and interpolates transforms.

use crate::check::parents;
use crate::edit::Edit;
use crate::element::{Half, NodeId};
use crate::error::Error;
use crate::names::Symbol;
use crate::snapshot::Snapshot;
use crate::types::TreeOf;
use crate::{Point, Time};
use innermodel::{InnerModel, NewNode, Pose, Transform};
use std::collections::{HashMap, HashSet};

/// A node of a tree with transforms, found without a look-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame(pub(crate) innermodel::NodeId);

impl Frame {
    /// The frame as a node of [`Snapshot::tree`].
    pub fn node(self) -> innermodel::NodeId {
        self.0
    }
}

/// The edge that holds a node in the tree of frames.
pub(crate) fn held_by(next: &Snapshot, node: NodeId) -> Option<(&Half, TreeOf)> {
    let place = next.place(node).ok()?;
    let halves = place.out.all().iter().chain(next.incoming(node));
    for half in halves {
        let tree = next.types.relation(half.relation).and_then(|r| r.tree);
        if let Some(tree) = tree
            && tree.pose.is_some()
            && parents(next, tree, node).iter().any(|h| h == half)
        {
            return Some((half, tree));
        }
    }
    None
}

pub(crate) fn pose(
    next: &Snapshot,
    half: &Half,
    (first, second): (Symbol, Option<Symbol>),
) -> Result<Pose, Error> {
    let edge = next.edge_at(half.edge).ok_or(Error::Removed)?;
    let relation = || next.text(half.relation).to_owned();
    let numbers = |attribute, from: usize| -> Option<[f64; 3]> {
        let value = next.get(edge, attribute)?;
        Some([
            value.number(from)?,
            value.number(from + 1)?,
            value.number(from + 2)?,
        ])
    };
    if second.is_none()
        && let Some(block) = next.types.block(half.relation, first)
    {
        let six = next.get(edge, first).and_then(|value| {
            let all = value.numbers()?;
            block.as_pose(&all)
        });
        let [x, y, z, rx, ry, rz] = six.ok_or_else(|| Error::NoPose(relation(), block.text()))?;
        return Ok(Pose {
            translation: [x, y, z],
            rotation: [rx, ry, rz],
        });
    }
    let found = match second {
        None => numbers(first, 0).zip(numbers(first, 3)),
        Some(second) => numbers(first, 0).zip(numbers(second, 0)),
    };
    let (translation, rotation) = found.ok_or_else(|| {
        let expected = match second {
            None => format!("six numbers in `{}`", next.text(first)),
            Some(second) => format!(
                "three numbers in `{}` and three in `{}`",
                next.text(first),
                next.text(second)
            ),
        };
        Error::NoPose(relation(), expected)
    })?;
    Ok(Pose {
        translation,
        rotation,
    })
}

/// Brings the tree of frames up to date with a change.
pub(crate) fn apply(edit: &mut Edit, model: &InnerModel, time: Time) -> Result<(), Error> {
    if edit.moved.is_empty() && edit.fallen.is_empty() {
        return Ok(());
    }
    if edit.moved.len() > 1 {
        edit.moved.sort_unstable();
        edit.moved.dedup();
    }
    let moved = std::mem::take(&mut edit.moved);
    let fallen = std::mem::take(&mut edit.fallen);
    model.change(time, |frames| {
        // First all frames, then their parents: an order of parents before children is not needed.
        let mut held = Vec::with_capacity(moved.len());
        for node in moved {
            let Some((half, tree)) = held_by(&edit.next, node) else {
                // It has lost its parent.
                if let Some(frame) = frame(&edit.next, node) {
                    frames.move_to(frame, innermodel::NodeId::ROOT)?;
                    frames.set_pose(frame, Pose::default())?;
                }
                continue;
            };
            let pose = pose(&edit.next, half, tree.pose.ok_or(Error::NoFrame)?)?;
            let parent = half.node;
            let above = made(edit, frames, parent)?;
            let own = made(edit, frames, node)?;
            held.push((own, above, pose));
        }
        // A frame whose parent changes cannot conflict at the root.
        let mut changed = Vec::new();
        for (own, above, _) in &held {
            let parent = frames.snapshot().node(*own)?.parent();
            if parent.is_none_or(|parent| parent.node_id() != *above) {
                changed.push((*own, *above));
            }
        }
        if changed.len() > 1 {
            for (own, _) in &changed {
                frames.move_to(*own, innermodel::NodeId::ROOT)?;
            }
        }
        for (own, above) in from_the_leaves(&changed) {
            frames.move_to(own, above)?;
        }
        for (own, _, pose) in held {
            frames.set_pose(own, pose)?;
        }
        for gone in fallen {
            // It may have gone with the one above it.
            if frames.snapshot().node(gone).is_ok() {
                frames.remove(gone)?;
            }
        }
        Ok::<(), Error>(())
    })?;
    edit.next.tree = model.snapshot();
    edit.next.is_one_tree = edit.next.tree.root().children().nth(1).is_none();
    Ok(())
}

pub(crate) fn frame(snapshot: &Snapshot, node: NodeId) -> Option<innermodel::NodeId> {
    snapshot.place(node).ok()?;
    snapshot.nodes.get(node.place as usize)?.frame
}

/// Frames with their parents, each before its parent: when a frame gets a parent, that one is still
/// at the root, so the deep tree is not walked for each frame of it.
fn from_the_leaves(
    changed: &[(innermodel::NodeId, innermodel::NodeId)],
) -> Vec<(innermodel::NodeId, innermodel::NodeId)> {
    if changed.len() < 2 {
        return changed.to_vec();
    }
    let parents: HashMap<_, _> = changed.iter().copied().collect();
    let mut seen = HashSet::with_capacity(changed.len());
    let mut ordered = Vec::with_capacity(changed.len());
    let mut way = Vec::new();
    for (own, _) in changed {
        let mut here = *own;
        while let Some(above) = parents.get(&here).filter(|_| seen.insert(here)) {
            way.push((here, *above));
            here = *above;
        }
        // Parents first; all are turned round at the end.
        ordered.extend(way.drain(..).rev());
    }
    ordered.reverse();
    ordered
}

/// The frame of a node. A node without one gets one at the root.
fn made(
    edit: &mut Edit,
    frames: &mut innermodel::Edit,
    node: NodeId,
) -> Result<innermodel::NodeId, Error> {
    if let Some(frame) = frame(&edit.next, node) {
        return Ok(frame);
    }
    let here = edit.next.nodes.get_mut(node.place as usize);
    let here = here.ok_or(Error::Removed)?;
    let id = format!("{:x}", here.id.0);
    let new = NewNode::transform(id, Pose::default());
    let frame = frames.add(innermodel::NodeId::ROOT, new)?;
    here.frame = Some(frame);
    Ok(frame)
}

impl Snapshot {
    /// The tree of frames. Lengths have the unit that the schema gives to translations.
    pub fn tree(&self) -> &innermodel::Snapshot {
        &self.tree
    }

    /// The frame of a node, to ask for transforms many times.
    ///
    /// # Errors
    /// The node is in no tree with transforms.
    pub fn frame(&self, node: NodeId) -> Result<Frame, Error> {
        self.place(node)?;
        frame(self, node).map(Frame).ok_or(Error::NoFrame)
    }

    /// The transform that takes coordinates in `from` to those in `to`.
    ///
    /// # Errors
    /// The nodes are in different trees.
    #[inline]
    pub fn between(&self, to: Frame, from: Frame) -> Result<Transform, Error> {
        if !self.is_one_tree && !self.are_connected(to, from)? {
            return Err(Error::NotConnected);
        }
        Ok(self.tree.between(to.0, from.0)?)
    }

    /// The coordinates in `to` of a point with these coordinates in `from`.
    #[inline]
    pub fn transform(&self, to: Frame, point: Point, from: Frame) -> Result<Point, Error> {
        Ok(self.between(to, from)?.point(&point))
    }

    /// The pose of a node in another one. If relations without `tree` have poses, too, it is that of
    /// the shortest [`chain`](Self::chain): with loops there are several ways, which may disagree.
    ///
    /// # Errors
    /// No edges with poses connect the nodes.
    pub fn pose(&self, to: NodeId, from: NodeId) -> Result<Pose, Error> {
        if self.types.has_loops {
            return Ok(self.chain(to, from)?.transform().pose());
        }
        Ok(self.between(self.frame(to)?, self.frame(from)?)?.pose())
    }

    fn are_connected(&self, a: Frame, b: Frame) -> Result<bool, Error> {
        let top = |frame: Frame| -> Result<innermodel::NodeId, Error> {
            let mut here = self.tree.node(frame.0)?;
            while let Some(parent) = here.parent() {
                if parent.node_id() == innermodel::NodeId::ROOT {
                    break;
                }
                here = parent;
            }
            Ok(here.node_id())
        };
        Ok(top(a)? == top(b)?)
    }
}
