//! Bases and their poses.

use crate::SpecificWorker;
use crate::warnings::Warnings;
use innermodel::{NodeRef, Point, frames};
use innermodel_simulation::{Error, Pose2D, Speed, World};
use rcis_generated::interfaces::{
    differential_robot as base_calls, generic_base as generic_calls, omni_robot as omni_calls,
};
use rcis_generated::types::{
    robo_comp_differential_robot as differential, robo_comp_generic_base as generic,
    robo_comp_omni_robot as omni,
};
use rcis_generated::{
    Bases, Context, FullPoseEuler, GenericBases, Member, OmniBases, Poses, TBaseState,
};

/// A base stands if it is not faster, in mm/s and rad/s: at a wall, rounding moves it a little.
const STANDS: f64 = 0.01;
/// Whether a node is below another one.
pub(crate) fn is_below(node: NodeRef<'_>, above: &str) -> bool {
    std::iter::successors(Some(node), NodeRef::parent).any(|node| node.id() == above)
}

fn place(x: f32, z: f32, alpha: f32) -> Pose2D {
    Pose2D {
        x: f64::from(x),
        z: f64::from(z),
        alpha: f64::from(alpha),
    }
}

/// A place as the wire has it: whole millimetres.
fn whole(x: i32, z: i32, alpha: f32) -> Pose2D {
    Pose2D {
        x: f64::from(x),
        z: f64::from(z),
        alpha: f64::from(alpha),
    }
}

pub(crate) fn base_state(world: &World, id: &str) -> Result<TBaseState, Error> {
    let base = world.base(id)?;
    let (odometer, corrected) = (base.odometer, base.corrected);
    let (sin, cos) = odometer.alpha.sin_cos();
    let Speed {
        side,
        advance,
        turn,
    } = base.actual;
    Ok(TBaseState {
        x: odometer.x as f32,
        corrected_x: corrected.x as f32,
        z: odometer.z as f32,
        corrected_z: corrected.z as f32,
        alpha: odometer.alpha as f32,
        corrected_alpha: corrected.alpha as f32,
        adv_vx: (advance * cos + side * sin) as f32,
        adv_vz: (advance * sin - side * cos) as f32,
        rot_v: turn as f32,
        // A base that is blocked, or has an empty battery, does not move.
        is_moving: base.wanted != Speed::default()
            && (advance.hypot(side) > STANDS || turn.abs() > STANDS),
    })
}

/// The state of the robot that a sensor belongs to.
pub(crate) fn state_of_robot(world: &World, sensor: &str) -> Result<TBaseState, Error> {
    base_state(world, &world.owner(sensor)?)
}

fn odometer(world: &World, id: &str) -> Result<(i32, i32, f32), Error> {
    let Pose2D { x, z, alpha } = world.base(id)?.odometer;
    Ok((x.round() as i32, z.round() as i32, alpha as f32))
}

/// Where a base is, whatever its odometry says, in the axes of points of `RoboComp`.
pub(crate) fn full_pose(world: &World, id: &str) -> Result<FullPoseEuler, Error> {
    let (tree, at) = (world.tree(), world.place(id)?);
    let height = tree.pose("root", id)?.translation[1];
    let place = frames::point_to_robocomp(&Point::new(at.x, height, at.z));
    let wheels = world.base(id)?.actual;
    // Wheels that slip move the base less than themselves.
    let part = 1.0 - world.robot(id)?.1.slip;
    let speed = Speed {
        side: wheels.side * part,
        advance: wheels.advance * part,
        turn: wheels.turn * part,
    };
    let (sin, cos) = at.alpha.sin_cos();
    Ok(FullPoseEuler {
        source: id.to_owned(),
        x: place.x as f32,
        y: place.y as f32,
        z: place.z as f32,
        rz: at.alpha as f32,
        vx: (speed.advance * cos + speed.side * sin) as f32,
        vy: (speed.advance * sin - speed.side * cos) as f32,
        vrz: speed.turn as f32,
        confidence: 100,
        ..FullPoseEuler::default()
    })
}

/// Commands a base. NaN stops it, and a limit is reported.
fn go(world: &mut World, warnings: &mut Warnings, id: &str, wanted: Speed) -> Result<(), Error> {
    match world.drive(id, wanted) {
        Ok(taken) => {
            if taken != wanted {
                warnings.log(format!("`{id}` does not drive as fast as commanded"));
            }
            Ok(())
        }
        Err(error) => {
            // Without the robot, there is nothing to stop.
            let _ = world.drive(id, Speed::default());
            Err(error)
        }
    }
}

fn generic_failed(error: &Error) -> generic::HardwareFailedException {
    generic::HardwareFailedException {
        what: error.to_string(),
    }
}

fn omni_failed(error: &Error) -> omni::HardwareFailedException {
    omni::HardwareFailedException {
        what: error.to_string(),
    }
}

impl Bases<Context> for SpecificWorker {
    fn get_base_state(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<TBaseState, base_calls::GetBaseStateError> {
        Ok(base_state(&self.worlds.main, member.name()).map_err(|e| generic_failed(&e))?)
    }

    fn get_base_pose(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<(i32, i32, f32), base_calls::GetBasePoseError> {
        Ok(odometer(&self.worlds.main, member.name()).map_err(|e| generic_failed(&e))?)
    }

    fn get_mech_params(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> differential::TMechParams {
        let Ok((_, robot)) = self.worlds.main.robot(member.name()) else {
            return differential::TMechParams::default();
        };
        differential::TMechParams {
            device: member.name().to_owned(),
            handler: "rcis".to_owned(),
            max_vel_adv: robot.max_speed as f32,
            max_vel_rot: robot.max_turn as f32,
            ..differential::TMechParams::default()
        }
    }

    fn set_speed_base(&mut self, _ctx: &mut Context, member: &Member, adv: f32, rot: f32) {
        let wanted = Speed {
            side: 0.0,
            advance: f64::from(adv),
            turn: f64::from(rot),
        };
        let done = go(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            wanted,
        );
        self.warnings.or_default(done);
    }

    fn stop_base(&mut self, _ctx: &mut Context, member: &Member) {
        let done = go(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            Speed::default(),
        );
        self.warnings.or_default(done);
    }

    fn reset_odometer(&mut self, _ctx: &mut Context, member: &Member) {
        let origin = Some(Pose2D::default());
        let done = self.worlds.main.set_odometer(member.name(), origin, None);
        self.warnings.or_default(done);
    }

    fn set_odometer(&mut self, _ctx: &mut Context, member: &Member, state: TBaseState) {
        let odometer = place(state.x, state.z, state.alpha);
        let corrected = place(state.corrected_x, state.corrected_z, state.corrected_alpha);
        let done = self
            .worlds
            .main
            .set_odometer(member.name(), Some(odometer), Some(corrected));
        self.warnings.or_default(done);
    }

    fn set_odometer_pose(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        x: i32,
        z: i32,
        alpha: f32,
    ) {
        let odometer = Some(whole(x, z, alpha));
        let done = self.worlds.main.set_odometer(member.name(), odometer, None);
        self.warnings.or_default(done);
    }

    fn correct_odometer(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        x: i32,
        z: i32,
        alpha: f32,
    ) {
        let corrected = Some(whole(x, z, alpha));
        let done = self
            .worlds
            .main
            .set_odometer(member.name(), None, corrected);
        self.warnings.or_default(done);
    }
}

impl OmniBases<Context> for SpecificWorker {
    fn get_base_state(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<TBaseState, omni_calls::GetBaseStateError> {
        Ok(base_state(&self.worlds.main, member.name()).map_err(|e| omni_failed(&e))?)
    }

    fn get_base_pose(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<(i32, i32, f32), omni_calls::GetBasePoseError> {
        Ok(odometer(&self.worlds.main, member.name()).map_err(|e| omni_failed(&e))?)
    }

    fn set_speed_base(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        advx: f32,
        advz: f32,
        rot: f32,
    ) -> Result<(), omni_calls::SetSpeedBaseError> {
        let wanted = Speed {
            side: f64::from(advx),
            advance: f64::from(advz),
            turn: f64::from(rot),
        };
        Ok(go(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            wanted,
        )
        .map_err(|e| omni_failed(&e))?)
    }

    fn stop_base(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<(), omni_calls::StopBaseError> {
        let done = go(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            Speed::default(),
        );
        Ok(done.map_err(|e| omni_failed(&e))?)
    }

    fn reset_odometer(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<(), omni_calls::ResetOdometerError> {
        let origin = Some(Pose2D::default());
        let done = self.worlds.main.set_odometer(member.name(), origin, None);
        Ok(done.map_err(|e| omni_failed(&e))?)
    }

    fn set_odometer(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        state: TBaseState,
    ) -> Result<(), omni_calls::SetOdometerError> {
        let odometer = place(state.x, state.z, state.alpha);
        let corrected = place(state.corrected_x, state.corrected_z, state.corrected_alpha);
        let done = self
            .worlds
            .main
            .set_odometer(member.name(), Some(odometer), Some(corrected));
        Ok(done.map_err(|e| omni_failed(&e))?)
    }

    fn set_odometer_pose(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        x: i32,
        z: i32,
        alpha: f32,
    ) -> Result<(), omni_calls::SetOdometerPoseError> {
        let odometer = Some(whole(x, z, alpha));
        let done = self.worlds.main.set_odometer(member.name(), odometer, None);
        Ok(done.map_err(|e| omni_failed(&e))?)
    }

    fn correct_odometer(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        x: i32,
        z: i32,
        alpha: f32,
    ) -> Result<(), omni_calls::CorrectOdometerError> {
        let corrected = Some(whole(x, z, alpha));
        let done = self
            .worlds
            .main
            .set_odometer(member.name(), None, corrected);
        Ok(done.map_err(|e| omni_failed(&e))?)
    }
}

impl GenericBases<Context> for SpecificWorker {
    fn get_base_state(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<TBaseState, generic_calls::GetBaseStateError> {
        Ok(base_state(&self.worlds.main, member.name()).map_err(|e| generic_failed(&e))?)
    }

    fn get_base_pose(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<(i32, i32, f32), generic_calls::GetBasePoseError> {
        Ok(odometer(&self.worlds.main, member.name()).map_err(|e| generic_failed(&e))?)
    }
}

impl Poses<Context> for SpecificWorker {
    /// The simulator knows where the base is.
    fn set_initial_pose(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        _x: f32,
        _y: f32,
        _z: f32,
        _rx: f32,
        _ry: f32,
        _rz: f32,
    ) {
        self.warnings.log(format!(
            "`{}` has its true pose; an initial pose has no effect",
            member.name()
        ));
    }

    fn get_full_pose_euler(&mut self, _ctx: &mut Context, member: &Member) -> FullPoseEuler {
        let pose = full_pose(&self.worlds.main, member.name());
        self.warnings.or_default(pose)
    }
}
