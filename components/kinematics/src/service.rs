//! The interface `Kinematics`.

use crate::SpecificWorker;
use crate::answers::{Reached, rows};
use crate::specific_worker::transform;
use kinematics_generated::{
    Context, ForwardError, Found, InverseError, Joint, Kinematics, KinematicsError, Manipulability,
    ManipulabilityError, PathError, Positions, Transform,
};

/// The most poses of a path: the other requests wait for it.
const MOST_POSES: usize = 1_000;

/// The most computations of the motion for all poses of a path. Poses that are near each other need some five each.
const MOST_MOTIONS: usize = 20_000;

/// The reply or the exception of an operation.
fn reply<T, E: From<KinematicsError>>(result: Result<T, String>) -> Result<T, E> {
    result.map_err(|what| KinematicsError { what }.into())
}

fn target(pose: &Transform) -> Result<[[f64; 4]; 4], String> {
    let Transform {
        translation,
        rotation,
    } = pose;
    rows(
        [translation.x, translation.y, translation.z],
        [rotation.x, rotation.y, rotation.z, rotation.w],
    )
}

fn found(of: Reached) -> Found {
    Found {
        positions: of.positions,
        reached: of.reached,
        distance: of.distance,
        angle: of.angle,
    }
}

impl SpecificWorker {
    fn follow(
        &mut self,
        [tip, base]: [&str; 2],
        poses: &[Transform],
        seed: Positions,
    ) -> Result<Vec<Found>, String> {
        if poses.len() > MOST_POSES {
            return Err(format!(
                "a path has at most {MOST_POSES} poses, found {}",
                poses.len()
            ));
        }
        let mut last = self.answers.checked(seed, &self.now)?;
        let targets: Vec<_> = poses.iter().map(target).collect::<Result<_, _>>()?;
        let (mut all, mut motions) = (Vec::new(), 0);
        for target in targets {
            let one = self.answers.inverse(tip, base, &target, &last)?;
            motions += one.iterations;
            if motions > MOST_MOTIONS {
                return Err(format!(
                    "{} of {} poses needed {motions} computations of the motion, more than {MOST_MOTIONS}: ask for \
                    parts of the path",
                    all.len() + 1,
                    poses.len()
                ));
            }
            last.clone_from(&one.positions);
            let reached = one.reached;
            all.push(found(one));
            if !reached {
                break;
            }
        }
        Ok(all)
    }
}

impl Kinematics<Context> for SpecificWorker {
    fn get_joints(&mut self, _ctx: &mut Context) -> Vec<Joint> {
        let robot = &self.answers.cell.robot;
        let joints = robot.coordinates.iter().zip(robot.limits());
        let joints = joints.map(|(name, limits)| Joint {
            name: name.clone(),
            lower: limits.map_or(f64::NEG_INFINITY, |limits| limits.lower),
            upper: limits.map_or(f64::INFINITY, |limits| limits.upper),
            velocity: limits.map_or(0.0, |limits| limits.velocity),
            effort: limits.map_or(0.0, |limits| limits.effort),
        });
        joints.collect()
    }

    fn get_links(&mut self, _ctx: &mut Context) -> Vec<String> {
        let links = self.answers.cell.robot.links();
        links.map(|(_, name)| name.to_owned()).collect()
    }

    fn get_positions(&mut self, _ctx: &mut Context) -> Positions {
        self.now.clone()
    }

    fn forward(
        &mut self,
        _ctx: &mut Context,
        tip: String,
        base: String,
        positions: Positions,
    ) -> Result<Transform, ForwardError> {
        let at = self.answers.checked(positions, &self.now);
        reply(at.and_then(|at| Ok(transform(&self.answers.forward(&tip, &base, &at)?))))
    }

    fn inverse(
        &mut self,
        _ctx: &mut Context,
        tip: String,
        base: String,
        pose: Transform,
        seed: Positions,
    ) -> Result<Found, InverseError> {
        let seed = self.answers.checked(seed, &self.now);
        let asked = seed.and_then(|seed| Ok((seed, target(&pose)?)));
        reply(asked.and_then(|(seed, target)| {
            Ok(found(self.answers.inverse(&tip, &base, &target, &seed)?))
        }))
    }

    fn path(
        &mut self,
        _ctx: &mut Context,
        tip: String,
        base: String,
        poses: Vec<Transform>,
        seed: Positions,
    ) -> Result<Vec<Found>, PathError> {
        reply(self.follow([&tip, &base], &poses, seed))
    }

    fn manipulability(
        &mut self,
        _ctx: &mut Context,
        tip: String,
        base: String,
        positions: Positions,
    ) -> Result<Manipulability, ManipulabilityError> {
        let at = self.answers.checked(positions, &self.now);
        reply(at.and_then(|at| {
            let singular_values = self.answers.singular_values(&tip, &base, &at)?;
            Ok(Manipulability {
                measure: singular_values.iter().product(),
                singular_values,
            })
        }))
    }
}
