//! The distance of a base to the first obstacle in a step.

use crate::dynamics::Dynamics;
use crate::error::Error;
use crate::pose2d::{Motion, Speed};
use crate::problems::Problems;
use innermodel::{Kind, NodeId, NodeRef, Snapshot, Transform};
use innermodel_collision::{Space, Touching};
use std::collections::BTreeMap;
use std::time::Duration;

/// How often the last piece of a way to an obstacle is halved: the base stops within a micrometre.
const HALVINGS: u32 = 24;
/// A base that an obstacle stops within this way stays where it is, in millimetres: far more than
/// the errors of rounding, by which it would creep into the obstacle, and less than a micrometre.
const LEAST: f64 = 1e-4;
/// How deep bodies are in each other before they stop a base, in millimetres. A wheel on a floor
/// touches it by rounding errors.
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
pub(crate) type FreePart = (f64, Option<(NodeId, NodeId)>);

/// A motion that an obstacle prevents. While the two bodies stay where they are, it stays so:
/// nothing has to be searched for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pressed {
    from: Transform,
    speed: Speed,
    /// The body of the robot and the obstacle, and where they are.
    pair: (NodeId, NodeId),
    places: (Transform, Transform),
}

/// The bodies that a base can touch in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings<'a> {
    pub(crate) space: &'a Space,
    pub(crate) tree: &'a Snapshot,
    /// Bodies that forces move give way.
    pub(crate) forces: Option<&'a dyn Dynamics>,
    pub(crate) step: Duration,
}

/// Motions that obstacles prevented in the last steps of bases.
#[derive(Clone, Debug, Default)]
pub(crate) struct Obstacles(BTreeMap<NodeId, Vec<Pressed>>);

impl Obstacles {
    /// Forgets all of them: the scene has changed.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// Which part of a motion of one step is possible for a robot that is at `here` and starts at
    /// `from`, before it touches an obstacle, or gets deeper into one that it touches now.
    pub(crate) fn free_fraction(
        &mut self,
        around: Surroundings<'_>,
        node: NodeId,
        here: &Transform,
        from: &Transform,
        speed: &Speed,
        problems: &mut Problems,
    ) -> Result<FreePart, Error> {
        if let Some(pair) = self.still_pressed(around, node, from, speed) {
            return Ok((0.0, Some(pair)));
        }
        let found = around.search(node, here, from, speed, problems)?;
        if let (0.0, Some(pair)) = found {
            self.press(around, node, from, speed, pair)?;
        }
        Ok(found)
    }

    /// The obstacle of a motion, if it stopped it before and nothing has changed since.
    fn still_pressed(
        &self,
        around: Surroundings<'_>,
        node: NodeId,
        from: &Transform,
        speed: &Speed,
    ) -> Option<(NodeId, NodeId)> {
        let known = self.0.get(&node)?.iter();
        let pressed = known
            .filter(|known| known.from == *from && known.speed == *speed)
            .find(|known| around.places(known.pair).is_ok_and(|at| at == known.places))?;
        let gives_way = around.gives_way(pressed.pair.1);
        (!gives_way).then_some(pressed.pair)
    }

    /// Keeps that an obstacle prevents a motion.
    fn press(
        &mut self,
        around: Surroundings<'_>,
        node: NodeId,
        from: &Transform,
        speed: &Speed,
        pair: (NodeId, NodeId),
    ) -> Result<(), Error> {
        let places = around.places(pair)?;
        let known = self.0.entry(node).or_default();
        // A step has two motions: the way, and a turn where it ended.
        known.truncate(1);
        known.insert(
            0,
            Pressed {
                from: *from,
                speed: *speed,
                pair,
                places,
            },
        );
        Ok(())
    }
}

impl Surroundings<'_> {
    /// Whether forces move a body.
    fn gives_way(&self, body: NodeId) -> bool {
        self.forces.is_some_and(|forces| forces.moves(body))
    }

    fn places(&self, (body, other): (NodeId, NodeId)) -> Result<(Transform, Transform), Error> {
        let tree = self.tree;
        Ok((tree.node(body)?.to_root(), tree.node(other)?.to_root()))
    }

    fn search(
        &self,
        node: NodeId,
        here: &Transform,
        from: &Transform,
        speed: &Speed,
        problems: &mut Problems,
    ) -> Result<FreePart, Error> {
        let (way, pieces, last) = self.pieces(node, speed, problems)?;
        let (space, tree) = (self.space, self.tree);
        let seconds = self.step.as_secs_f64();
        let back = here.inverse();
        // A bumper gives way.
        let counts = |body: NodeId, _| {
            let body = tree.node(body).ok();
            let mut above = std::iter::successors(body, NodeRef::parent);
            !above.any(|node| matches!(node.kind(), Kind::TouchSensor(_)))
        };
        let touching = |motion: &Transform| {
            #[cfg(test)]
            tests::SEARCHES.with(|count| count.set(count.get() + 1));
            space.touching(node, motion, &counts)
        };
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
                    Some(depth) if depth > PRESSED || !self.gives_way(t.other) => {
                        TOLERANCE.max(depth + ROUNDING)
                    }
                    _ => f64::INFINITY,
                };
                ((t.body, t.other), most)
            })
            .collect();
        let stops = |t: &Touching| match known.get(&(t.body, t.other)) {
            Some(most) => t.depth.unwrap_or(f64::MAX) > *most,
            None => t.depth.unwrap_or(f64::MAX) > TOLERANCE && !self.gives_way(t.other),
        };
        let new = |part: f64| -> Result<Option<(NodeId, NodeId)>, Error> {
            let stopping = touched(part)?.into_iter().find(stops);
            Ok(stopping.map(|t| (t.body, t.other)))
        };
        let mut reached = 0.0;
        for piece in 1..=pieces {
            let next = last * f64::from(piece) / f64::from(pieces);
            if let Some(mut pair) = new(next)? {
                // A base that is pressed against an obstacle gets nowhere.
                if reached == 0.0
                    && let Some(pair) = new((LEAST / way).min(next))?
                {
                    return Ok((0.0, Some(pair)));
                }
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
    /// First, the way of the body that moves most, in millimetres.
    fn pieces(
        &self,
        node: NodeId,
        speed: &Speed,
        problems: &mut Problems,
    ) -> Result<(f64, u32, f64), Error> {
        let space = self.space;
        let (half, reach) = (space.half_thickness(node)?, space.reach(node)?);
        let seconds = self.step.as_secs_f64();
        let turn = speed.turn.abs() * seconds;
        let way = speed.side.hypot(speed.advance) * seconds + turn * reach;
        if half <= 0.0 {
            return Ok((way, 1, 1.0));
        }
        let half = half.max(THINNEST);
        // Of a turn, a piece is at most a tenth of a radian.
        let pieces = (way / half).max(turn * 10.0).ceil().max(1.0);
        if pieces <= MOST_PIECES {
            return Ok((way, pieces as u32, 1.0));
        }
        let id = self.tree.node(node).map_or("", |node| node.id());
        problems.add(format!(
            "`{id}` is too fast for steps of {:?}: its bodies move by at most {:.0} mm in one",
            self.step,
            MOST_PIECES * half
        ));
        Ok((way, MOST_PIECES as u32, MOST_PIECES / pieces))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::World;
    use innermodel::{InnerModel, Pose};
    use std::cell::Cell;

    thread_local! {
        /// Searches for contacts by this thread.
        pub(super) static SEARCHES: Cell<u32> = const { Cell::new(0) };
    }

    /// Two robots on a floor; one of them stands before a wall.
    const SCENE: &str = r#"<innerModel>
        <plane id="wall" pz="1000" nz="1" size="4000,4000,20" collide="1"/>
        <differentialrobot id="base" collide="1"><cylinder id="body" radius="200" length="300" collide="1"/></differentialrobot>
        <differentialrobot id="other" tx="-3000" collide="1"><cylinder id="second" radius="200" length="300" collide="1"/></differentialrobot>
        </innerModel>"#;

    fn world() -> World {
        let model = InnerModel::parse(SCENE).expect("a scene");
        World::new(model, Duration::from_millis(10), 1).expect("a world")
    }

    fn steps(world: &mut World, count: u32) -> u32 {
        let before = SEARCHES.get();
        for _ in 0..count {
            world.step().expect("a step");
        }
        SEARCHES.get() - before
    }

    fn ahead(advance: f64, turn: f64) -> Speed {
        Speed {
            advance,
            turn,
            ..Speed::default()
        }
    }

    #[test]
    fn a_base_at_a_wall_searches_no_more_than_one_that_drives() {
        let mut world = world();
        world.drive("base", ahead(500.0, 0.0)).expect("a base");
        let driving = steps(&mut world, 100);
        assert_eq!(driving, 200);
        steps(&mut world, 100);
        assert!(world.base("base").expect("a base").stopped_by.is_some());
        assert_eq!(steps(&mut world, 100), 0);
        // Others that move elsewhere cost their own searches.
        world.drive("other", ahead(100.0, 0.5)).expect("a base");
        assert_eq!(steps(&mut world, 100), 200);
        // A turn at the wall: that of the way, which finds the wall, and the turn on the spot.
        world.drive("other", Speed::default()).expect("a base");
        world.drive("base", ahead(500.0, 0.5)).expect("a base");
        assert!(steps(&mut world, 100) <= 500);
        let turned = world.place("base").expect("a place").alpha;
        assert!(turned.abs() > 0.4, "{turned}");
    }

    #[test]
    fn a_base_goes_on_when_its_obstacle_does() {
        let mut world = world();
        let there = Pose::new(0.0, 0.0, 700.0, 0.0, 0.0, 0.0);
        world.teleport("other", "root", there).expect("a base");
        world.drive("base", ahead(500.0, 0.0)).expect("a base");
        steps(&mut world, 100);
        let z = |world: &World| world.place("base").expect("a place").z;
        let stopped = z(&world);
        assert_eq!(steps(&mut world, 10), 0);
        world.drive("other", ahead(100.0, 0.0)).expect("a base");
        steps(&mut world, 50);
        assert!((z(&world) - stopped - 50.0).abs() < 1.5, "{}", z(&world));
        // The other one is at the wall, and then removed.
        steps(&mut world, 200);
        let stopped = z(&world);
        world
            .edit(|edit| edit.remove("other").map(drop))
            .expect("a base");
        steps(&mut world, 10);
        assert!((z(&world) - stopped - 50.0).abs() < 1.5, "{}", z(&world));
    }
}
