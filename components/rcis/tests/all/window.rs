//! The pointer in the window changes the world, and the next frames of its sensors.

use crate::{member, start};
use innermodel::{Point, Vector};
use rcis::SpecificWorker;
use rcis_generated::innermodel_viewer::{
    Action, Input, Marks, Modifiers, Navigator, Options, Pixel, TreeView, ViewerAction,
};
use rcis_generated::testing::TestContext;
use rcis_generated::{Lasers, Simulation, WorkerError};
use std::sync::Arc;
use std::time::Duration;

const SIZE: (usize, usize) = (320, 240);
const RADIUS: f64 = 250.0;
const CONTROL: Modifiers = Modifiers {
    shift: false,
    control: true,
};
const SHIFT: Modifiers = Modifiers {
    shift: true,
    control: false,
};
const SCENE: &str = r#"<innerModel>
    <plane id="floor" ny="1" size="6000,6000,100" collide="1"/>
    <transform id="eye" ty="300"><laser id="front" min="10" max="5000" angle="0.2" measures="3"/></transform>
    <transform id="ball" tz="2000" ty="300" engine="bullet" mass="2"><sphere id="ball_body" radius="250" collide="1"/></transform>
    </innerModel>"#;

/// The window of a worker.
fn view(test: &mut TestContext) -> TreeView<'static> {
    let options = Options {
        title: String::new(),
        size: (SIZE.0 as u16, SIZE.1 as u16),
        navigator: None,
        marks: Marks::default(),
    };
    let view = TreeView::new(Arc::clone(&test.tree), &options, &|_| {});
    let mut view = view.with_actions(test.viewer.actions());
    view.draw(SIZE).expect("a picture");
    view
}

fn ball(test: &TestContext) -> Point {
    let tree = test.tree.snapshot();
    let place = tree.transform("root", Point::origin(), "ball");
    place.expect("a node")
}

/// The pixel of the ball.
fn pixel(test: &TestContext) -> Pixel {
    let view = Navigator::of(&test.tree, SIZE).view(SIZE.0, SIZE.1);
    let (x, y) = view.pixel(&ball(test)).expect("in front");
    (x.floor() as i16, y.floor() as i16)
}

/// The measured distance of the laser's beam in the middle.
fn ahead(worker: &mut SpecificWorker, test: &mut TestContext) -> f64 {
    let front = member(test.lasers.get("front"));
    f64::from(worker.get_laser_data(test, &front)[1].dist)
}

/// The true distance.
fn expected(ball: &Point) -> f64 {
    let half = RADIUS * RADIUS - ball.x * ball.x - (ball.y - 300.0).powi(2);
    if half > 0.0 {
        ball.z - half.sqrt()
    } else {
        5000.0
    }
}

#[test]
fn an_object_that_is_dragged_is_in_the_next_frame() -> Result<(), WorkerError> {
    let (mut worker, mut test) = start(SCENE);
    let mut view = view(&mut test);
    let from = pixel(&test);
    view.input(Input::Pressed(1, from, CONTROL));
    // The second place is beyond the edge of the window, which keeps the pointer while it drags.
    for way in [10, 260] {
        view.input(Input::Moved((from.0 + way, from.1 + way / 4)));
        test.run(&mut worker, Duration::from_millis(20))?;
        let now = ball(&test);
        assert!(now.x > 5.0 && (now.y - 300.0).abs() < 1e-9, "{now}");
        let (seen, right) = (ahead(&mut worker, &mut test), expected(&now));
        assert!((seen - right).abs() < 1e-2, "{seen} {right} {now}");
        assert_eq!(view.poll(), ViewerAction::Draw);
    }
    let there = ball(&test);
    assert!(there.x > RADIUS, "out of the beam");
    view.input(Input::Released(1, from));
    // Also in a world that is paused.
    worker.set_paused(&mut test, true);
    let id = "ball".to_owned();
    let place = Point::new(0.0, 300.0, 1000.0);
    test.viewer.actions().push(Action::Move { id, place });
    test.run(&mut worker, Duration::from_millis(20))?;
    assert!((ball(&test) - place).norm() < 1e-9);
    worker.set_paused(&mut test, false);
    test.run(&mut worker, Duration::from_millis(20))?;
    assert!((ahead(&mut worker, &mut test) - 750.0).abs() < 1e-2);
    Ok(())
}

#[test]
fn a_push_moves_a_body_if_forces_are_on() -> Result<(), WorkerError> {
    let (mut worker, mut test) = start(SCENE);
    let mut view = view(&mut test);
    let at = pixel(&test);
    let mut push = |test: &mut TestContext, worker: &mut SpecificWorker| {
        view.input(Input::Pressed(1, at, SHIFT));
        view.input(Input::Moved((at.0 + 90, at.1)));
        view.input(Input::Released(1, (at.0 + 90, at.1)));
        test.run(worker, Duration::from_millis(200))
            .map(|()| view.poll())
    };
    // The window shows why nothing moves.
    assert_eq!(push(&mut test, &mut worker)?, ViewerAction::Draw);
    assert_eq!(ball(&test), Point::new(0.0, 300.0, 2000.0));
    Simulation::set_physics(&mut worker, &mut test, String::new(), true).expect("physics");
    push(&mut test, &mut worker)?;
    let way: Vector = ball(&test) - Point::new(0.0, 300.0, 2000.0);
    assert!(way.x > 50.0 && way.y.abs() < 5.0, "{way}");
    Ok(())
}

/// A user moves what is not there any more.
#[test]
fn a_change_that_cannot_be_made_changes_nothing() -> Result<(), WorkerError> {
    let (mut worker, mut test) = start(SCENE);
    let actions = test.viewer.actions();
    for (id, x) in [("gone", 0.0), ("floor", 0.0), ("ball", f64::NAN)] {
        let (id, place) = (id.to_owned(), Point::new(x, 0.0, 0.0));
        actions.push(Action::Move { id, place });
    }
    let before = test.tree.snapshot().print();
    test.run(&mut worker, Duration::from_millis(10))?;
    assert_eq!(test.tree.snapshot().print(), before);
    assert_eq!(actions.take(), []);
    Ok(())
}

/// The next step would take the person back to its path, so the window says why it is not moved.
#[test]
fn a_person_that_walks_is_not_moved() -> Result<(), WorkerError> {
    for (path, is_moved) in [("path=\"0,0 1000,0\"", false), ("", true)] {
        let scene = format!("<innerModel><human id=\"ann\" {path}/></innerModel>");
        let (mut worker, mut test) = start(&scene);
        worker.set_paused(&mut test, true);
        let mut view = view(&mut test);
        view.poll();
        let before = test.tree.snapshot().print();
        let (id, place) = ("ann".to_owned(), Point::new(0.0, 0.0, 700.0));
        test.viewer.actions().push(Action::Move { id, place });
        test.run(&mut worker, Duration::from_millis(10))?;
        assert_eq!(test.tree.snapshot().print() != before, is_moved);
        assert_eq!(view.poll(), ViewerAction::Draw, "moved, or told");
    }
    Ok(())
}
