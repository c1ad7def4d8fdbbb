//! Changes, which become one new version together.

use crate::error::Error;
use crate::files;
use crate::link::{self, Data, Link, NONE, NodeId, TOP};
use crate::snapshot::{Key, Snapshot};
use crate::transform::Transform;
use innermodel_language::model::{self, Form, Kind, Pose};
use rc_diagnostics::foreign;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Effect of a position on a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clamped {
    /// It has the position.
    No,
    /// The position was below the limit, which the joint has now.
    ToMin(f64),
    /// The position was above the limit, which the joint has now.
    ToMax(f64),
}

/// A node that is added.
#[derive(Clone, Debug, PartialEq)]
pub struct NewNode {
    /// The id, which no other node has.
    pub id: String,
    /// Kind of the node.
    pub kind: Kind,
    /// Where it is in its parent.
    pub pose: Pose,
    /// Ids of nodes that it may touch.
    pub allowed: Vec<String>,
}

impl NewNode {
    /// A frame.
    pub fn transform(id: impl Into<String>, pose: Pose) -> Self {
        Self::new(id, Kind::Transform(model::Transform::default()), pose)
    }

    /// A node that may touch no other one.
    pub fn new(id: impl Into<String>, kind: Kind, pose: Pose) -> Self {
        Self {
            id: id.into(),
            kind,
            pose,
            allowed: Vec::new(),
        }
    }
}

/// Changes of a model. Readers see all of them at once, or none.
#[derive(Debug)]
pub struct Edit {
    pub(crate) next: Snapshot,
}

impl Edit {
    /// The tree with the changes made so far.
    pub fn snapshot(&self) -> &Snapshot {
        &self.next
    }

    fn link(&mut self, place: u32) -> Result<&mut Link, Error> {
        self.next
            .links
            .get_mut(place as usize)
            .ok_or(Error::Removed)
    }

    /// The link of a node whose place or parent changes.
    fn changed(&mut self, place: u32) -> Result<&mut Link, Error> {
        let (version, time) = (self.next.version, self.next.time);
        let link = self.link(place)?;
        (link.version, link.time) = (version, time);
        Ok(link)
    }

    pub(crate) fn data(&mut self, place: u32) -> Result<&mut Data, Error> {
        let data = self.next.data.get_mut(place as usize);
        let data = data.and_then(Option::as_mut).ok_or(Error::Removed)?;
        Ok(Arc::make_mut(data))
    }

    fn kind(&self, place: u32) -> Result<(Arc<Kind>, Arc<str>), Error> {
        let data = self.next.data(place).ok_or(Error::Removed)?;
        Ok((Arc::clone(&data.kind), Arc::clone(&data.id)))
    }

    /// Sets where a node is in its parent. The position of a joint stays.
    pub fn set_pose(&mut self, key: impl Key, pose: Pose) -> Result<(), Error> {
        let place = self.next.place(key)?;
        let (kind, id) = self.kind(place)?;
        if place == TOP {
            return Err(Error::Root);
        }
        if !kind.has_pose() {
            return Err(Error::NoPose {
                id: foreign::clean(&id),
                tag: kind.tag(),
            });
        }
        check_pose(&id, &pose)?;
        self.place_at(place, &kind, pose)
    }

    fn place_at(&mut self, place: u32, kind: &Kind, pose: Pose) -> Result<(), Error> {
        let link = self.changed(place)?;
        link.pose = pose;
        link.local = link::local(kind, &pose, link.position);
        Ok(())
    }

    /// Sets where a node is in `base`, whatever its parent is.
    pub fn set_pose_in(&mut self, key: impl Key, base: impl Key, pose: Pose) -> Result<(), Error> {
        let (place, base) = (self.next.place(key)?, self.next.place(base)?);
        if self.next.is_below(base, place) {
            let (_, id) = self.kind(place)?;
            let (_, to) = self.kind(base)?;
            return Err(Error::BelowItself {
                id: foreign::clean(&id),
                to: foreign::clean(&to),
            });
        }
        let parent = self.next.link(place).ok_or(Error::Removed)?.parent;
        let wanted = self.next.between_places(parent, base) * Transform::of(&pose);
        let pose = self.pose_for(place, wanted)?;
        let node = self.next.at(place).ok_or(Error::Removed)?.node_id();
        self.set_pose(node, pose)
    }

    /// The pose with which a node, with its joint, has this transform in its parent.
    fn pose_for(&self, place: u32, wanted: Transform) -> Result<Pose, Error> {
        let (kind, id) = self.kind(place)?;
        let position = self.next.link(place).ok_or(Error::Removed)?.position;
        let pose = (wanted * link::motion(&kind, position).inverse()).pose();
        check_pose(&id, &pose)?;
        Ok(pose)
    }

    /// Sets the angle of a joint in radians, or the position of a prismatic one in millimetres.
    /// A position beyond the limits becomes the limit.
    pub fn set_joint(&mut self, key: impl Key, position: f64) -> Result<Clamped, Error> {
        let place = self.next.place(key)?;
        let data = self.next.data(place).ok_or(Error::Removed)?;
        let (min, max) = match &*data.kind {
            Kind::Joint(joint) => (joint.min, joint.max),
            Kind::Prismatic(joint) => (joint.min, joint.max),
            kind => {
                return Err(Error::NotAJoint {
                    id: foreign::clean(&data.id),
                    tag: kind.tag(),
                });
            }
        };
        if !position.is_finite() {
            return Err(Error::NotFinite(foreign::clean(&data.id)));
        }
        let (position, clamped) = if position < min {
            (min, Clamped::ToMin(min))
        } else if position > max {
            (max, Clamped::ToMax(max))
        } else {
            (position, Clamped::No)
        };
        let kind = Arc::clone(&data.kind);
        let link = self.changed(place)?;
        link.position = position;
        link.local = link::local(&kind, &link.pose, position);
        Ok(clamped)
    }

    /// Makes several changes, or none of them if `make` fails. Other changes of the edit stay.
    pub fn attempt<T, E>(&mut self, make: impl FnOnce(&mut Self) -> Result<T, E>) -> Result<T, E> {
        let before = self.next.clone();
        let result = make(self);
        if result.is_err() {
            self.next = before;
        }
        result
    }

    /// Adds a node below `parent`, after its other children.
    pub fn add(&mut self, parent: impl Key, node: NewNode) -> Result<NodeId, Error> {
        check_possible(&node.id, &node.kind)?;
        self.insert(parent, node)
    }

    /// Adds a node of a kind that a file can say.
    pub(crate) fn insert(&mut self, parent: impl Key, node: NewNode) -> Result<NodeId, Error> {
        let parent = self.next.place(parent)?;
        self.may_have_children(parent)?;
        if node.id.is_empty() {
            return Err(Error::EmptyId);
        }
        if self.next.ids.get(node.id.as_str()).is_some() {
            return Err(Error::DuplicateId(foreign::clean(&node.id)));
        }
        check_pose(&node.id, &node.pose)?;
        check_kind(&node.id, &node.kind)?;
        check_texts(&node.id, &node.allowed)?;
        let start = match &node.kind {
            Kind::Prismatic(joint) => joint.position,
            _ => 0.0,
        };
        let position = within_limits(&node.kind, start);
        let mut link = Link::new(&node.kind, node.pose, position);
        let id: Arc<str> = node.id.into();
        let data = Arc::new(Data {
            id: Arc::clone(&id),
            kind: Arc::new(node.kind),
            allowed: node.allowed.into(),
            attributes: BTreeMap::new(),
        });
        let place = if self.next.free == NONE {
            self.next.links.push(link.clone());
            self.next.data.push(Some(data));
            self.next.links.len() as u32 - 1
        } else {
            let place = self.next.free;
            let here = self.link(place)?;
            link.generation = here.generation.wrapping_add(1);
            let free = here.parent;
            *here = link.clone();
            self.next.free = free;
            if let Some(slot) = self.next.data.get_mut(place as usize) {
                *slot = Some(data);
            }
            place
        };
        self.next.ids.insert(id, place);
        self.next.count += 1;
        self.attach(place, parent)?;
        Ok(NodeId {
            index: place,
            generation: link.generation,
        })
    }

    fn may_have_children(&self, place: u32) -> Result<(), Error> {
        let (kind, id) = self.kind(place)?;
        if kind.may_have_children() {
            return Ok(());
        }
        Err(Error::NoChildren {
            id: foreign::clean(&id),
            tag: kind.tag(),
        })
    }

    /// Moves a node after the other children of `parent`.
    fn attach(&mut self, place: u32, parent: u32) -> Result<(), Error> {
        let last = std::mem::replace(&mut self.link(parent)?.last, place);
        if last == NONE {
            self.link(parent)?.first = place;
        } else {
            self.link(last)?.next = place;
        }
        let link = self.changed(place)?;
        link.parent = parent;
        link.previous = last;
        link.next = NONE;
        Ok(())
    }

    /// Takes a node out of the children of its parent.
    fn detach(&mut self, place: u32) -> Result<(), Error> {
        let link = self.next.link(place).ok_or(Error::Removed)?;
        let (parent, previous, next) = (link.parent, link.previous, link.next);
        if previous == NONE {
            self.link(parent)?.first = next;
        } else {
            self.link(previous)?.next = next;
        }
        if next == NONE {
            self.link(parent)?.last = previous;
        } else {
            self.link(next)?.previous = previous;
        }
        Ok(())
    }

    /// Removes a node with all below it. Returns how many nodes that were.
    pub fn remove(&mut self, key: impl Key) -> Result<usize, Error> {
        let place = self.next.place(key)?;
        if place == TOP {
            return Err(Error::Root);
        }
        let top = self.next.at(place).ok_or(Error::Removed)?;
        let places: Vec<u32> = top.subtree().map(|node| node.node_id().index).collect();
        self.detach(place)?;
        for place in &places {
            let (_, id) = self.kind(*place)?;
            self.next.ids.remove(&*id);
            let free = std::mem::replace(&mut self.next.free, *place);
            let link = self.changed(*place)?;
            link.generation = link.generation.wrapping_add(1);
            link.parent = free;
            link.first = NONE;
            link.last = NONE;
            if let Some(slot) = self.next.data.get_mut(*place as usize) {
                *slot = None;
            }
        }
        self.next.count -= places.len();
        Ok(places.len())
    }

    /// Moves a node below another parent. It keeps its pose in the parent, so its place in the
    /// world changes.
    pub fn move_to(&mut self, key: impl Key, parent: impl Key) -> Result<(), Error> {
        let (place, parent) = (self.next.place(key)?, self.next.place(parent)?);
        if place == TOP {
            return Err(Error::Root);
        }
        self.may_have_children(parent)?;
        if self.next.is_below(parent, place) {
            let (_, id) = self.kind(place)?;
            let (_, to) = self.kind(parent)?;
            return Err(Error::BelowItself {
                id: foreign::clean(&id),
                to: foreign::clean(&to),
            });
        }
        self.detach(place)?;
        self.attach(place, parent)
    }

    /// Moves a node below another parent. It stays where it is in the world: a hand grasps a cup.
    pub fn re_parent(&mut self, key: impl Key, parent: impl Key) -> Result<(), Error> {
        let (place, parent) = (self.next.place(key)?, self.next.place(parent)?);
        let wanted = self.next.between_places(parent, place);
        let (kind, id) = self.kind(place)?;
        if !kind.has_pose() {
            return Err(Error::NoPose {
                id: foreign::clean(&id),
                tag: kind.tag(),
            });
        }
        let named = |place| self.next.at(place).map(|node| node.node_id());
        let (Some(key), Some(to)) = (named(place), named(parent)) else {
            return Err(Error::Removed);
        };
        let pose = self.pose_for(place, wanted)?;
        self.move_to(key, to)?;
        self.place_at(place, &kind, pose)
    }

    /// Changes the properties of a node: a size, a texture, the limits of a joint.
    pub fn set_kind(&mut self, key: impl Key, kind: Kind) -> Result<(), Error> {
        let place = self.next.place(key)?;
        if place == TOP {
            return Err(Error::Root);
        }
        let link = self.next.link(place).ok_or(Error::Removed)?;
        if link.first != NONE && !kind.may_have_children() {
            let (_, id) = self.kind(place)?;
            return Err(Error::HasChildren {
                id: foreign::clean(&id),
                tag: kind.tag(),
            });
        }
        let (_, id) = self.kind(place)?;
        check_possible(&id, &kind)?;
        let position = within_limits(&kind, link.position);
        let pose = if kind.has_pose() {
            link.pose
        } else {
            Pose::default()
        };
        let new = link::local(&kind, &pose, position);
        let link = self.changed(place)?;
        (link.pose, link.position, link.local) = (pose, position, new);
        self.data(place)?.kind = Arc::new(kind);
        Ok(())
    }

    /// Sets the ids of the nodes that this one, with all below it, may touch.
    pub fn set_allowed(&mut self, key: impl Key, allowed: Vec<String>) -> Result<(), Error> {
        let place = self.next.place(key)?;
        let (_, id) = self.kind(place)?;
        check_texts(&id, &allowed)?;
        self.data(place)?.allowed = allowed.into();
        Ok(())
    }
}

/// The position that the limits of a joint allow. Other nodes have none.
fn within_limits(kind: &Kind, position: f64) -> f64 {
    match kind {
        Kind::Joint(joint) => position.max(joint.min).min(joint.max),
        Kind::Prismatic(joint) => position.max(joint.min).min(joint.max),
        _ => 0.0,
    }
}

/// Checks that a file can have the node, and that its joint has a position.
fn check_kind(id: &str, kind: &Kind) -> Result<(), Error> {
    let (min, max, start) = match kind {
        Kind::Joint(joint) => (joint.min, joint.max, 0.0),
        Kind::Prismatic(joint) => (joint.min, joint.max, joint.position),
        _ => (0.0, 0.0, 0.0),
    };
    let has_position = min < f64::INFINITY && max > f64::NEG_INFINITY && start.is_finite();
    if !has_position {
        return Err(Error::NotFinite(foreign::clean(id)));
    }
    let node = model::Node::new(id, kind.clone());
    check_texts(id, &[innermodel_language::element(&node)])
}

/// Checks that a file can have a node of this kind, with all its numbers.
fn check_possible(id: &str, kind: &Kind) -> Result<(), Error> {
    check_kind(id, kind)?;
    let element = innermodel_language::element(&model::Node::new("node", kind.clone()));
    match files::problem(&element) {
        None => Ok(()),
        Some(reason) => Err(Error::Impossible {
            id: foreign::clean(id),
            reason,
        }),
    }
}

fn check_pose(id: &str, pose: &Pose) -> Result<(), Error> {
    let mut numbers = pose.translation.iter().chain(&pose.rotation);
    if numbers.all(|number| number.is_finite()) {
        return Ok(());
    }
    Err(Error::NotFinite(foreign::clean(id)))
}

fn check_texts(id: &str, texts: &[String]) -> Result<(), Error> {
    let is_allowed = |c: char| {
        let is_control = c < ' ' && !matches!(c, '\t' | '\n' | '\r');
        !is_control && !matches!(c, '\u{fffe}' | '\u{ffff}')
    };
    if texts.iter().all(|text| text.chars().all(is_allowed)) {
        return Ok(());
    }
    Err(Error::Character(foreign::clean(id)))
}

/// A `translation` that turns, or a `rotation` that moves, has become a `transform`.
pub(crate) fn form(form: Form, pose: &Pose) -> Form {
    let moved = pose.translation != [0.0; 3];
    let turned = pose.rotation != [0.0; 3];
    match form {
        Form::Translation if turned => Form::Transform,
        Form::Rotation if moved => Form::Transform,
        form => form,
    }
}
