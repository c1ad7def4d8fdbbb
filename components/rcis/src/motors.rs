//! Motors of joints. Those of one robot are on one bus.

use crate::SpecificWorker;
use crate::warnings::Warnings;
use innermodel::Kind;
use innermodel_simulation::{Error, MotorGoal, World};
use rcis_generated::interfaces::joint_motor as calls;
use rcis_generated::types::robo_comp_joint_motor::{
    BusParams, HardwareFailedException, UnknownMotorException,
};
use rcis_generated::{
    Context, Member, MotorGoalPosition, MotorGoalPositionList, MotorGoalVelocity,
    MotorGoalVelocityList, MotorList, MotorParams, MotorParamsList, MotorState, MotorStateMap,
    Motors,
};

/// Steps of a motor that counts in steps, in one radian or millimetre.
const STEPS: f64 = 1000.0;

/// Error of a goal that is refused.
enum Refused {
    Unknown(UnknownMotorException),
    Failed(HardwareFailedException),
}

/// The error of all operations that refuse a goal.
impl From<Refused> for calls::SetPositionError {
    fn from(refused: Refused) -> Self {
        match refused {
            Refused::Unknown(error) => error.into(),
            Refused::Failed(error) => error.into(),
        }
    }
}

fn failed(what: String) -> Refused {
    Refused::Failed(HardwareFailedException { what })
}

/// Names and limits of a joint: least, greatest, home, greatest speed.
fn limits(kind: &Kind) -> Option<(f64, f64, f64, f64)> {
    match kind {
        Kind::Joint(joint) => Some((joint.min, joint.max, joint.home, joint.max_speed)),
        Kind::Prismatic(joint) => Some((joint.min, joint.max, joint.home, joint.max_speed)),
        _ => None,
    }
}

fn joints(world: &World, owner: &str) -> Vec<String> {
    let groups = world.groups(&["joint", "prismaticJoint"]);
    let own = groups.into_iter().find(|(name, _)| name == owner);
    own.map_or_else(Vec::new, |(_, joints)| joints)
}

fn check(world: &World, owner: &str, joint: &str) -> Result<(), UnknownMotorException> {
    if joints(world, owner).iter().any(|name| name == joint) {
        return Ok(());
    }
    let joint = rc_diagnostics::foreign::clean(joint);
    let what = format!("`{owner}` has no joint `{joint}`");
    Err(UnknownMotorException { what })
}

pub(crate) fn motor_states(world: &World, owner: &str) -> MotorStateMap {
    let joints = joints(world, owner).into_iter();
    let states = joints.filter_map(|joint| {
        let state = motor_state(world, &joint).ok()?;
        Some((joint, state))
    });
    states.collect()
}

fn motor_state(world: &World, joint: &str) -> Result<MotorState, Error> {
    let motor = world.motor(joint)?;
    Ok(MotorState {
        pos: motor.position as f32,
        vel: motor.velocity as f32,
        power: 0.0,
        time_stamp: format!("{:.3}", world.time().as_secs_f64()),
        p: (motor.position * STEPS).round() as i32,
        v: (motor.velocity * STEPS).round() as i32,
        is_moving: motor.velocity != 0.0,
        temperature: 25,
    })
}

fn motor_params(world: &World, joint: &str, bus_id: u8) -> Result<MotorParams, Error> {
    let tree = world.tree();
    let node = tree.node(joint)?;
    let (min, max, home, speed) = limits(node.kind()).unwrap_or_default();
    Ok(MotorParams {
        name: joint.to_owned(),
        bus_id,
        min_pos: min as f32,
        max_pos: max as f32,
        max_velocity: if speed > 0.0 {
            speed as f32
        } else {
            f32::INFINITY
        },
        zero_pos: home as f32,
        steps_range: (std::f64::consts::TAU * STEPS) as f32,
        max_degrees: (max - min).to_degrees() as f32,
        inverted_sign: false,
    })
}

/// Commands motors: all of them, or none.
fn move_motors(
    world: &mut World,
    warnings: &mut Warnings,
    owner: &str,
    goals: &[(String, MotorGoal)],
) -> Result<(), Refused> {
    for (joint, goal) in goals {
        check(world, owner, joint).map_err(Refused::Unknown)?;
        let tree = world.tree();
        let kind = tree.node(joint).map(|node| limits(node.kind()));
        let Ok(Some((min, max, ..))) = kind else {
            continue;
        };
        if let MotorGoal::Position { target, .. } = *goal
            // The numbers of the interface have fewer digits than those of the file.
            && !(min as f32..=max as f32).contains(&(target as f32))
        {
            let what = format!("`{joint}` moves from {min} to {max}, not to {target}");
            return Err(failed(what));
        }
    }
    let named: Vec<_> = goals
        .iter()
        .map(|(id, goal)| (id.as_str(), *goal))
        .collect();
    let limited = world.command(&named);
    let limited = limited.map_err(|error| failed(error.to_string()))?;
    for ((joint, _), limited) in goals.iter().zip(limited) {
        if limited {
            warnings.log(format!("`{joint}` does not move as fast as commanded"));
        }
    }
    Ok(())
}

fn home(world: &World, joint: &str) -> (String, MotorGoal) {
    let tree = world.tree();
    let home = tree.node(joint).ok().and_then(|node| limits(node.kind()));
    let goal = MotorGoal::Position {
        target: home.map_or(0.0, |(_, _, home, _)| home),
        speed: 0.0,
    };
    (joint.to_owned(), goal)
}

fn to_position(goal: MotorGoalPosition) -> (String, MotorGoal) {
    let position = MotorGoal::Position {
        target: f64::from(goal.position),
        speed: f64::from(goal.max_speed),
    };
    (goal.name, position)
}

fn to_velocity(goal: MotorGoalVelocity) -> (String, MotorGoal) {
    let velocity = MotorGoal::Velocity {
        velocity: f64::from(goal.velocity),
        acceleration: f64::from(goal.max_acc),
    };
    (goal.name, velocity)
}

impl Motors<Context> for SpecificWorker {
    fn set_position(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        goal: MotorGoalPosition,
    ) -> Result<(), calls::SetPositionError> {
        Ok(move_motors(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            &[to_position(goal)],
        )?)
    }

    fn set_velocity(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        goal: MotorGoalVelocity,
    ) -> Result<(), calls::SetVelocityError> {
        Ok(move_motors(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            &[to_velocity(goal)],
        )?)
    }

    fn set_zero_pos(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        name: String,
    ) -> Result<(), calls::SetZeroPosError> {
        let goals = [home(&self.worlds.main, &name)];
        Ok(move_motors(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            &goals,
        )?)
    }

    fn set_sync_position(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        list_goals: MotorGoalPositionList,
    ) -> Result<(), calls::SetSyncPositionError> {
        let goals: Vec<_> = list_goals.into_iter().map(to_position).collect();
        Ok(move_motors(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            &goals,
        )?)
    }

    fn set_sync_velocity(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        list_goals: MotorGoalVelocityList,
    ) -> Result<(), calls::SetSyncVelocityError> {
        let goals: Vec<_> = list_goals.into_iter().map(to_velocity).collect();
        Ok(move_motors(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            &goals,
        )?)
    }

    fn set_sync_zero_pos(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<(), calls::SetSyncZeroPosError> {
        let joints = joints(&self.worlds.main, member.name()).into_iter();
        let goals: Vec<_> = joints
            .map(|joint| home(&self.worlds.main, &joint))
            .collect();
        Ok(move_motors(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            &goals,
        )?)
    }

    fn get_motor_params(
        &mut self,
        ctx: &mut Context,
        member: &Member,
        motor: String,
    ) -> Result<MotorParams, calls::GetMotorParamsError> {
        check(&self.worlds.main, member.name(), &motor)?;
        let all = self.get_all_motor_params(ctx, member).into_iter();
        let mut named = all.filter(|params| params.name == motor);
        Ok(named.next().unwrap_or_default())
    }

    fn get_motor_state(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        motor: String,
    ) -> Result<MotorState, calls::GetMotorStateError> {
        check(&self.worlds.main, member.name(), &motor)?;
        let state = motor_state(&self.worlds.main, &motor);
        Ok(self.warnings.or_default(state))
    }

    fn get_motor_state_map(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        m_list: MotorList,
    ) -> Result<MotorStateMap, calls::GetMotorStateMapError> {
        for motor in &m_list {
            check(&self.worlds.main, member.name(), motor)?;
        }
        let mut states = motor_states(&self.worlds.main, member.name());
        states.retain(|name, _| m_list.contains(name));
        Ok(states)
    }

    fn get_all_motor_state(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<MotorStateMap, calls::GetAllMotorStateError> {
        Ok(motor_states(&self.worlds.main, member.name()))
    }

    fn get_all_motor_params(&mut self, _ctx: &mut Context, member: &Member) -> MotorParamsList {
        let joints = joints(&self.worlds.main, member.name())
            .into_iter()
            .zip(0_usize..);
        let params = joints.filter_map(|(joint, at)| {
            // A bus has 256 ids; further motors share the last one.
            let id = u8::try_from(at).unwrap_or(u8::MAX);
            motor_params(&self.worlds.main, &joint, id).ok()
        });
        params.collect()
    }

    fn get_bus_params(&mut self, _ctx: &mut Context, member: &Member) -> BusParams {
        BusParams {
            handler: "rcis".to_owned(),
            device: member.name().to_owned(),
            num_motors: joints(&self.worlds.main, member.name()).len() as i32,
            baud_rate: 0,
            basic_period: self.worlds.main.step_time().as_millis() as i32,
        }
    }
}
