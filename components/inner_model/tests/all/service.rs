//! The interface `InnerModel`.

use crate::{place, pose, reason, start};
use inner_model_generated::interfaces::inner_model as calls;
use inner_model_generated::rc_inner_model::Reason;
use inner_model_generated::{Attribute, Context, Direction, InnerModel, JointPosition, Point};
use std::time::Duration;

#[test]
fn transforms_joints_and_history() {
    let (mut worker, mut test) = start("arm.xml");
    let home = place(&mut worker, &mut test, "tip");
    let before = test.now();
    test.advance(Duration::from_secs(1));
    let ctx: &mut Context = &mut test;
    let moved = worker
        .set_joint(ctx, "joint_2".into(), 9.0)
        .expect("a joint");
    assert_eq!(moved, 2.0);
    let all = [("joint_1", 0.5), ("joint_3", -99.0)].map(|(id, position)| JointPosition {
        id: id.into(),
        position,
    });
    let reached = worker.set_joints(ctx, all.into()).expect("two joints");
    assert_eq!(reached[1].position, -2.9);
    let wrong = vec![
        JointPosition {
            id: "joint_1".into(),
            position: 0.0,
        },
        JointPosition {
            id: "cup".into(),
            position: 0.0,
        },
    ];
    let refused = worker.set_joints(ctx, wrong);
    assert_eq!(reason(refused), Reason::WrongKind);
    let joints = worker.get_joints(ctx);
    let first = joints.iter().find(|joint| joint.id == "joint_1");
    assert_eq!(first.map(|joint| joint.position), Some(0.5));
    // The whole tip has moved, and was at home a second ago.
    let now = place(&mut worker, &mut test, "tip");
    assert_ne!(now, home);
    let ctx: &mut Context = &mut test;
    let then = before.as_nanos() as i64;
    let then = worker.get_pose_at(ctx, "root".into(), "tip".into(), then);
    let then = then.expect("a pose");
    assert!((then.x - home[0]).abs() < 1e-9 && (then.y - home[1]).abs() < 1e-9);

    let point = Point {
        x: 1.0,
        y: 2.0,
        z: 3.0,
    };
    let there = worker.transform(ctx, "root".into(), point.clone(), "cup".into());
    let there = there.expect("a point");
    assert!((there.x - 301.0).abs() < 1e-9 && (there.y - 702.0).abs() < 1e-9);
    let back = worker.transform(ctx, "cup".into(), there, "root".into());
    assert!((back.expect("a point").z - point.z).abs() < 1e-9);
    let up = Direction {
        x: 0.0,
        y: 1.0,
        z: 0.0,
    };
    let there = worker.transform_direction(ctx, "root".into(), up.clone(), "cup".into());
    assert_eq!(there.expect("a direction"), up);
    let matrix = worker.get_matrix(ctx, "root".into(), "cup".into());
    let rows = matrix.expect("a matrix").rows;
    assert_eq!(
        [rows[3], rows[7], rows[11], rows[15]],
        [300.0, 700.0, 100.0, 1.0]
    );
    let unknown = worker.get_pose(ctx, "root".into(), "cupp".into());
    match unknown {
        Err(calls::GetPoseError::InnerModelError(error)) => {
            assert_eq!(error.reason, Reason::UnknownNode);
            assert!(error.what.contains("did you mean `cup`"), "{}", error.what);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn nodes_are_added_changed_moved_and_removed() {
    let (mut worker, mut test) = start("arm.xml");
    let ctx: &mut Context = &mut test;
    let elements = r#"<transform id="tray" tx="10"><sphere id="ball" radius="20" collide="1"/></transform><imu id="imu"/>"#;
    worker
        .add(ctx, "world".into(), elements.into())
        .expect("two nodes");
    let again = worker.add(ctx, "world".into(), elements.into());
    assert_eq!(reason(again), Reason::DuplicateNode);
    let wrong = worker.add(
        ctx,
        "world".into(),
        r#"<sphere id="x" radius="0,0"/>"#.into(),
    );
    assert_eq!(reason(wrong), Reason::WrongText);
    let below = worker.get_subtree(ctx, "tray".into()).expect("two nodes");
    assert_eq!(below.len(), 2);
    assert_eq!(below[1].parent, "tray");
    assert_eq!(
        below[1].element,
        r#"<sphere id="ball" radius="20" collide="1"/>"#
    );
    let larger = r#"<sphere id="ball" tx="5" radius="30"/>"#;
    worker.set(ctx, larger.into()).expect("a change");
    let ball = worker.get_node(ctx, "ball".into()).expect("a node");
    assert_eq!(ball.element, larger);
    worker
        .move_(ctx, "ball".into(), "cup".into(), true)
        .expect("a move");
    assert_eq!(place(&mut worker, &mut test, "ball"), [15.0, 0.0, 0.0]);
    let ctx: &mut Context = &mut test;
    worker
        .set_pose(ctx, "ball".into(), pose(1.0, 0.0, 0.0))
        .expect("a pose");
    assert_eq!(place(&mut worker, &mut test, "ball")[0], 301.0);
    let ctx: &mut Context = &mut test;
    worker
        .set_pose_in(ctx, "ball".into(), "root".into(), pose(7.0, 8.0, 9.0))
        .expect("a pose");
    let attribute = Attribute {
        name: "colour".into(),
        type_: "string".into(),
        value: "red".into(),
    };
    for _ in 0..2 {
        worker
            .set_attribute(ctx, "ball".into(), attribute.clone())
            .expect("an attribute");
    }
    let ball = worker.get_node(ctx, "ball".into()).expect("a node");
    assert_eq!(ball.attributes, [attribute]);
    worker
        .remove_attribute(ctx, "ball".into(), "colour".into())
        .expect("to remove it");
    let gone = worker.remove_attribute(ctx, "ball".into(), "colour".into());
    assert_eq!(reason(gone), Reason::UnknownAttribute);
    let text = worker.print(ctx);
    assert!(
        text.contains(r#"<sphere id="ball" tx="-293" ty="-692" tz="-91" radius="30"/>"#),
        "{text}"
    );
    worker.remove(ctx, "tray".into()).expect("to remove it");
    let gone = worker.get_node(ctx, "tray".into());
    assert_eq!(reason(gone), Reason::UnknownNode);
    let root = worker.remove(ctx, "root".into());
    assert_eq!(reason(root), Reason::WrongKind);
}

#[test]
fn bodies_collide_and_rays_meet_them() {
    let (mut worker, mut test) = start("arm.xml");
    let ctx: &mut Context = &mut test;
    assert_eq!(worker.get_collisions(ctx), []);
    let touch = worker.collide(ctx, "cup".into(), "arm".into());
    assert!(!touch.expect("two nodes"));
    let near = worker.get_distance(ctx, "cup".into(), "table_top".into());
    assert!(near.expect("two bodies").distance < 1e-6);
    let start = Point {
        x: 300.0,
        y: 2000.0,
        z: 100.0,
    };
    let down = Direction {
        x: 0.0,
        y: -1.0,
        z: 0.0,
    };
    let mut cast = |ignored: &str, ctx: &mut Context| {
        worker
            .cast_ray(
                ctx,
                "root".into(),
                start.clone(),
                down.clone(),
                1e4,
                ignored.into(),
            )
            .expect("a ray")
    };
    let hit = cast("", ctx);
    assert_eq!(
        (hit[0].id.as_str(), hit[0].distance.round()),
        ("cup_hat", 1140.0)
    );
    let hit = cast("cup", ctx);
    assert_eq!(
        (hit[0].id.as_str(), hit[0].distance.round()),
        ("table_top", 1300.0)
    );
    let hit = cast("world", ctx);
    assert_eq!(hit, []);

    // The cup may be moved beside the arm, but not into it.
    test.params.refuse_collisions = true;
    let ctx: &mut Context = &mut test;
    inner_model_generated::Worker::params_changed(&mut worker, ctx, &[]).expect("a change");
    let into = worker.set_pose_in(ctx, "cup".into(), "arm".into(), pose(0.0, 200.0, 0.0));
    assert_eq!(reason(into), Reason::Collision);
    assert_eq!(place(&mut worker, &mut test, "cup"), [300.0, 700.0, 100.0]);
    let ctx: &mut Context = &mut test;
    worker
        .set_pose_in(ctx, "cup".into(), "arm".into(), pose(350.0, 0.0, 0.0))
        .expect("a free place");
    assert_eq!(worker.get_collisions(ctx), []);
}
