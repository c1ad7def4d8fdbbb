//! Callers with arguments that no robot has.

use crate::{pose, reason, start};
use inner_model_generated::rc_inner_model::Reason;
use inner_model_generated::{Context, Direction, InnerModel, Point, Worker};

fn point(x: f64) -> Point {
    Point { x, y: 0.0, z: 0.0 }
}

fn direction(x: f64) -> Direction {
    Direction { x, y: 0.0, z: 0.0 }
}

#[test]
fn numbers_that_are_none_are_refused() {
    let (mut worker, mut test) = start("arm.xml");
    let ctx: &mut Context = &mut test;
    let (root, cup) = (|| "root".to_owned(), || "cup".to_owned());
    let before = worker.print(ctx);
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let found = worker.transform(ctx, root(), point(wrong), cup());
        assert_eq!(reason(found), Reason::WrongValue);
        let found = worker.transform_direction(ctx, root(), direction(wrong), cup());
        assert_eq!(reason(found), Reason::WrongValue);
        let found = worker.set_pose(ctx, cup(), pose(wrong, 0.0, 0.0));
        assert_eq!(reason(found), Reason::WrongValue);
        let found = worker.set_pose_in(ctx, cup(), root(), pose(wrong, 0.0, 0.0));
        assert_eq!(reason(found), Reason::WrongValue);
        let found = worker.set_joint(ctx, "joint_1".into(), wrong);
        assert_eq!(reason(found), Reason::WrongValue);
    }
    for (start, way, range) in [
        (f64::NAN, 1.0, 1.0),
        (0.0, f64::INFINITY, 1.0),
        (0.0, 0.0, 1.0),
        (0.0, 1.0, f64::NAN),
        (0.0, 1.0, -1.0),
    ] {
        let found = worker.cast_ray(
            ctx,
            root(),
            point(start),
            direction(way),
            range,
            String::new(),
        );
        assert_eq!(reason(found), Reason::WrongValue);
    }
    for time in [i64::MIN, -1, 0] {
        let found = worker.get_pose_at(ctx, root(), cup(), time);
        // The clock of the test begins at 0, where the file was read.
        assert!(found.is_ok(), "{time}: {found:?}");
    }
    assert!(worker.get_pose_at(ctx, root(), cup(), i64::MAX).is_ok());
    for elements in [
        "",
        "<",
        "<a>",
        "text",
        "</innerModel>",
        "<transform/><",
        "<!DOCTYPE a>",
    ] {
        let found = worker.add(ctx, root(), elements.into());
        assert_eq!(reason(found), Reason::WrongText, "{elements}");
        let found = worker.set(ctx, elements.into());
        assert_eq!(reason(found), Reason::WrongText, "{elements}");
    }
    assert_eq!(worker.print(ctx), before);
}

/// Bodies whose places are beyond all numbers meet nothing, and the component goes on.
#[test]
fn what_is_too_far_away_stops_nothing() {
    let (mut worker, mut test) = start("arm.xml");
    let ctx: &mut Context = &mut test;
    let far = r#"<transform id="a" tx="1e308"><transform id="b" tx="1e308" ry="1">
        <sphere id="far" radius="10" collide="1"/></transform></transform>
        <plane id="great" size="1e308,1e308,1e308" collide="1"/>
        <cylinder id="sharp" radius="1e-300" length="1e300" collide="1"/>"#;
    worker
        .add(ctx, "root".into(), far.into())
        .expect("three bodies");
    for (a, b) in [
        ("far", "great"),
        ("great", "sharp"),
        ("arm", "far"),
        ("arm", "great"),
    ] {
        let touch = worker.collide(ctx, a.into(), b.into());
        assert_eq!(touch, Ok(false), "{a} {b}");
        worker
            .get_distance(ctx, a.into(), b.into())
            .expect("two nodes");
    }
    worker.get_collisions(ctx);
    for from in ["root", "a", "b", "far"] {
        for range in [1e4, f64::INFINITY] {
            let (start, way) = (point(1e308), direction(-1.0));
            worker
                .cast_ray(ctx, from.into(), start, way, range, String::new())
                .expect("a ray");
        }
    }
    worker.compute(ctx).expect("a period");
    // It comes back.
    worker
        .set_pose(ctx, "a".into(), pose(-1e308, 0.0, 0.0))
        .expect("a pose");
    let hit = worker.cast_ray(
        ctx,
        "root".into(),
        point(-100.0),
        direction(1.0),
        1e4,
        "world".into(),
    );
    assert_eq!(hit.expect("a ray")[0].id, "far");
}
