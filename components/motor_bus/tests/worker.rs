//! The life cycle of the bus, without its process.

use motor_bus::SpecificWorker;
use motor_bus_generated::lifecycle::{LifecycleState, Transition};
use motor_bus_generated::testing::TestContext;
use motor_bus_generated::{JointMotor, MotorGoalVelocity, Worker, WorkerError};
use std::time::Duration;

#[test]
fn motors_move_only_while_the_bus_is_active_and_hold_afterwards() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    let mut worker = SpecificWorker::initialize(&mut test)?;
    assert_eq!(test.lifecycle(), Some(LifecycleState::Unconfigured));
    let early = test.transition(&mut worker, Transition::Activate);
    assert_eq!(
        early.map_err(|missed| missed.state),
        Err(LifecycleState::Unconfigured)
    );
    test.transition(&mut worker, Transition::Configure)?;
    test.transition(&mut worker, Transition::Activate)?;
    let name = test.params.motors[0].name.clone();
    let goal = MotorGoalVelocity {
        name: name.clone(),
        velocity: 0.1,
        ..MotorGoalVelocity::default()
    };
    worker
        .set_velocity(&mut test, goal)
        .expect("the bus takes the goal");
    let moving = |worker: &mut SpecificWorker, test: &mut TestContext| {
        let state = worker.get_motor_state(test, name.clone());
        state.expect("a state").is_moving
    };
    while !moving(&mut worker, &mut test) {
        test.run(&mut worker, Duration::from_millis(20))?;
    }
    test.transition(&mut worker, Transition::Deactivate)?;
    assert!(!moving(&mut worker, &mut test));
    // While it is not active, no period runs.
    test.run(&mut worker, Duration::from_secs(1))?;
    assert_eq!(
        test.transition(&mut worker, Transition::Activate)?,
        LifecycleState::Active
    );
    test.run(&mut worker, Duration::from_secs(1))?;
    assert!(!moving(&mut worker, &mut test));
    Ok(())
}
