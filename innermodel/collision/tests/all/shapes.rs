//! Distances and contacts of shapes equal their closed forms.

use innermodel::{Error, InnerModel, Point, Pose, Time};
use innermodel_collision::{BodyError, Space};
use innermodel_mesh::MeshError;

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::new(x, y, z, 0.0, 0.0, 0.0)
}

fn pair(a: &str, b: &str) -> InnerModel {
    let text = format!(
        r#"<innerModel><transform id="a">{a}</transform><transform id="b">{b}</transform></innerModel>"#
    );
    InnerModel::parse(&text).expect("a model")
}

fn distance(model: &InnerModel, pose: Pose) -> f64 {
    model
        .change(Time::ZERO, |edit| edit.set_pose("b", pose))
        .expect("a change");
    let space = Space::new(&model.snapshot());
    let near = space
        .distance("a", "b")
        .expect("two nodes")
        .expect("two bodies");
    assert_eq!(space.collide("a", "b"), Ok(near.distance == 0.0));
    if let Some((one, other)) = near.points {
        assert!(((one - other).norm() - near.distance).abs() < 1e-3);
    }
    near.distance
}

fn check(model: &InnerModel, pose: Pose, expected: f64) {
    let found = distance(model, pose);
    assert!((found - expected).abs() < 1e-3, "{found} is not {expected}");
}

#[test]
fn distances_of_shapes() {
    let sphere = r#"<sphere id="s" radius="100" collide="1"/>"#;
    let other = r#"<sphere id="t" radius="50" collide="1"/>"#;
    check(&pair(sphere, other), at(300.0, 400.0, 0.0), 350.0);
    check(&pair(sphere, other), at(0.0, 149.0, 0.0), 0.0);
    // The box of a plane is turned: its depth of 20 is along y.
    let board = r#"<plane id="p" ny="1" size="1000,600,20" collide="1"/>"#;
    check(&pair(board, other), at(0.0, 100.0, 0.0), 40.0);
    check(&pair(board, other), at(600.0, 0.0, 0.0), 50.0);
    check(&pair(board, other), at(0.0, 0.0, 400.0), 50.0);
    let cylinder = r#"<cylinder id="c" radius="100" length="400" collide="1"/>"#;
    check(&pair(cylinder, other), at(0.0, 300.0, 0.0), 50.0);
    check(&pair(cylinder, other), at(250.0, 100.0, 0.0), 100.0);
    // The tip of a cone is up.
    let cone = r#"<cone id="k" radius="100" length="400" collide="1"/>"#;
    check(&pair(cone, other), at(0.0, 300.0, 0.0), 50.0);
    check(&pair(cone, other), at(0.0, -300.0, 0.0), 50.0);
    check(&pair(cone, other), at(250.0, -200.0, 0.0), 100.0);
}

#[test]
fn a_mesh_is_mirrored_and_scaled() {
    let folder = tempfile::tempdir().expect("a folder");
    // A triangle at z = 1 of the file.
    let obj = "v -1 -1 1\nv 1 -1 1\nv 0 1 1\nf 1 2 3\n";
    std::fs::write(folder.path().join("t.obj"), obj).expect("a file");
    let text = r#"<innerModel><mesh id="m" file="t.obj" scale="100" tz="10" collide="1"/>
        <transform id="b"><sphere id="s" radius="10" collide="1"/></transform></innerModel>"#;
    let path = folder.path().join("world.xml");
    std::fs::write(&path, text).expect("a file");
    let model = InnerModel::load(&path, &innermodel::Folders::default()).expect("a model");
    let space = Space::new(&model.snapshot());
    let near = space
        .distance("m", "b")
        .expect("two nodes")
        .expect("two bodies");
    assert!((near.distance - 80.0).abs() < 1e-3, "{near:?}");
}

#[test]
fn contacts_have_a_depth() {
    let model = pair(
        r#"<sphere id="s" radius="100" collide="1"/>"#,
        r#"<sphere id="t" radius="100" collide="1"/>"#,
    );
    model
        .change(Time::ZERO, |edit| edit.set_pose("b", at(150.0, 0.0, 0.0)))
        .expect("a change");
    let space = Space::new(&model.snapshot());
    let contacts = space.contacts("a", "b").expect("two nodes");
    let [contact] = &contacts[..] else {
        panic!("{contacts:?}")
    };
    assert!(
        contact
            .depth
            .is_some_and(|depth| (depth - 50.0).abs() < 1e-3)
    );
    assert!(
        contact
            .point
            .is_some_and(|p| (p - Point::new(75.0, 0.0, 0.0)).norm() < 1e-3)
    );
    assert!(contact.normal.is_some_and(|n| (n.x - 1.0).abs() < 1e-6));
    assert_eq!(space.collisions(), contacts);
}

#[test]
fn what_has_no_body_is_reported() {
    let model = InnerModel::parse(
        r#"<innerModel><mesh id="m" file="/nowhere/a.obj"/><mesh id="n" file="b.osg"/>
            <transform id="t"/></innerModel>"#,
    )
    .expect("a model");
    let mut space = Space::new(&model.snapshot());
    assert!(space.is_empty());
    let problems = space.problems();
    assert!(matches!(
        problems[0].error,
        BodyError::Mesh(MeshError::Unreadable(_))
    ));
    assert!(matches!(
        problems[1].error,
        BodyError::Mesh(MeshError::NeedsConversion(..))
    ));
    assert_eq!(space.distance("t", "m"), Ok(None));
    assert!(matches!(
        space.collide("t", "x"),
        Err(Error::UnknownId { .. })
    ));
}
