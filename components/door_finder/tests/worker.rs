//! The worker without processes: the test is the other components of its world.

use door_finder::SpecificWorker;
use door_finder_generated::testing::TestContext;
use door_finder_generated::{Worker, WorkerError};
use std::time::Duration;

#[test]
fn a_room_that_another_component_adds_gets_a_door() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    let mut worker = SpecificWorker::initialize(&mut test)?;
    let others = test.g.others();
    others.change(|edit| {
        let room = edit.add_node("room")?;
        edit.set(room, "name", "kitchen")?;
        Ok(())
    })?;
    test.run(&mut worker, Duration::from_millis(100))?;
    assert!(test.g.snapshot().door("front").is_err());

    test.g.meet(&others)?;
    assert!(test.follow_world(&mut worker));
    let now = test.g.snapshot();
    assert_eq!(now.door("front")?.width(), Some(0.8));
    let at = now.pose("kitchen", now.door("front")?)?;
    assert_eq!(at.translation, [1.2, 0.0, 0.0]);
    test.run(&mut worker, Duration::from_millis(100))?;

    // The others get the door, and the value of its stream.
    test.g.meet(&others)?;
    let now = others.snapshot();
    let door = now.named("front").next().expect("a door");
    assert_eq!(now.node(door)?.get("opened"), Some(&0.05.into()));
    Ok(())
}

#[test]
fn a_component_writes_what_its_clause_says_only() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    let refused = test.g.change(|edit| {
        edit.add_node("room")?;
        Ok(())
    });
    let reason = refused.expect_err("it is not written").to_string();
    assert!(reason.contains("does not write `room`"), "{reason}");
    Ok(())
}
