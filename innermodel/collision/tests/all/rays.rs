//! Rays equal their closed forms.

use crate::load;
use innermodel::{InnerModel, NodeId, Point, Time, Vector};
use innermodel_collision::Space;

const ROOM: &str = r#"<innerModel>
    <plane id="north" size="4000,3000,100" pz="2050"/>
    <plane id="south" size="4000,3000,100" pz="-2050"/>
    <plane id="east" nx="1" size="4000,3000,100" px="2050"/>
    <plane id="west" nx="1" size="4000,3000,100" px="-2050"/>
    <transform id="robot" tx="300" tz="-500" ry="0.4">
        <sphere id="shell" radius="200"/>
        <translation id="eye" ty="100"/>
    </transform>
</innerModel>"#;

/// How far it is to the walls of a room that is 4 m by 4 m.
fn expected(start: Point, way: Vector) -> f64 {
    let along = |at: f64, way: f64| {
        if way == 0.0 {
            f64::INFINITY
        } else {
            (2000.0 * way.signum() - at) / way
        }
    };
    along(start.x, way.x).min(along(start.z, way.z))
}

#[test]
fn a_laser_sees_the_walls_of_a_room() {
    let model = InnerModel::parse(ROOM).expect("a model");
    let tree = model.snapshot();
    let space = Space::new(&tree);
    let shell = tree.node("shell").expect("a node").node_id();
    let seen = |node: NodeId| node != shell;
    let to_root = tree.between("root", "eye").expect("two nodes");
    for step in 0..720 {
        let angle = f64::from(step) * std::f64::consts::TAU / 720.0;
        let way = Vector::new(angle.sin(), 0.0, angle.cos());
        let hit = space
            .ray("eye", Point::origin(), way * 7.0, 1e5, &seen)
            .expect("a node");
        let hit = hit.expect("a wall");
        let expected = expected(to_root.point(&Point::origin()), to_root.vector(&way));
        assert!((hit.distance - expected).abs() < 1e-6 * expected, "{angle}");
        assert!((hit.point - Point::from(way * hit.distance)).norm() < 1e-6);
        assert!(hit.normal.dot(&way) < 0.0);
    }
    // Its own shell hides the walls, a short range ends before them.
    let hit = space.ray("eye", Point::origin(), Vector::z(), 1e5, &|_| true);
    assert_eq!(
        hit.expect("a node").map(|hit| (hit.node, hit.distance)),
        Some((shell, 0.0))
    );
    assert_eq!(
        space.ray("eye", Point::origin(), Vector::z(), 500.0, &seen),
        Ok(None)
    );
    assert_eq!(
        space.ray("eye", Point::origin(), Vector::zeros(), 500.0, &seen),
        Ok(None)
    );
    let nan = Vector::new(f64::NAN, 0.0, 0.0);
    assert_eq!(
        space.ray("eye", Point::origin(), nan, 500.0, &seen),
        Ok(None)
    );
    assert!(
        space
            .ray("ear", Point::origin(), Vector::z(), 500.0, &seen)
            .is_err()
    );
}

#[test]
fn rays_follow_what_moves() {
    let model = load("house.xml");
    let mut space = Space::new(&model.snapshot());
    let down = |space: &Space| {
        let hit = space.ray(
            "lamp",
            Point::new(0.0, 3000.0, 0.0),
            -Vector::y(),
            1e5,
            &|_| true,
        );
        hit.expect("a node").map(|hit| hit.distance)
    };
    let before = down(&space).expect("the lamp");
    assert!((before - 1325.0).abs() < 1e-3, "{before}");
    model
        .change(Time::ZERO, |edit| edit.remove("lamp_shade"))
        .expect("a change");
    space.update(&model.snapshot());
    assert!(down(&space).is_some_and(|after| (after - 1500.0).abs() < 1e-3));
}
