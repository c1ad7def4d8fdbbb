//! The arm follows its motors, without a window.

use arm_monitor::SpecificWorker;
use arm_monitor_generated::testing::TestContext;
use arm_monitor_generated::{MotorState, Worker, WorkerError};

#[test]
fn the_arm_stands_as_its_motors() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    test.joint_motor.on_get_all_motor_state(|| {
        let turned = MotorState {
            pos: 0.5,
            ..MotorState::default()
        };
        Ok([("shoulder".to_owned(), turned)].into())
    });
    let mut worker = SpecificWorker::initialize(&mut test)?;
    let before = test.tree.snapshot();
    worker.compute(&mut test)?;
    let now = test.tree.snapshot();
    assert_eq!(now.node("joint_2")?.position(), Some(0.5));
    assert_ne!(before.pose("root", "tip")?, now.pose("root", "tip")?);
    Ok(())
}
