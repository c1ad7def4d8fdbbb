//! Collisions in the scenes.

use crate::load;
use innermodel::{Error, Point, Pose, Time, Vector};
use innermodel_collision::Space;

#[test]
fn nothing_in_a_scene_collides_at_the_start() {
    for name in ["arm.xml", "house.xml", "robot.xml"] {
        let model = load(name);
        let tree = model.snapshot();
        let space = Space::new(&tree);
        let pairs: Vec<_> = space
            .collisions()
            .iter()
            .map(|c| (c.a, c.b))
            .map(|(a, b)| (tree.node(a).map(|n| n.id()), tree.node(b).map(|n| n.id())))
            .collect();
        assert!(pairs.is_empty(), "{name}: {pairs:?}");
    }
}

#[test]
fn a_robot_drives_into_a_wall() {
    let model = load("house.xml");
    let mut space = Space::new(&model.snapshot());
    let drive = |x: f64| {
        let pose = Pose::new(x, 0.0, 0.0, 0.0, 0.0, 0.0);
        model
            .change(Time::ZERO, |edit| edit.set_pose("robot", pose))
            .expect("a change");
    };
    assert_eq!(space.collide("robot", "walls"), Ok(false));
    drive(2800.0);
    let touched = space.update(&model.snapshot());
    // Only the bodies of the robot moved.
    assert_eq!(touched, 5);
    assert_eq!(space.collide("robot", "walls"), Ok(true));
    assert_eq!(space.collide("robot", "wall_east"), Ok(true));
    assert_eq!(space.collide("robot", "wall_west"), Ok(false));
    assert!(!space.collisions().is_empty());
    drive(0.0);
    space.update(&model.snapshot());
    assert_eq!(space.collide("robot", "walls"), Ok(false));
    assert!(space.collisions().is_empty());
}

/// The example of the page.
#[test]
fn questions_about_a_house() -> Result<(), Error> {
    let model = load("house.xml");
    let mut space = Space::new(&model.snapshot());
    let touches = space.collide("robot", "walls")?;
    let near = space.distance("robot", "walls")?;
    let hit = space.ray("laser", Point::origin(), Vector::z(), 10_000.0, &|_| true)?;
    space.update(&model.snapshot());
    assert!(!touches && near.is_some_and(|near| near.distance > 100.0));
    assert!(hit.is_some());
    Ok(())
}

/// A space that follows a model equals a new one.
#[test]
fn updates_equal_a_new_space() {
    let model = load("arm.xml");
    let mut space = Space::new(&model.snapshot());
    arbtest::arbtest(|u| {
        let joint = u.int_in_range(1..=7)?;
        let angle = f64::from(u.int_in_range(-200..=200)?) / 100.0;
        let step = u.int_in_range(0..=5)?;
        model
            .change(Time::ZERO, |edit| {
                edit.set_joint(&format!("joint_{joint}"), angle)?;
                let held = edit.snapshot().node("cup").is_ok();
                match step {
                    0 if held => edit.re_parent("cup", "tip"),
                    1 if held => edit.remove("cup_hat").map(|_| ()).or(Ok(())),
                    2 if held => edit.set_allowed("cup", vec!["tip".to_owned()]),
                    3 if held => edit.re_parent("cup", "table"),
                    4 => {
                        let mut kind = edit.snapshot().node("link_3")?.kind().clone();
                        if let innermodel::Kind::Solid(solid) = &mut kind {
                            solid.shape = innermodel::kinds::Shape::Sphere {
                                radius: angle.abs() * 50.0 + 1.0,
                            };
                        }
                        edit.set_kind("link_3", kind)
                    }
                    _ => Ok::<(), Error>(()),
                }
            })
            .expect("a change");
        let tree = model.snapshot();
        space.update(&tree);
        let new = Space::new(&tree);
        assert_eq!(space.len(), new.len());
        let pairs = |space: &Space| -> Vec<_> {
            space
                .collisions()
                .iter()
                .map(|c| (c.a.min(c.b), c.a.max(c.b)))
                .collect()
        };
        let (mut a, mut b) = (pairs(&space), pairs(&new));
        a.sort_unstable();
        b.sort_unstable();
        assert_eq!(a, b);
        let apart = |space: &Space| {
            let near = space
                .distance("table_top", "hand")
                .expect("two nodes")
                .expect("two bodies");
            near.distance
        };
        assert!((apart(&space) - apart(&new)).abs() < 1e-9);
        Ok(())
    })
    .budget_ms(1500);
}
