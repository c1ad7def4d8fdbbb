//! Callers that ask for what cannot be.

use innermodel::kinds::{Plane, Shape, Solid};
use innermodel::{Error, InnerModel, Keep, Kind, NewNode, Point, Pose, Time};
use std::time::Duration;

fn at(x: f64) -> Pose {
    Pose::new(x, 0.0, 0.0, 0.0, 0.0, 0.0)
}

fn ball(radius: f64) -> Kind {
    Kind::Solid(Solid {
        shape: Shape::Sphere { radius },
        texture: String::new(),
        collide: true,
    })
}

/// Elements that a program adds are printed as a file that loads.
#[test]
fn kinds_that_no_file_can_say_are_not_added() {
    let model = InnerModel::new();
    let add = |kind: Kind| {
        model.change(Time::ZERO, |edit| {
            edit.add("root", NewNode::new("new", kind, Pose::default()))
        })
    };
    let plane = |width: f64| {
        Kind::Plane(Plane {
            texture: String::new(),
            picture: None,
            size: [width, 1.0, 1.0],
            repeat: 1,
            normal: [0.0, 0.0, -1.0],
            point: [0.0; 3],
            collide: true,
        })
    };
    for kind in [
        ball(f64::NAN),
        ball(-1.0),
        ball(f64::INFINITY),
        plane(f64::NAN),
        plane(f64::NEG_INFINITY),
    ] {
        let error = add(kind.clone()).expect_err("an impossible kind");
        assert!(
            matches!(error, Error::Impossible { .. }),
            "{kind:?}: {error}"
        );
        assert!(model.snapshot().is_empty());
    }
    add(plane(-1.0)).expect("a mirrored box, as RoboComp has it");
    InnerModel::parse(&model.snapshot().print()).expect("a file that loads");
}

/// A caller that drops the error of one operation gets nothing of that operation.
#[test]
fn an_operation_that_fails_changes_nothing() {
    let model = InnerModel::parse(
        r#"<innerModel><transform id="far" tx="1e308"><transform id="here"/></transform>
        <transform id="near" tx="-1e308"/></innerModel>"#,
    )
    .expect("a model");
    model
        .change(Time::ZERO, |edit| {
            let moved = edit.re_parent("here", "near");
            assert_eq!(moved, Err(Error::NotFinite("here".into())));
            let placed = edit.set_pose_in("here", "near", at(0.0));
            assert_eq!(placed, Err(Error::NotFinite("here".into())));
            let several = edit.attempt(|edit| {
                edit.move_to("here", "root")?;
                edit.remove("far")?;
                edit.add("root", NewNode::transform("more", at(1.0)))?;
                edit.set_joint("near", 1.0)
            });
            assert!(matches!(several, Err(Error::NotAJoint { .. })));
            edit.attempt(|edit| edit.set_pose("here", at(5.0)))
        })
        .expect("a change");
    let tree = model.snapshot();
    let here = tree.node("here").expect("a node");
    assert_eq!(here.parent().map(|parent| parent.id()), Some("far"));
    assert_eq!((tree.len(), here.pose()), (4, at(5.0)));
}

#[test]
fn the_past_has_a_begin_and_no_end() {
    let model = InnerModel::new();
    let ms = Duration::from_millis;
    assert!(model.at(Duration::ZERO).is_ok());
    for time in [100, 200, 300] {
        model
            .change(ms(time), |edit| {
                let id = format!("n{time}");
                edit.add("root", NewNode::transform(id, at(0.0)))
            })
            .expect("a change");
    }
    // The first version of the empty model holds from the start of the clock.
    assert!(model.at(ms(99)).expect("a time").version().is_empty());
    assert!(model.at(Duration::MAX).is_ok());
    for (versions, duration) in [(0, ms(0)), (usize::MAX, ms(0)), (0, Duration::MAX)] {
        model.keep(Keep {
            versions,
            duration,
            gap: Duration::MAX,
        });
        assert_eq!(
            model.at(ms(299)).map(drop),
            Err(Error::TooEarly {
                first: Some(ms(300))
            })
        );
        assert!(model.at(Duration::MAX).is_ok());
    }
    model.restore(ms(50), &model.snapshot());
    assert!(model.at(ms(49)).is_err());
    assert!(model.at(ms(50)).is_ok());
}

/// A moment of the past holds nodes that were removed since.
#[test]
fn removed_nodes_are_there_in_the_past_only() {
    let model = InnerModel::parse(
        r#"<innerModel><transform id="hand" tx="1"><transform id="cup" tx="2"/></transform>
        <transform id="tray" allowed="cup"/></innerModel>"#,
    )
    .expect("a model");
    let cup = model.snapshot().node("cup").expect("a node").node_id();
    let second = Duration::from_secs(1);
    model
        .change(second, |edit| edit.remove("hand"))
        .expect("a change");
    let moment = model.at(second / 2).expect("a time");
    let there = moment.transform("root", Point::origin(), cup);
    assert_eq!(there, Ok(Point::new(3.0, 0.0, 0.0)));
    let now = model.snapshot();
    assert_eq!(now.between("root", cup), Err(Error::Removed));
    let again = model
        .change(second * 2, |edit| {
            let hand = edit.add("root", NewNode::transform("hand", at(1.0)))?;
            edit.add(hand, NewNode::transform("cup", at(7.0)))
        })
        .expect("a change");
    // A new node with the same id at the same place is another one.
    assert_ne!(again, cup);
    assert_eq!(model.snapshot().between("root", cup), Err(Error::Removed));
}

#[test]
fn ten_thousand_levels_are_a_tree() {
    let model = InnerModel::new();
    let levels = 10_000;
    model
        .change(Time::ZERO, |edit| {
            let mut above = innermodel::NodeId::ROOT;
            for level in 0..levels {
                let node = NewNode::transform(format!("n{level}"), at(1.0));
                above = edit.add(above, node)?;
            }
            Ok::<_, Error>(())
        })
        .expect("a change");
    let before = model.snapshot();
    let tip = before.transform("root", Point::origin(), "n9999");
    assert_eq!(tip, Ok(Point::new(10_000.0, 0.0, 0.0)));
    assert_eq!(before.print().matches("<transform").count(), levels);
    let removed = model.change(Time::ZERO, |edit| edit.remove("n5000"));
    assert_eq!(removed, Ok(5000));
    assert_eq!(model.snapshot().since(&before).len(), 5000);
    let below = model.change(Time::ZERO, |edit| edit.move_to("n0", "n4999"));
    assert!(matches!(below, Err(Error::BelowItself { .. })));
}

/// Writers wait for each other: each change is made once, and none is lost.
#[test]
fn eight_writers_lose_no_change() {
    let model = InnerModel::parse(r#"<innerModel><joint id="count"/></innerModel>"#);
    let model = model.expect("a model");
    let first = model.snapshot().version();
    std::thread::scope(|scope| {
        for writer in 0..8 {
            let model = &model;
            scope.spawn(move || {
                for number in 0..200 {
                    let id = format!("w{writer}_{}", number % 10);
                    model
                        .change(Time::ZERO, |edit| {
                            let count = edit.snapshot().node("count")?.position();
                            edit.set_joint("count", count.unwrap_or_default() + 1.0)?;
                            if edit.snapshot().node(&id).is_ok() {
                                edit.remove(&id).map(drop)
                            } else {
                                let node = NewNode::transform(&id, at(1.0));
                                edit.add("count", node).map(drop)
                            }
                        })
                        .expect("a change");
                    let refused = model.change(Time::ZERO, |edit| {
                        edit.set_joint("count", -1.0)?;
                        edit.remove("nothing")
                    });
                    assert!(refused.is_err());
                }
            });
        }
    });
    let tree = model.snapshot();
    let count = tree.node("count").expect("a joint").position();
    assert_eq!(count, Some(1600.0));
    assert_eq!(tree.version() - first, 1600);
    // Each node came and went ten times.
    assert_eq!(tree.len(), 2);
}
