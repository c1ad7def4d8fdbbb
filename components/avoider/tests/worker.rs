//! The worker without scanner, base, battery or process.

use avoider::SpecificWorker;
use avoider_generated::machine::{MachineEvent, MachineState};
use avoider_generated::testing::{DifferentialRobotCall, Fault, TestContext};
use avoider_generated::{BatteryStates, Params, TBattery, TData, WorkerError};
use std::cell::Cell;
use std::rc::Rc;
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(50);
const DRIVE: DifferentialRobotCall = DifferentialRobotCall::SetSpeedBase {
    adv: 300.0,
    rot: 0.0,
};
const TURN: DifferentialRobotCall = DifferentialRobotCall::SetSpeedBase { adv: 0.0, rot: 0.9 };
const STAND: DifferentialRobotCall = DifferentialRobotCall::SetSpeedBase { adv: 0.0, rot: 0.0 };

fn context() -> TestContext {
    let test = TestContext::new(Params {
        safe_distance: 500.0,
        speed: 300.0,
        turn_speed: 0.9,
        lockstep: false,
    });
    test.battery_status.fail(Fault::NoServer);
    test
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
fn a_clear_way_is_driven_and_an_obstacle_is_not() -> Result<(), Box<dyn std::error::Error>> {
    let mut test = context();
    let mut worker: SpecificWorker = test.start()?;
    assert_eq!(
        test.machine.active(),
        ["on.motion.idle", "on.battery.charged"]
    );
    test.laser.on_get_laser_data(|| wall(4000.0));
    run(&mut test, &mut worker, PERIOD);
    assert!(test.machine.is_in(MachineState::Cruising));
    assert_eq!(test.differential_robot.take_calls(), [DRIVE]);
    test.laser.on_get_laser_data(|| wall(400.0));
    run(&mut test, &mut worker, PERIOD);
    assert!(test.machine.is_in(MachineState::Turning));
    assert_eq!(test.differential_robot.take_calls(), [TURN]);
    test.laser.on_get_laser_data(|| wall(4000.0));
    run(&mut test, &mut worker, PERIOD);
    assert!(test.machine.is_in(MachineState::Cruising));
    assert_eq!(test.differential_robot.take_calls(), [DRIVE]);
    test.machine.fire(MachineEvent::Stop);
    run(&mut test, &mut worker, PERIOD);
    assert!(test.machine.is_in(MachineState::Idle));
    let stop = DifferentialRobotCall::StopBase;
    assert_eq!(test.differential_robot.calls(), [stop]);
    Ok(())
}

fn run(test: &mut TestContext, worker: &mut SpecificWorker, time: Duration) {
    test.run(worker, time).expect("a run");
}

#[test]
fn a_robot_that_finds_no_way_stands_and_tries_again() -> Result<(), Box<dyn std::error::Error>> {
    let mut test = context();
    let mut worker: SpecificWorker = test.start()?;
    test.laser.on_get_laser_data(|| wall(400.0));
    run(&mut test, &mut worker, Duration::from_secs(10));
    assert!(test.machine.is_in(MachineState::Turning));
    assert_eq!(test.differential_robot.take_calls().last(), Some(&TURN));
    run(&mut test, &mut worker, Duration::from_secs(1));
    assert!(test.machine.is_in(MachineState::Blocked));
    assert_eq!(test.differential_robot.take_calls().last(), Some(&STAND));
    run(&mut test, &mut worker, Duration::from_secs(5));
    assert!(test.machine.is_in(MachineState::Turning));
    test.laser.on_get_laser_data(|| wall(4000.0));
    run(&mut test, &mut worker, PERIOD);
    assert!(test.machine.is_in(MachineState::Cruising));
    Ok(())
}

/// A battery with a level that the test sets, in percent.
fn battery(test: &TestContext) -> Rc<Cell<f32>> {
    let percentage = Rc::new(Cell::new(50.0));
    let level = percentage.clone();
    test.battery_status.recover();
    test.battery_status.on_get_battery_state(move || {
        Ok(TBattery {
            percentage: level.get(),
            state: BatteryStates::Disconnected,
            ..TBattery::default()
        })
    });
    percentage
}

#[test]
fn a_robot_that_is_stopped_while_it_charges_stands_until_it_is_told_to_go()
-> Result<(), Box<dyn std::error::Error>> {
    let mut test = context();
    let percentage = battery(&test);
    test.laser.on_get_laser_data(|| wall(4000.0));
    let mut worker: SpecificWorker = test.start()?;
    let second = Duration::from_secs(1);
    for (level, event, motion) in [
        (10.0, None, MachineState::Charging),
        (10.0, Some(MachineEvent::Stop), MachineState::Idle),
        (90.0, None, MachineState::Idle),
        (10.0, None, MachineState::Idle),
        (10.0, Some(MachineEvent::Go), MachineState::Charging),
        (90.0, None, MachineState::Cruising),
        (90.0, Some(MachineEvent::Stop), MachineState::Idle),
        (90.0, Some(MachineEvent::Go), MachineState::Cruising),
    ] {
        percentage.set(level);
        event.into_iter().for_each(|event| test.machine.fire(event));
        run(&mut test, &mut worker, 2 * second);
        let active = test.machine.active().join(" ");
        assert!(test.machine.is_in(motion), "{event:?} at {level}: {active}");
    }
    Ok(())
}

#[test]
fn with_a_low_battery_it_stands_until_it_has_charged() -> Result<(), Box<dyn std::error::Error>> {
    let mut test = context();
    let percentage = battery(&test);
    test.laser.on_get_laser_data(|| wall(4000.0));
    let mut worker: SpecificWorker = test.start()?;
    let second = Duration::from_secs(1);
    for (level, motion, battery) in [
        (50.0, MachineState::Cruising, MachineState::Charged),
        (19.0, MachineState::Charging, MachineState::Low),
        (79.0, MachineState::Charging, MachineState::Low),
        (80.0, MachineState::Cruising, MachineState::Charged),
        (21.0, MachineState::Cruising, MachineState::Charged),
    ] {
        percentage.set(level);
        run(&mut test, &mut worker, 2 * second);
        let active = test.machine.active().join(" ");
        assert!(test.machine.is_in(motion), "at {level}: {active}");
        assert!(test.machine.is_in(battery), "at {level}: {active}");
    }
    Ok(())
}

#[test]
fn without_a_scan_the_base_gets_no_command() -> Result<(), Box<dyn std::error::Error>> {
    let mut test = context();
    let mut worker: SpecificWorker = test.start()?;
    test.laser.on_get_laser_data(|| wall(4000.0));
    for (fault, reason) in [
        (Fault::NoServer, "no server at `test/Laser`"),
        (Fault::Timeout, "no reply from `test/Laser` within"),
        (Fault::ServerDied, "died while it held the call"),
    ] {
        test.laser.fail(fault);
        let failed = test.run(&mut worker, PERIOD);
        let Err(WorkerError::Failed(message)) = failed else {
            panic!("{failed:?}");
        };
        assert!(message.contains(reason), "{message}");
    }
    assert_eq!(test.differential_robot.calls(), []);
    test.laser.recover();
    run(&mut test, &mut worker, PERIOD);
    assert_eq!(test.differential_robot.calls(), [DRIVE]);
    Ok(())
}

#[test]
fn in_lockstep_it_first_waits_for_the_base() -> Result<(), Box<dyn std::error::Error>> {
    let mut test = context();
    test.params.lockstep = true;
    test.answer_defaults();
    test.laser.on_get_laser_data(|| wall(4000.0));
    let mut worker: SpecificWorker = test.start()?;
    run(&mut test, &mut worker, PERIOD);
    let state = DifferentialRobotCall::GetBaseState;
    assert_eq!(test.differential_robot.calls(), [state, DRIVE]);
    Ok(())
}

#[test]
fn it_decides_once_a_period() -> Result<(), Box<dyn std::error::Error>> {
    let mut test = TestContext::configured()?;
    test.battery_status.fail(Fault::NoServer);
    test.laser.on_get_laser_data(|| wall(4000.0));
    let mut worker: SpecificWorker = test.start()?;
    run(&mut test, &mut worker, Duration::from_secs(1));
    assert_eq!(test.differential_robot.calls().len(), 20);
    assert_eq!(test.now().as_secs_f64(), 1.0);
    Ok(())
}
