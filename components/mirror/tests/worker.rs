//! The worker between two worlds that are not there.

use mirror::SpecificWorker;
use mirror_generated::interfaces::simulation::GetPoseError;
use mirror_generated::testing::{Fault, TestContext};
use mirror_generated::types::rc_simulation::Reason;
use mirror_generated::{Pose, SimulationError, Worker, WorkerError};
use std::cell::RefCell;
use std::rc::Rc;

#[test]
fn what_is_not_detected_stays_and_is_named() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    test.params.nodes = ["base", "chair", "crate"].map(str::to_owned).to_vec();
    test.seen.on_get_pose(|world, id, base| {
        assert_eq!((world.as_str(), base.as_str()), ("", "root"));
        if id == "chair" {
            let error = SimulationError {
                reason: Reason::UnknownNode,
                what: "there is no chair".to_owned(),
            };
            return Err(GetPoseError::SimulationError(error));
        }
        Ok(Pose {
            x: id.len() as f64,
            ..Pose::default()
        })
    });
    let moved = Rc::new(RefCell::new(Vec::new()));
    let kept = Rc::clone(&moved);
    test.imagined.on_teleport(move |_, id, base, pose| {
        assert_eq!(base, "root");
        kept.borrow_mut().push((id, pose.x));
        Ok(())
    });
    let mut worker = SpecificWorker::initialize(&mut test)?;
    let failed = worker.compute(&mut test).expect_err("no chair").to_string();
    assert!(
        failed.contains("`chair`") && failed.contains("there is no chair"),
        "{failed}"
    );
    let expected = [("base".to_owned(), 4.0), ("crate".to_owned(), 5.0)];
    assert_eq!(*moved.borrow(), expected);
    test.params.nodes.remove(1);
    worker.compute(&mut test)?;
    assert_eq!(moved.borrow().len(), 4);
    Ok(())
}

#[test]
fn a_call_without_a_reply_ends_the_period() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    test.seen.on_get_pose(|_, _, _| Ok(Pose::default()));
    let moved = Rc::new(RefCell::new(0));
    let counted = Rc::clone(&moved);
    test.imagined.on_teleport(move |_, _, _, _| {
        *counted.borrow_mut() += 1;
        Ok(())
    });
    let mut worker = SpecificWorker::initialize(&mut test)?;
    test.seen.fail_once(Fault::Timeout);
    worker.compute(&mut test).expect_err("no reply");
    assert_eq!(*moved.borrow(), 0, "the other nodes would wait as long");
    worker.compute(&mut test)?;
    assert_eq!(*moved.borrow(), 2);
    Ok(())
}
