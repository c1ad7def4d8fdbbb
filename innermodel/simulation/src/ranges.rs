//! Sensors that measure ranges by rays.

use crate::batteries::robot_of;
use crate::error::Error;
use crate::frames::{CloudPoint, Range};
use crate::random::Random;
use crate::schedule::Frame;
use crate::sensor_noise::SensorNoise;
use innermodel::kinds::{Laser, Lidar, Ultrasound};
use innermodel::{NodeId, NodeRef, Point, Vector};
use innermodel_collision::Space;
use std::f64::consts::TAU;

/// The most points of one frame.
const MOST_POINTS: u64 = 4_000_000;
/// Rays with which an ultrasound sensor begins to look for the nearest surface, on circles of a
/// third, two thirds and all of its cone about its axis.
const CIRCLES: [(f64, u32); 3] = [(1.0 / 3.0, 6), (2.0 / 3.0, 12), (1.0, 18)];
/// The search ends at this angle in radians: the way to a plane is then longer than the shortest
/// one by a part of 2e-8 at most.
const FINEST: f64 = 2e-4;
/// The most steps of the search.
const MOST_MOVES: u32 = 200;

/// The bodies of the robot that a sensor is below. The sensor looks through them.
#[derive(Debug)]
pub(crate) struct OwnBodies(Vec<NodeId>);

impl OwnBodies {
    pub(crate) fn of(node: NodeRef<'_>, space: &Space) -> Self {
        let mut above = std::iter::successors(Some(node), NodeRef::parent);
        let robot = robot_of(node);
        let robot = above.find(|node| Some(node.node_id()) == robot);
        let below = robot.iter().flat_map(NodeRef::subtree);
        let bodies = below.map(|node| node.node_id());
        let mut bodies: Vec<NodeId> = bodies.filter(|id| space.shape_of(*id).is_some()).collect();
        bodies.sort_unstable();
        Self(bodies)
    }

    /// Whether a body belongs to the robot. Each ray asks for each body near it.
    #[inline]
    pub(crate) fn contains(&self, node: NodeId) -> bool {
        self.0.binary_search(&node).is_ok()
    }
}

fn direction(azimuth: f64, elevation: f64) -> Vector {
    let (sin, cos) = azimuth.sin_cos();
    let (up, along) = elevation.sin_cos();
    Vector::new(along * sin, up, along * cos)
}

fn check(id: &str, values: u64) -> Result<(), Error> {
    if values <= MOST_POINTS {
        return Ok(());
    }
    Err(Error::TooManyValues {
        id: rc_diagnostics::foreign::clean(id),
        values,
        most: MOST_POINTS,
    })
}

/// The ranges of a laser. `space` has the bodies as they were in the frame.
pub(crate) fn laser(
    space: &Space,
    node: NodeRef<'_>,
    laser: &Laser,
    frame: &Frame,
    random: Random,
) -> Result<Vec<Range>, Error> {
    check(node.id(), u64::from(laser.measures))?;
    let own = OwnBodies::of(node, space);
    let caster = space.caster(node.node_id())?;
    let mut errors = SensorNoise::new(&laser.signal, random, frame.bias[0]);
    let angles = innermodel::sensors::laser_angles(laser);
    Ok(angles
        .map(|angle| {
            let hit = caster.cast(&direction(angle, 0.0), laser.max, &|b| !own.contains(b));
            // A ray without an echo takes random numbers, too, so that it does not affect other
            // rays.
            let measured = errors.measure(hit.map_or(laser.max, |(_, distance)| distance));
            let distance = hit
                .and(measured)
                .map_or(laser.max, |d| d.max(laser.min).min(laser.max));
            Range { angle, distance }
        })
        .collect())
}

/// The one range of an ultrasound sensor, as [`laser`].
pub(crate) fn ultrasound(
    space: &Space,
    node: NodeRef<'_>,
    sonar: &Ultrasound,
    frame: &Frame,
    random: Random,
) -> Result<Vec<Range>, Error> {
    let own = OwnBodies::of(node, space);
    let caster = space.caster(node.node_id())?;
    let cast = |turn: [f64; 2]| {
        let (sin, cos) = turn[0].hypot(turn[1]).sin_cos();
        let (up, right) = turn[1].atan2(turn[0]).sin_cos();
        let ray = Vector::new(sin * right, sin * up, cos);
        let hit = caster.cast(&ray, sonar.max, &|b| !own.contains(b));
        hit.map(|(_, distance)| distance)
    };
    let nearest = nearest_in_cone(sonar.angle / 2.0, cast);
    let mut errors = SensorNoise::new(&sonar.signal, random, frame.bias[0]);
    let measured = nearest.and_then(|distance| errors.measure(distance));
    let distance = measured.map_or(sonar.max, |d| d.max(sonar.min).min(sonar.max));
    Ok(vec![Range {
        angle: 0.0,
        distance,
    }])
}

/// The points of a lidar, as [`laser`].
pub(crate) fn lidar(
    space: &Space,
    node: NodeRef<'_>,
    lidar: &Lidar,
    frame: &Frame,
    random: Random,
) -> Result<Vec<CloudPoint>, Error> {
    if lidar.measures == 0 {
        return Ok(Vec::new());
    }
    let values = u64::from(lidar.measures) * u64::from(lidar.rings);
    check(node.id(), values)?;
    let own = OwnBodies::of(node, space);
    let caster = space.caster(node.node_id())?;
    let mut errors = SensorNoise::new(&lidar.signal, random, frame.bias[0]);
    let mut points = Vec::new();
    for ring in 0..lidar.rings {
        let part = f64::from(ring) / f64::from(lidar.rings.saturating_sub(1).max(1));
        let elevation = lidar.low + (lidar.high - lidar.low) * part;
        for azimuth in ring_angles(lidar) {
            let way = direction(azimuth, elevation);
            let hit = caster.cast(&way, lidar.max, &|b| !own.contains(b));
            // A ray without an echo takes random numbers, too.
            let measured = errors.measure(hit.map_or(lidar.max, |(_, distance)| distance));
            let (Some((met, _)), Some(distance)) = (hit, measured) else {
                continue;
            };
            if distance < lidar.min || distance > lidar.max {
                continue;
            }
            points.push(CloudPoint {
                point: Point::from(way * distance),
                azimuth,
                elevation,
                distance,
                node: met,
                ring,
            });
        }
    }
    Ok(points)
}

/// The shortest distance in a cone about z: the nearest of some rays, and from it the nearest one
/// around it, by smaller and smaller angles (a pattern search). An object smaller than the angle
/// between the first rays, a fifth of the cone or less, can be missed. `cast` gets a direction as
/// the angles of a turn to x and to y.
fn nearest_in_cone(half: f64, cast: impl Fn([f64; 2]) -> Option<f64>) -> Option<f64> {
    let circles = CIRCLES.iter().flat_map(|(part, count)| {
        (0..*count).map(move |at| {
            let (up, right) = (TAU * f64::from(at) / f64::from(*count)).sin_cos();
            [half * part * right, half * part * up]
        })
    });
    let mut best: Option<([f64; 2], f64)> = None;
    for turn in std::iter::once([0.0; 2]).chain(circles) {
        if let Some(distance) = cast(turn)
            && best.is_none_or(|(_, least)| distance < least)
        {
            best = Some((turn, distance));
        }
    }
    let (mut turn, mut least) = best?;
    let mut angle = half / 3.0;
    for _ in 0..MOST_MOVES {
        if angle < FINEST {
            break;
        }
        let beside = (0..8).filter_map(|at| {
            let (up, right) = (TAU * f64::from(at) / 8.0).sin_cos();
            let [x, y] = [turn[0] + angle * right, turn[1] + angle * up];
            let shrink = (half / x.hypot(y)).min(1.0);
            let there = [x * shrink, y * shrink];
            cast(there).map(|distance| (there, distance))
        });
        match beside.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((there, distance)) if distance < least => (turn, least) = (there, distance),
            _ => angle /= 2.0,
        }
    }
    Some(least)
}

/// The angles of a ring, from +angle/2. A whole turn has no second point at its end.
fn ring_angles(lidar: &Lidar) -> impl Iterator<Item = f64> + use<> {
    let (angle, count) = (lidar.angle, lidar.measures);
    let is_turn = angle.abs() >= TAU - 1e-9;
    let parts = if is_turn {
        count
    } else {
        count.saturating_sub(1)
    };
    let step = angle / f64::from(parts.max(1));
    (0..count).map(move |at| angle / 2.0 - f64::from(at) * step)
}
