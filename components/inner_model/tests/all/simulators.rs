//! The requests to simulators whose scenes follow the tree.

use crate::{params, place, pose};
use inner_model::SpecificWorker;
use inner_model_generated::testing::{Fault, SimulatorsCall, TestContext};
use inner_model_generated::{Followed, InnerModel, Worker};
use std::time::Duration;

/// How long a component waits for others until it knows that it is alone.
const ALONE: Duration = Duration::from_secs(3);

/// The period of the component.
const PERIOD: Duration = Duration::from_millis(20);

/// What a request says: whether it is the whole tree, and its nodes.
fn said(calls: Vec<SimulatorsCall>) -> Vec<(bool, usize)> {
    let calls = calls.into_iter().map(|call| match call {
        SimulatorsCall::Follow { whole, nodes, .. } => (whole, nodes.len()),
        other => panic!("{other:?}"),
    });
    calls.collect()
}

#[test]
fn the_tree_is_served_while_a_simulator_does_not_answer() {
    let mut test = TestContext::new(params("arm.xml"));
    test.list_members("simulators", &["house"]);
    let house = test.simulators.member("house");
    let mut worker = SpecificWorker::initialize(&mut test).expect("a worker");
    let root = InnerModel::get_subtree(&mut worker, &mut test, "root".into());
    let all = root.expect("the tree").len() - 1;
    house.on_follow(move |_, _, _| Followed {
        nodes: i32::try_from(all).expect("a small tree"),
        unmade: Vec::new(),
    });
    test.run(&mut worker, PERIOD).expect("to run");
    assert_eq!(said(house.take_calls()), [], "the world may be on its way");
    for _ in 0..2 {
        test.follow_world(&mut worker);
        test.advance(ALONE);
    }
    test.run(&mut worker, PERIOD).expect("to run");
    assert_eq!(said(house.take_calls()), [(true, all)]);

    // Each call begins in a period. Until it has ended, there is no other one.
    let id = String::from("cup");
    for x in 0..5 {
        let moved = pose(f64::from(x), 0.0, 0.0);
        InnerModel::set_pose(&mut worker, &mut test, id.clone(), moved).expect("a node");
        worker.compute(&mut test).expect("to compute");
        test.advance(PERIOD);
        assert_eq!(place(&mut worker, &mut test, &id)[0], f64::from(x));
    }
    assert_eq!(said(house.take_calls()), [(false, 1)]);
    test.end_calls(&mut worker);
    worker.compute(&mut test).expect("to compute");
    assert_eq!(said(house.take_calls()), [(false, 1)]);
    test.end_calls(&mut worker);

    // After a failure, there is a pause, and what has changed is not lost.
    worker.compute(&mut test).expect("to compute");
    house.fail(Fault::Timeout);
    let moved = pose(9.0, 0.0, 0.0);
    InnerModel::set_pose(&mut worker, &mut test, id, moved).expect("a node");
    test.run(&mut worker, Duration::from_millis(500))
        .expect("to run");
    house.recover();
    assert_eq!(said(house.take_calls()), [(false, 1)]);
    test.run(&mut worker, Duration::from_secs(1))
        .expect("to run");
    assert_eq!(said(house.take_calls())[0], (false, 1));
}
