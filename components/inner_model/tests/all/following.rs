//! Two instances that follow each other.

use crate::{place, pose, start, start_at};
use inner_model::SpecificWorker;
use inner_model_generated::testing::{InnerModelPubSample, TestContext};
use inner_model_generated::{Changes, Context, InnerModel, Leader, Node, Worker};
use std::collections::BTreeMap;
use std::time::Duration;

type One = (SpecificWorker, TestContext);

/// The samples of one period.
fn samples((worker, test): &mut One) -> Vec<Changes> {
    test.advance(Duration::from_millis(20));
    worker.compute(test).expect("a period");
    let all = test.inner_model_pub.take_samples();
    let all = all
        .into_iter()
        .map(|InnerModelPubSample::Changed { changes }| changes);
    all.collect()
}

fn deliver(samples: &[Changes], (worker, test): &mut One) {
    for sample in samples {
        worker.changed(test, sample.clone());
    }
}

/// Lets both instances hear each other until none has something to say.
fn settle(a: &mut One, b: &mut One) {
    for _ in 0..10 {
        let (of_a, of_b) = (samples(a), samples(b));
        deliver(&of_a, b);
        deliver(&of_b, a);
    }
    for one in [&mut *a, &mut *b] {
        let said = samples(one);
        assert!(said.iter().all(|sample| sample.whole), "{said:?}");
    }
    // Siblings may differ in their order: each instance appends what it has not had.
    let tree = |one: &mut One| {
        let nodes = one
            .0
            .get_subtree(&mut one.1, "root".into())
            .expect("the root");
        let nodes = nodes.into_iter().map(|mut node| {
            node.attributes.sort_by(|a, b| a.name.cmp(&b.name));
            (node.id.clone(), node)
        });
        nodes.collect::<BTreeMap<String, Node>>()
    };
    assert_eq!(tree(a), tree(b));
}

fn context(one: &mut One) -> (&mut SpecificWorker, &mut Context) {
    (&mut one.0, &mut one.1)
}

#[test]
fn an_empty_instance_gets_the_whole_tree_and_then_changes() {
    let (mut a, mut b) = (start("arm.xml"), start_at("", 1));
    settle(&mut a, &mut b);
    let (worker, ctx) = context(&mut a);
    worker
        .set_joint(ctx, "joint_2".into(), 1.0)
        .expect("a joint");
    let sample = samples(&mut a);
    // A change is small.
    assert_eq!(
        (sample.len(), sample[0].whole, sample[0].nodes.len()),
        (1, false, 1)
    );
    deliver(&sample, &mut b);
    assert_eq!(
        place(&mut a.0, &mut a.1, "tip"),
        place(&mut b.0, &mut b.1, "tip")
    );
    let (worker, ctx) = context(&mut b);
    worker.remove(ctx, "cup".into()).expect("a node");
    worker
        .add(
            ctx,
            "world".into(),
            r#"<transform id="ball" tx="1"/>"#.into(),
        )
        .expect("a node");
    settle(&mut a, &mut b);
    let (worker, ctx) = context(&mut a);
    assert!(worker.get_node(ctx, "cup".into()).is_err());
    assert!(worker.get_node(ctx, "ball".into()).is_ok());
}

#[test]
fn of_two_changes_at_once_the_same_one_holds_in_both() {
    let (mut a, mut b) = (start("arm.xml"), start_at("arm.xml", 1));
    settle(&mut a, &mut b);
    for (one, x) in [(&mut a, 1.0), (&mut b, 2.0)] {
        let (worker, ctx) = context(one);
        worker
            .set_pose(ctx, "cup".into(), pose(x, 0.0, 0.0))
            .expect("a pose");
    }
    let (worker, ctx) = context(&mut a);
    worker.remove(ctx, "table_leg_1".into()).expect("a node");
    settle(&mut a, &mut b);
    let cup = place(&mut a.0, &mut a.1, "cup");
    assert_eq!(cup, place(&mut b.0, &mut b.1, "cup"));
    // A later change of either one holds in both.
    for (x, at) in [(5.0, true), (6.0, false)] {
        let (worker, ctx) = context(if at { &mut a } else { &mut b });
        worker
            .set_pose(ctx, "cup".into(), pose(x, 0.0, 0.0))
            .expect("a pose");
        settle(&mut a, &mut b);
        assert_eq!(place(&mut a.0, &mut a.1, "cup")[0], x);
    }
}

#[test]
fn lost_samples_are_made_up_for() {
    let (mut a, mut b) = (start("arm.xml"), start_at("arm.xml", 1));
    settle(&mut a, &mut b);
    let (worker, ctx) = context(&mut a);
    worker
        .set_pose(ctx, "cup".into(), pose(1.0, 0.0, 0.0))
        .expect("a pose");
    let lost = samples(&mut a);
    assert_eq!(lost.len(), 1);
    // After a pause, the newest sample has the whole tree.
    a.1.advance(Duration::from_secs(1));
    let whole = samples(&mut a);
    assert!(whole[0].whole);
    deliver(&whole, &mut b);
    assert_eq!(place(&mut b.0, &mut b.1, "cup")[0], 1.0);
    // An old sample that comes late changes nothing.
    let (worker, ctx) = context(&mut b);
    worker
        .set_pose(ctx, "cup".into(), pose(2.0, 0.0, 0.0))
        .expect("a pose");
    deliver(&lost, &mut b);
    assert_eq!(place(&mut b.0, &mut b.1, "cup")[0], 2.0);
    // Without changes, nothing is published.
    a.1.advance(Duration::from_secs(1));
    assert_eq!(samples(&mut a), []);
    // At least each tenth sample is whole, so a late joiner finds one among the kept ones.
    let whole = (0..20).filter(|n| {
        let (worker, ctx) = context(&mut a);
        let there = pose(f64::from(*n), 1.0, 0.0);
        worker.set_pose(ctx, "cup".into(), there).expect("a pose");
        samples(&mut a)[0].whole
    });
    assert_eq!(whole.count(), 2);
}

/// A node that comes and goes often is removed in the other instance each time.
#[test]
fn removals_are_published_however_often_a_node_came_back() {
    let (mut a, mut b) = (start("arm.xml"), start_at("arm.xml", 1));
    settle(&mut a, &mut b);
    for _ in 0..5000 {
        let (worker, ctx) = context(&mut a);
        let element = r#"<transform id="ball"/>"#;
        let added = worker.add(ctx, "world".into(), element.into());
        added.expect("a node");
        worker.remove(ctx, "ball".into()).expect("a node");
    }
    let (worker, ctx) = context(&mut a);
    worker
        .add(ctx, "world".into(), r#"<transform id="ball"/>"#.into())
        .expect("a node");
    settle(&mut a, &mut b);
    let (worker, ctx) = context(&mut a);
    worker.remove(ctx, "ball".into()).expect("a node");
    assert_eq!(samples(&mut a)[0].removed.len(), 1);
}

/// A wrong stamp, a file of the user and a character that no file can have are refused.
#[test]
fn wrong_changes_are_refused() {
    let (mut a, mut b) = (start("arm.xml"), start_at("arm.xml", 1));
    settle(&mut a, &mut b);
    let there = place(&mut b.0, &mut b.1, "cup");
    for (x, count) in [(1.5, i64::MAX), (2.5, -1), (3.5, i64::MIN)] {
        let (worker, ctx) = context(&mut a);
        let other = pose(there[0] + x, 0.0, 0.0);
        worker.set_pose(ctx, "cup".into(), other).expect("a pose");
        let mut sample = samples(&mut a);
        for node in &mut sample[0].nodes {
            node.stamp.count = count;
        }
        deliver(&sample, &mut b);
        assert_eq!(place(&mut b.0, &mut b.1, "cup"), there);
    }
    // A later change of the instance is counted as before.
    let (worker, ctx) = context(&mut b);
    worker
        .set_pose(ctx, "cup".into(), pose(1.0, 0.0, 0.0))
        .expect("a pose");
    let count = samples(&mut b)[0].nodes[0].stamp.count;
    assert!((1..100).contains(&count), "{count}");
    let (worker, ctx) = context(&mut b);
    let scene = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../innermodel/scenes/house.xml"
    );
    let include = format!(r#"<include path="{scene}"/>"#);
    let refused = worker.add(ctx, "world".into(), include);
    let text = format!("{:?}", refused.expect_err("a file"));
    assert!(text.contains("includes no files"), "{text}");
}

/// A change of which one part is impossible changes nothing of its node.
#[test]
fn half_a_change_is_none() {
    let (mut a, mut b) = (start("arm.xml"), start_at("arm.xml", 1));
    settle(&mut a, &mut b);
    let (worker, ctx) = context(&mut a);
    worker
        .move_(ctx, "cup".into(), "tip".into(), false)
        .expect("a move");
    let mut sample = samples(&mut a);
    // The cup has children, and an imu may have none.
    sample[0].nodes[0].node.element = r#"<imu id="cup"/>"#.into();
    let (worker, ctx) = context(&mut b);
    let before = worker.get_node(ctx, "cup".into()).expect("a node");
    deliver(&sample, &mut b);
    let (worker, ctx) = context(&mut b);
    assert_eq!(worker.get_node(ctx, "cup".into()), Ok(before));
}
