//! The worker without processes.

mod control;
mod devices;
mod drawing;
mod follow;
mod manager;
mod meanings;
mod window;

use innermodel::{Folders, InnerModel};
use rcis::SpecificWorker;
use rcis_generated::testing::TestContext;
use rcis_generated::{Member, Params, Simulation, Worker, WorkerError};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

fn params() -> Params {
    Params {
        inner_model: PathBuf::from("scene.xml"),
        viewer: false,
        step: Duration::from_millis(10),
        seed: 1,
        rate: 1.0,
        paused: false,
        wait: false,
        limit: Duration::from_secs(5),
        physics: false,
        pose_period: Duration::from_millis(50),
        refuse_collisions: false,
        work: Duration::from_secs(5),
        most_worlds: 3,
    }
}

/// A context with the tree of a text.
fn context(text: &str) -> TestContext {
    let mut test = TestContext::new(params());
    let tree = InnerModel::parse(text).expect("a right text");
    test.tree = Arc::new(tree);
    test
}

fn start(text: &str) -> (SpecificWorker, TestContext) {
    let mut test = context(text);
    let worker = SpecificWorker::initialize(&mut test).expect("a worker");
    (worker, test)
}

/// The house of this component.
fn house() -> (SpecificWorker, TestContext) {
    let mut test = TestContext::new(params());
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("house.xml");
    let tree = InnerModel::load(&file, &Folders::default()).expect("a right file");
    test.tree = Arc::new(tree);
    let worker = SpecificWorker::initialize(&mut test).expect("a worker");
    (worker, test)
}

fn member(of: Option<&Member>) -> Member {
    of.expect("a member").clone()
}

#[test]
fn a_scene_opens_a_member_for_each_device() {
    let (_, test) = house();
    let names = |members: &[Member]| -> Vec<String> {
        members
            .iter()
            .map(|member| member.name().to_owned())
            .collect()
    };
    assert_eq!(names(test.lasers.members()), ["front"]);
    assert_eq!(names(test.ultrasounds.members()), ["base"]);
    assert_eq!(names(test.cameras.members()), ["camera"]);
    assert_eq!(names(test.rgbds.members()), ["camera"]);
    assert_eq!(names(test.bases.members()), ["base"]);
    assert_eq!(names(test.generic_bases.members()), ["base"]);
    assert_eq!(names(test.motors.members()), ["base"]);
    assert_eq!(names(test.batteries.members()), ["battery"]);
    assert_eq!(names(test.bumpers.members()), ["base"]);
    assert_eq!(names(test.imus.members()), ["imu"]);
    assert!(test.lidars.is_empty() && test.omni_bases.is_empty());
    // `rcview --slots` prints the same members.
    let printed = innermodel::slots::of(&test.tree.snapshot());
    let count: usize = printed.iter().map(|array| array.members.len()).sum();
    assert_eq!((printed.len(), count), (15, 15));
}

#[test]
fn an_id_that_cannot_be_the_name_of_a_slot_is_refused() {
    let bad = r#"<innerModel><transform id="a"><laser id="my-laser"/></transform></innerModel>"#;
    let refused = SpecificWorker::initialize(&mut context(bad)).map(drop);
    let text = refused.expect_err("no name of a slot").to_string();
    assert!(text.contains("my-laser"), "{text}");
}

#[test]
fn a_step_of_zero_is_refused() {
    let mut test = context("<innerModel/>");
    test.params.step = Duration::ZERO;
    let refused = SpecificWorker::initialize(&mut test).map(drop);
    assert!(matches!(refused, Err(WorkerError::Fatal(text)) if text.starts_with("a step of 0ns")));
}

#[test]
fn a_rate_that_is_almost_0_is_slow() -> Result<(), WorkerError> {
    let (mut worker, mut test) = house();
    for rate in [f64::MIN_POSITIVE, 1e-25, 1000.0] {
        test.params.rate = rate;
        worker.params_changed(&mut test, &[])?;
    }
    Ok(())
}

#[test]
fn steps_that_are_shorter_than_a_period_keep_the_rate() -> Result<(), WorkerError> {
    let mut test = context("<innerModel/>");
    test.params.step = Duration::from_micros(10);
    let mut worker = SpecificWorker::initialize(&mut test)?;
    worker.compute(&mut test)?;
    let clock = Simulation::get_clock(&mut worker, &mut test, String::new()).expect("a clock");
    assert_eq!(clock.time, 100_000);
    Ok(())
}
