//! An object of a world that the pointer moves or pushes.

use crate::actions::Action;
use crate::sight::Sight;
use innermodel::kinds::Engine;
use innermodel::{Kind, NodeRef, Point, Vector};
use rc_diagnostics::foreign::clean;

/// The impulse of a drag of one millimetre, in N·s: 5 N·s for a metre.
const IMPULSE: f64 = 0.005;
/// How far the pointer may move an object, as a multiple of its depth: near the horizon a pixel is
/// very far.
const FARTHEST: f64 = 10.0;

/// Effect of the pointer on an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Grip {
    /// It moves at its height.
    Slide,
    /// It moves up and down.
    Lift,
    /// It is pushed when the pointer lets it go.
    Push,
}

/// An object that the pointer holds.
#[derive(Clone, Debug)]
pub(crate) struct Grab {
    grip: Grip,
    id: String,
    /// Its origin at first, in the root.
    origin: Point,
    /// The point of its surface that was taken.
    pub(crate) start: Point,
    /// Where the pointer has that point now.
    pub(crate) end: Point,
    /// The greatest depth.
    farthest: f64,
}

impl Grab {
    /// Takes an object at a point of its surface.
    pub(crate) fn new(object: &NodeRef<'_>, grip: Grip, start: Point, sight: &Sight) -> Self {
        Self {
            grip,
            id: object.id().to_owned(),
            origin: object.to_root().translation.into(),
            start,
            end: start,
            farthest: sight.depth(&start) * FARTHEST,
        }
    }

    /// Follows the pointer. Where it meets nothing, the object stays.
    pub(crate) fn follow(&mut self, sight: &Sight) {
        let end = match self.grip {
            Grip::Slide | Grip::Push => sight.on_plane(&self.start, &Vector::y()),
            Grip::Lift => {
                let height = sight.along(&self.start, &Vector::y());
                height.map(|height| self.start + Vector::y() * height)
            }
        };
        if let Some(end) = end
            && sight.depth(&end) <= self.farthest
        {
            self.end = end;
        }
    }

    fn offset(&self) -> Vector {
        self.end - self.start
    }

    fn impulse(&self) -> Vector {
        self.offset() * IMPULSE
    }

    /// Whether the pointer moves the object at once.
    pub(crate) fn moves(&self) -> bool {
        self.grip != Grip::Push
    }

    /// The present effect of the pointer on the object.
    pub(crate) fn action(&self) -> Action {
        let id = self.id.clone();
        if self.moves() {
            let place = self.origin + self.offset();
            Action::Move { id, place }
        } else {
            let impulse = self.impulse();
            Action::Push { id, impulse }
        }
    }

    /// Puts the object back to its first place, or pushes nothing.
    pub(crate) fn undo(&self) -> Option<Action> {
        let (id, place) = (self.id.clone(), self.origin);
        self.moves().then_some(Action::Move { id, place })
    }

    /// The effect of the pointer, in words.
    pub(crate) fn label(&self) -> String {
        let id = clean(&self.id);
        if self.moves() {
            let there = self.origin + self.offset();
            format!("{id}: {:.0} {:.0} {:.0} mm", there.x, there.y, there.z)
        } else {
            format!("{id}: {:.2} N·s", self.impulse().norm())
        }
    }
}

/// Whether forces move a node.
fn is_dynamic(node: &NodeRef<'_>) -> bool {
    let kind = node.kind();
    matches!(kind, Kind::Transform(transform) if transform.engine == Engine::Bullet)
}

/// A node and those above it, but for the root.
fn upwards(node: NodeRef<'_>) -> impl Iterator<Item = NodeRef<'_>> {
    let all = std::iter::successors(Some(node), NodeRef::parent);
    all.filter(|node| node.parent().is_some())
}

/// The object to which a body belongs. If the user has picked a node above the body, it is that
/// one. Otherwise it is the robot, the person or the body that forces move; else the nearest
/// transform above all joints, unless other objects are in it. The error is a sentence.
pub(crate) fn object<'t>(
    body: NodeRef<'t>,
    picked: Option<NodeRef<'t>>,
) -> Result<NodeRef<'t>, String> {
    let stands_alone = |node: &NodeRef<'_>| {
        matches!(node.kind(), Kind::Robot(_) | Kind::Human(_)) || is_dynamic(node)
    };
    let picked = picked.filter(|picked| picked.node_id() != body.node_id());
    let picked = picked.and_then(|picked| {
        upwards(body).find(|node| node.node_id() == picked.node_id() && node.kind().has_pose())
    });
    let robot =
        || upwards(body).find(|node| matches!(node.kind(), Kind::Robot(_) | Kind::Human(_)));
    let alone = || upwards(body).find(stands_alone);
    if let Some(found) = picked.or_else(robot).or_else(alone) {
        return Ok(found);
    }
    let mut found = None;
    for node in upwards(body) {
        match node.kind() {
            Kind::Joint(_) | Kind::Prismatic(_) => found = None,
            Kind::Transform(_) if found.is_none() => found = Some(node),
            _ => {}
        }
    }
    let found = found.or_else(|| Some(body).filter(|body| body.kind().has_pose()));
    let id = clean(body.id());
    let Some(found) = found else {
        return Err(format!("nothing above `{id}` can be moved"));
    };
    if found.subtree().any(|node| stands_alone(&node)) {
        let above = clean(found.id());
        return Err(format!(
            "`{id}` belongs to `{above}`, which holds other objects: click it and press p to move that"
        ));
    }
    Ok(found)
}

/// The body that forces move to which a node belongs. The error is a sentence.
pub(crate) fn pushed(body: NodeRef<'_>) -> Result<NodeRef<'_>, String> {
    let id = clean(body.id());
    let found = upwards(body).find(is_dynamic);
    found.ok_or_else(|| {
        format!("forces do not move `{id}`: engine=\"bullet\" of a transform says so")
    })
}
