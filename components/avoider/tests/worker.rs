//! The worker without scanner, base or process.

use avoider::SpecificWorker;
use avoider_generated::testing::{DifferentialRobotCall, Fault, TestContext};
use avoider_generated::{Params, TData, Worker, WorkerError};
use std::time::Duration;

const DRIVE: DifferentialRobotCall = DifferentialRobotCall::SetSpeedBase {
    adv: 300.0,
    rot: 0.0,
};

fn context() -> TestContext {
    TestContext::new(Params {
        safe_distance: 500.0,
        speed: 300.0,
        turn_speed: 0.9,
        lockstep: false,
    })
}

/// A wall all around, in mm.
fn wall(distance: f32) -> Vec<TData> {
    let angles = (-18_i16..=18).map(|step| f32::from(step) * 0.087);
    let measure = |angle| TData {
        angle,
        dist: distance,
    };
    angles.map(measure).collect()
}

#[test]
fn a_clear_way_is_driven_and_an_obstacle_is_not() -> Result<(), WorkerError> {
    let mut test = context();
    let mut worker = SpecificWorker::initialize(&mut test)?;
    test.laser.on_get_laser_data(|| wall(4000.0));
    worker.compute(&mut test)?;
    assert_eq!(test.differential_robot.take_calls(), [DRIVE]);
    test.laser.on_get_laser_data(|| wall(400.0));
    worker.compute(&mut test)?;
    let turn = DifferentialRobotCall::SetSpeedBase { adv: 0.0, rot: 0.9 };
    assert_eq!(test.differential_robot.take_calls(), [turn]);
    worker.finalize(&mut test);
    let stop = DifferentialRobotCall::StopBase;
    assert_eq!(test.differential_robot.calls(), [stop]);
    Ok(())
}

#[test]
fn without_a_scan_the_base_gets_no_command() -> Result<(), WorkerError> {
    let mut test = context();
    let mut worker = SpecificWorker::initialize(&mut test)?;
    test.laser.on_get_laser_data(|| wall(4000.0));
    for (fault, reason) in [
        (Fault::NoServer, "no server at `test/Laser`"),
        (Fault::Timeout, "no reply from `test/Laser` within"),
        (Fault::ServerDied, "died while it held the call"),
    ] {
        test.laser.fail(fault);
        let failed = worker.compute(&mut test);
        let Err(WorkerError::Failed(message)) = failed else {
            panic!("{failed:?}");
        };
        assert!(message.contains(reason), "{message}");
    }
    assert_eq!(test.differential_robot.calls(), []);
    test.laser.recover();
    worker.compute(&mut test)?;
    assert_eq!(test.differential_robot.calls(), [DRIVE]);
    Ok(())
}

#[test]
fn in_lockstep_it_first_waits_for_the_base() -> Result<(), WorkerError> {
    let mut test = context();
    test.params.lockstep = true;
    test.answer_defaults();
    test.laser.on_get_laser_data(|| wall(4000.0));
    let mut worker = SpecificWorker::initialize(&mut test)?;
    worker.compute(&mut test)?;
    let state = DifferentialRobotCall::GetBaseState;
    assert_eq!(test.differential_robot.calls(), [state, DRIVE]);
    Ok(())
}

#[test]
fn it_decides_once_a_period() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    test.laser.on_get_laser_data(|| wall(4000.0));
    let mut worker = SpecificWorker::initialize(&mut test)?;
    test.run(&mut worker, Duration::from_secs(1))?;
    assert_eq!(test.differential_robot.calls().len(), 20);
    assert_eq!(test.now().as_secs_f64(), 1.0);
    Ok(())
}
