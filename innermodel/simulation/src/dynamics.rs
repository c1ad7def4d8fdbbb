//! Bodies that forces move, by a library that is linked only where it is wanted.

use crate::motors::MotorState;
use innermodel::{NodeId, Transform, Vector};
use innermodel_collision::Space;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::time::Duration;

/// Changes of a step with forces.
#[derive(Clone, Debug, Default)]
pub struct StepResult {
    /// Places in the root.
    pub places: Vec<(NodeId, Transform)>,
    /// Positions of joints, in rad or mm.
    pub joints: Vec<(NodeId, f64)>,
}

/// Error of a push.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PushError {
    /// Forces do not move the node.
    Unmoved,
    /// The body would be faster than the bound, in m/s.
    TooFast,
}

/// Moves bodies by forces. For each step, a world calls [`Dynamics::place`], moves bases and
/// people, and calls [`Dynamics::step`] and [`Dynamics::applied`].
pub trait Dynamics: Debug + Send {
    /// Takes over the changes of the tree since the last step: bodies and obstacles that are
    /// elsewhere are moved there at once, whatever is in between. Bodies lose their speed by it.
    fn place(&mut self, space: &Space);

    /// Advances by the time of one step. Obstacles move during the step to their present place in
    /// the tree, and push bodies in their way. Motors set the targets of joints.
    fn step(
        &mut self,
        space: &Space,
        motors: &BTreeMap<NodeId, MotorState>,
        step: Duration,
    ) -> StepResult;

    /// The tree has the result of the last step.
    fn applied(&mut self, space: &Space);

    /// Whether the motion of a joint follows from forces.
    fn moves_joint(&self, joint: NodeId) -> bool;

    /// Whether forces move a body: the node with its shape.
    fn moves(&self, body: NodeId) -> bool;

    /// Pushes a body at its centre of mass: an impulse in N·s, in the root.
    ///
    /// # Errors
    /// There is no such body, or it would be faster than `fastest`, in m/s. It then keeps its
    /// speed.
    fn push(
        &mut self,
        space: &Space,
        node: NodeId,
        impulse: Vector,
        fastest: f64,
    ) -> Result<(), PushError>;

    /// A number that differs, but for chance, where speeds differ.
    fn digest(&self) -> u64;

    /// A copy for a cloned world. Speeds are kept; contacts begin again.
    fn duplicate(&self) -> Box<dyn Dynamics>;
}
