//! The tree at earlier times.

use innermodel::{Error, InnerModel, Keep, Point, Pose, Transform};
use std::time::Duration;

fn near(a: Point, b: [f64; 3]) {
    assert!((a - Point::from(b)).norm() < 1e-9, "{a} is not {b:?}");
}

#[test]
fn where_the_hand_was() {
    let model = InnerModel::parse(
        r#"<innerModel>
            <joint id="a" axis="z"><translation id="hand" tx="100"/></joint>
            <transform id="box"/>
        </innerModel>"#,
    )
    .expect("a model");
    let ms = Duration::from_millis;
    let set = |time: u64, q: f64| model.change(ms(time), |edit| edit.set_joint("a", q));
    let push = |time: u64, x: f64| {
        model.change(ms(time), |edit| {
            edit.set_pose("box", Pose::new(x, 0.0, 0.0, 0.0, 0.0, 0.0))
        })
    };
    set(1000, 0.0).expect("a change");
    // Changes of another node in between do not disturb the hand.
    push(1100, 0.0).expect("a change");
    push(1200, 10.0).expect("a change");
    set(1400, 4.0).expect("a change");
    push(1500, 20.0).expect("a change");
    let hand = |time: u64| {
        let moment = model.at(ms(time)).expect("a time of the history");
        moment
            .transform("root", Point::origin(), "hand")
            .expect("a node")
    };
    let angle = |q: f64| [100.0 * q.cos(), 100.0 * q.sin(), 0.0];
    for (time, q) in [
        (1000, 0.0),
        (1050, 0.5),
        (1150, 1.5),
        (1250, 2.5),
        (1400, 4.0),
        (1499, 4.0),
    ] {
        near(hand(time), angle(q));
    }
    let moment = model.at(ms(1350)).expect("a time");
    near(
        moment
            .transform("root", Point::origin(), "box")
            .expect("a node"),
        [15.0, 0.0, 0.0],
    );
    assert_eq!(
        moment.version().node("a").expect("a node").position(),
        Some(0.0)
    );
    // Between changes that are far from each other it stood still.
    set(5000, 0.0).expect("a change");
    near(hand(4999), angle(4.0));
    // Old versions are dropped.
    model.keep(Keep {
        versions: 3,
        ..Keep::default()
    });
    assert!(matches!(
        model.at(ms(1100)),
        Err(Error::TooEarly { first: Some(_) })
    ));
    // The clock was set back.
    set(1450, 1.0).expect("a change");
    near(hand(6000), angle(1.0));
    let poses = Transform::identity().between(
        &Transform::of(&Pose::new(2.0, 0.0, 0.0, 0.0, 1.0, 0.0)),
        0.5,
    );
    assert!((poses.pose().rotation[1] - 0.5).abs() < 1e-12);
}
