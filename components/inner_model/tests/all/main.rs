//! The worker without processes.

mod following;
mod hostile;
mod manager;
mod service;
mod simulators;

use inner_model::SpecificWorker;
use inner_model_generated::interfaces::inner_model::InnerModelErrorOrCall;
use inner_model_generated::rc_inner_model::Reason;
use inner_model_generated::testing::TestContext;
use inner_model_generated::{InnerModel, Params, Pose, Worker};
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The parameters of a component that serves a file, or an empty tree.
fn params(file: &str) -> Params {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../innermodel/scenes");
    Params {
        file: if file.is_empty() {
            PathBuf::new()
        } else {
            scenes.join(file)
        },
        search: Vec::new(),
        refuse_collisions: false,
        history: Duration::from_secs(10),
        max_points: 10,
    }
}

/// A worker with a scene of this repository.
fn start(file: &str) -> (SpecificWorker, TestContext) {
    start_at(file, 0)
}

/// [`start`] of a component some seconds later: instances have different names or
/// times.
fn start_at(file: &str, seconds: u64) -> (SpecificWorker, TestContext) {
    let mut test = TestContext::new(params(file));
    test.advance(Duration::from_secs(seconds));
    let worker = SpecificWorker::initialize(&mut test).expect("a worker");
    (worker, test)
}

fn pose(x: f64, y: f64, z: f64) -> Pose {
    Pose {
        x,
        y,
        z,
        ..Pose::default()
    }
}

/// Where a node is in the root.
fn place(worker: &mut SpecificWorker, test: &mut TestContext, id: &str) -> [f64; 3] {
    let there = InnerModel::get_pose(worker, test, "root".into(), id.into());
    let there = there.expect("a pose");
    [there.x, there.y, there.z]
}

/// The reason of an exception.
fn reason<T: Debug>(call: Result<T, InnerModelErrorOrCall>) -> Reason {
    match call {
        Err(InnerModelErrorOrCall::InnerModelError(error)) => error.reason,
        other => panic!("{other:?}"),
    }
}
