//! The worker without processes: the test is the other components of its world.

use door_finder::SpecificWorker;
use door_finder_generated::testing::TestContext;
use door_finder_generated::world::{Door, Overruled};
use door_finder_generated::{Context, Worker, WorkerError, WorldHandlers};
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

    let doors = test.g.snapshot().doors_of("kitchen")?;
    assert_eq!(doors.columns, ["name", "width"]);
    assert_eq!(doors.cells, [["front".into(), 0.8.into()]]);
    let refused = test.g.snapshot().doors_of("front");
    let reason = refused.expect_err("it is no room").to_string();
    let expected = "the parameter `$room` is `(front:door)`, expected a node of type `room`";
    assert_eq!(reason, expected);

    // The others get the door, and the value of its stream.
    test.g.meet(&others)?;
    let now = others.snapshot();
    let door = now.named("front").next().expect("a door");
    assert_eq!(now.node(door)?.get("opened"), Some(&0.05.into()));
    Ok(())
}

/// Takes the lesser of two widths that two components gave a door at the same time.
#[derive(Default)]
struct Careful(Vec<(f64, f64)>);

impl WorldHandlers for Careful {
    fn overruled(&mut self, ctx: &mut Context, value: &Overruled) {
        let door = value.of::<Door>().expect("a door");
        let name = door.name().expect("a name").to_owned();
        let shown = value.shown.as_ref().and_then(|value| value.as_f64());
        let other = value.other.as_ref().and_then(|value| value.as_f64());
        let (shown, other) = (shown.expect("a number"), other.expect("a number"));
        self.0.push((shown, other));
        let decided = ctx
            .g
            .change(|edit| edit.door(&name)?.set_width(shown.min(other)));
        decided.expect("a change");
    }
}

#[test]
fn a_handler_decides_between_two_values_of_one_moment() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    let mut worker = Careful::default();
    test.g
        .change(|edit| edit.add_door("front")?.set_width(0.8))?;
    let others = test.g.others();
    test.g.meet(&others)?;
    // Neither knows of the other one. The later count wins, which is that of two changes.
    let door = others.snapshot().named("front").next().expect("a door");
    others.change(|edit| Ok(edit.set(door, "width", 0.7)?))?;
    test.g.change(|edit| edit.door("front")?.set_width(0.9))?;
    test.g.change(|edit| edit.door("front")?.set_width(1.0))?;
    test.g.meet(&others)?;
    assert_eq!(test.g.snapshot().door("front")?.width(), Some(1.0));

    assert!(test.follow_world(&mut worker));
    assert_eq!(worker.0, [(1.0, 0.7)]);
    test.g.meet(&others)?;
    let now = others.snapshot();
    assert_eq!(now.node(door)?.get("width"), Some(&0.7.into()));
    // It is asked once.
    test.follow_world(&mut worker);
    assert_eq!(worker.0.len(), 1);
    Ok(())
}

#[test]
fn numbers_convert_between_units() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    test.g
        .change(|edit| edit.add_door("front")?.set_in("width", 80.0, "cm"))?;
    let now = test.g.snapshot();
    let door = now.door("front")?;
    assert_eq!(door.width(), Some(0.8));
    let millimetres = now.number_in(door.node_id(), "width", "mm")?;
    assert_eq!(millimetres, Some(800.0));
    let wrong = now.number_in(door.node_id(), "width", "kg");
    let reason = wrong.expect_err("it is no mass").to_string();
    assert_eq!(reason, "`width`: a number in `m` is none in `kg`");
    let refused = test
        .g
        .change(|edit| edit.door("front")?.set_in("opened", 1.0, "m"));
    assert_eq!(
        refused.expect_err("it has none").to_string(),
        "`opened` has no unit"
    );
    Ok(())
}

#[test]
fn a_view_has_the_change_of_a_token_or_there_is_none() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    let others = test.g.others();
    let token = others.change(|edit| {
        let room = edit.add_node("room")?;
        Ok(edit.set(room, "name", "kitchen")?)
    })?;
    let early = test.g.snapshot_after(token, Duration::ZERO);
    let reason = early.expect_err("it is not there").to_string();
    let expected = format!("the replica does not have the change {token} yet");
    assert_eq!(reason, expected);
    test.g.meet(&others)?;
    let now = test.g.snapshot_after(token, Duration::ZERO)?;
    assert_eq!(now.room("kitchen")?.name(), Some("kitchen"));
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
