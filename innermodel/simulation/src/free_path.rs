//! How far a base gets in a step before it touches an obstacle.

use crate::error::Error;
use crate::pose2d::{Motion, Speed};
use crate::world::World;
use innermodel::{Kind, NodeId, NodeRef, Transform};
use innermodel_collision::Touching;
use std::collections::BTreeMap;

/// How often the last piece of a way to an obstacle is halved: the base stops within a micrometre.
const HALVINGS: u32 = 24;
/// How deep bodies are in each other before they stop a base, in millimetres. A wheel that stands
/// on a floor touches it by rounding errors.
const TOLERANCE: f64 = 0.01;
/// How much deeper than at the start of a step two bodies may get that were deeper in each other
/// than [`TOLERANCE`], in millimetres: more than the errors of rounding.
const ROUNDING: f64 = 1e-6;
/// How deep a body that forces move is in a base, in millimetres, before the base stops: a body
/// that can give way is pushed, one that is pressed against a wall is not.
const PRESSED: f64 = 10.0;
/// The most pieces into which a motion of one step is cut.
const MOST_PIECES: f64 = 1000.0;
/// Bodies count as this thick at least, in millimetres.
const THINNEST: f64 = 0.5;

/// Which part of a motion is possible, from 0 to 1, and what stops it: a body of the robot, and the
/// obstacle.
pub(crate) type Free = (f64, Option<(NodeId, NodeId)>);

impl World {
    /// Which part of a motion of one step is possible for a robot that is at `here` and starts at
    /// `from`, before it touches an obstacle, or gets deeper into one that it touches now.
    pub(crate) fn free_fraction(
        &mut self,
        node: NodeId,
        here: &Transform,
        from: &Transform,
        speed: &Speed,
    ) -> Result<Free, Error> {
        let (pieces, last) = self.pieces(node, speed)?;
        let space = self.space();
        let seconds = self.step.as_secs_f64();
        let back = here.inverse();
        let tree = self.tree();
        // A bumper gives way.
        let counts = |body: NodeId, _| {
            let body = tree.node(body).ok();
            let mut above = std::iter::successors(body, NodeRef::parent);
            !above.any(|node| matches!(node.kind(), Kind::TouchSensor(_)))
        };
        let forces = self.dynamics.as_deref();
        let gives_way = |body: NodeId| forces.is_some_and(|forces| forces.moves(body));
        let touching = |motion: &Transform| space.touching(node, motion, &counts);
        let touched = |part: f64| {
            let motion = Motion::arc(&speed.scaled(part), seconds);
            touching(&(*from * motion.transform() * back))
        };
        // How deep a pair may get. A depth that cannot be computed stops nothing at the start, and
        // everything on the way.
        let known: BTreeMap<(NodeId, NodeId), f64> = touching(&(*from * back))?
            .into_iter()
            .map(|t| {
                let most = match t.depth {
                    Some(depth) if depth > PRESSED || !gives_way(t.other) => {
                        TOLERANCE.max(depth + ROUNDING)
                    }
                    _ => f64::INFINITY,
                };
                ((t.body, t.other), most)
            })
            .collect();
        let stops = |t: &Touching| match known.get(&(t.body, t.other)) {
            Some(most) => t.depth.unwrap_or(f64::MAX) > *most,
            None => t.depth.unwrap_or(f64::MAX) > TOLERANCE && !gives_way(t.other),
        };
        let new = |part: f64| -> Result<Option<(NodeId, NodeId)>, Error> {
            let stopping = touched(part)?.into_iter().find(stops);
            Ok(stopping.map(|t| (t.body, t.other)))
        };
        let mut reached = 0.0;
        for piece in 1..=pieces {
            let next = last * f64::from(piece) / f64::from(pieces);
            if let Some(mut pair) = new(next)? {
                let (mut free, mut blocked) = (reached, next);
                for _ in 0..HALVINGS {
                    let middle = f64::midpoint(free, blocked);
                    match new(middle)? {
                        Some(nearer) => (blocked, pair) = (middle, nearer),
                        None => free = middle,
                    }
                }
                return Ok((free, Some(pair)));
            }
            reached = next;
        }
        Ok((last, None))
    }

    /// Into how many pieces a motion is cut, so that no body of a robot jumps over another one, and
    /// which part of the motion they are: all of it, if the robot is not too fast for the step.
    fn pieces(&mut self, node: NodeId, speed: &Speed) -> Result<(u32, f64), Error> {
        let space = self.space();
        let (half, reach) = (space.half_thickness(node)?, space.reach(node)?);
        if half <= 0.0 {
            return Ok((1, 1.0));
        }
        let seconds = self.step.as_secs_f64();
        let turn = speed.turn.abs() * seconds;
        let way = speed.side.hypot(speed.advance) * seconds + turn * reach;
        let half = half.max(THINNEST);
        // Of a turn, a piece is at most a tenth of a radian.
        let pieces = (way / half).max(turn * 10.0).ceil().max(1.0);
        if pieces <= MOST_PIECES {
            return Ok((pieces as u32, 1.0));
        }
        let id = self.id_of(node).unwrap_or_default();
        self.report(format!(
            "`{id}` is too fast for steps of {:?}: its bodies move by at most {:.0} mm in one",
            self.step,
            MOST_PIECES * half
        ));
        Ok((MOST_PIECES as u32, MOST_PIECES / pieces))
    }
}
