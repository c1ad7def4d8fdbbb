//! Changes and versions.

use crate::load;
use innermodel::kinds::{self, Solid};
use innermodel::{
    Change, Clamped, Error, Folders, InnerModel, Kind, NewNode, NodeId, Point, Pose, Time,
};
use std::f64::consts::FRAC_PI_2;

fn frame(id: &str, x: f64) -> NewNode {
    NewNode::transform(id, Pose::new(x, 0.0, 0.0, 0.0, 0.0, 0.0))
}

fn change<T>(
    model: &InnerModel,
    make: impl FnOnce(&mut innermodel::Edit) -> Result<T, Error>,
) -> Result<T, Error> {
    model.change(Time::ZERO, make)
}

fn at(model: &InnerModel, to: &str, from: &str) -> Point {
    let tree = model.snapshot();
    tree.transform(to, Point::origin(), from)
        .expect("two nodes")
}

fn near(a: Point, b: [f64; 3]) {
    assert!((a - Point::from(b)).norm() < 1e-9, "{a} is not {b:?}");
}

#[test]
fn a_joint_keeps_its_translation_and_its_limits() {
    let model = InnerModel::parse(
        r#"<innerModel>
            <joint id="a" tx="100" ty="10" axis="z" min="-1" max="2">
                <translation id="hand" tx="50"/>
                <prismaticJoint id="slide" axis="y" min="0" max="30" offset="5" position="99">
                    <translation id="tool"/>
                </prismaticJoint>
            </joint>
            <joint id="late" min="0.5" max="1"/>
            <translation id="fixed"/>
        </innerModel>"#,
    )
    .expect("a model");
    let position = |id: &str| model.snapshot().node(id).expect("a node").position();
    assert_eq!((position("a"), position("slide")), (Some(0.0), Some(30.0)));
    assert_eq!((position("late"), position("fixed")), (Some(0.5), None));
    near(at(&model, "root", "hand"), [150.0, 10.0, 0.0]);
    near(at(&model, "a", "tool"), [0.0, 35.0, 0.0]);
    let set = |id: &str, q: f64| change(&model, |edit| edit.set_joint(id, q));
    assert_eq!(set("a", FRAC_PI_2), Ok(Clamped::No));
    near(at(&model, "root", "hand"), [100.0, 60.0, 0.0]);
    assert_eq!(set("a", 9.0), Ok(Clamped::ToMax(2.0)));
    assert_eq!(
        (set("a", -9.0), position("a")),
        (Ok(Clamped::ToMin(-1.0)), Some(-1.0))
    );
    assert_eq!(set("slide", 31.0), Ok(Clamped::ToMax(30.0)));
    assert_eq!(set("a", f64::NAN), Err(Error::NotFinite("a".to_owned())));
    assert!(matches!(
        set("fixed", 1.0),
        Err(Error::NotAJoint {
            tag: "translation",
            ..
        })
    ));
    // A change of a limit moves a joint that would be beyond it.
    let Kind::Joint(mut joint) = model.snapshot().node("a").expect("a node").kind().clone() else {
        panic!("a joint");
    };
    joint.min = 0.25;
    change(&model, |edit| edit.set_kind("a", Kind::Joint(joint))).expect("a change");
    assert_eq!(position("a"), Some(0.25));
}

#[test]
fn nodes_come_and_go() {
    let model = InnerModel::new();
    let (a, b) = change(&model, |edit| {
        let a = edit.add("root", frame("a", 1.0))?;
        let b = edit.add(a, frame("b", 2.0))?;
        edit.add("b", frame("c", 3.0))?;
        Ok((a, b))
    })
    .expect("a change");
    let before = model.snapshot();
    near(at(&model, "root", "c"), [6.0, 0.0, 0.0]);
    assert_eq!(change(&model, |edit| edit.remove(b)), Ok(2));
    let tree = model.snapshot();
    assert_eq!(tree.len(), 2);
    assert_eq!(tree.node(b).err(), Some(Error::Removed));
    assert_eq!(
        before
            .node("c")
            .expect("the past stays")
            .parent()
            .map(|p| p.id()),
        Some("b")
    );
    // The place is used again, and the old name does not name the new node.
    let new = change(&model, |edit| edit.add("a", frame("d", 5.0))).expect("a change");
    assert_ne!(new, b);
    assert_eq!(model.snapshot().node(b).err(), Some(Error::Removed));
    assert_eq!(
        model.snapshot().node(a).expect("a node").children().count(),
        1
    );
    assert_eq!(
        change(&model, |edit| edit.remove(NodeId::ROOT)),
        Err(Error::Root)
    );
    assert_eq!(
        change(&model, |edit| edit.add("a", frame("d", 0.0))),
        Err(Error::DuplicateId("d".to_owned()))
    );
    assert_eq!(
        change(&model, |edit| edit.add("a", frame("", 0.0))),
        Err(Error::EmptyId)
    );
}

#[test]
fn errors_name_the_nearest_id_and_change_nothing() {
    let model = load("robot.xml");
    let before = model.snapshot();
    let result = change(&model, |edit| {
        edit.set_joint("pan", 0.5)?;
        edit.set_joint("tild", 0.5)
    });
    assert_eq!(
        result.map_err(|error| error.to_string()),
        Err("no node has the id `tild`, did you mean `tilt`?".to_owned())
    );
    assert_eq!(model.snapshot().version(), before.version());
    assert_eq!(
        model.snapshot().node("pan").expect("a node").position(),
        Some(0.0)
    );
    let error = change(&model, |edit| edit.add("laser", frame("x", 0.0)));
    assert_eq!(
        error.map_err(|error| error.to_string()),
        Err("`laser` is a laser, which cannot have children".to_owned())
    );
    let error = change(&model, |edit| edit.set_pose("imu", Pose::default()));
    assert!(matches!(error, Err(Error::NoPose { tag: "imu", .. })));
    let error = change(&model, |edit| {
        edit.set_pose("mast", Pose::new(f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0))
    });
    assert_eq!(error, Err(Error::NotFinite("mast".to_owned())));
    let error = change(&model, |edit| edit.move_to("mast", "eye"));
    assert!(matches!(error, Err(Error::BelowItself { .. })));
    let error = change(&model, |edit| {
        edit.set_pose_in("mast", "eye", Pose::default())
    });
    assert!(matches!(error, Err(Error::BelowItself { .. })));
    let ball = Kind::Solid(Solid {
        shape: kinds::Shape::Sphere { radius: 1.0 },
        texture: String::new(),
        collide: false,
    });
    let error = change(&model, |edit| edit.set_kind("mast", ball));
    assert!(matches!(
        error,
        Err(Error::HasChildren { tag: "sphere", .. })
    ));
    let foreign = model
        .snapshot()
        .node("\u{1b}[31m")
        .err()
        .map(|error| error.to_string());
    assert!(foreign.is_some_and(|text| !text.contains('\u{1b}')));
}

#[test]
fn a_grasped_cup_follows_the_hand() {
    let model = load("arm.xml");
    let cup = at(&model, "root", "cup");
    change(&model, |edit| {
        edit.set_joint("joint_2", 0.7)?;
        edit.re_parent("cup", "tip")
    })
    .expect("a change");
    near(at(&model, "root", "cup"), cup.coords.into());
    let held = at(&model, "tip", "cup");
    change(&model, |edit| edit.set_joint("joint_1", 1.0)).expect("a change");
    near(at(&model, "tip", "cup"), held.coords.into());
    assert!((at(&model, "root", "cup") - cup).norm() > 10.0);
    change(&model, |edit| edit.move_to("cup", "table")).expect("a change");
    near(
        at(&model, "tip", "cup"),
        at(&model, "tip", "cup").coords.into(),
    );
    // A joint that is moved keeps its angle and gets another pose.
    let tip = at(&model, "root", "tip");
    change(&model, |edit| edit.re_parent("joint_4", "world")).expect("a change");
    near(at(&model, "root", "tip"), tip.coords.into());
    change(&model, |edit| {
        edit.set_pose_in("cup", "tip", Pose::default())
    })
    .expect("a change");
    near(at(&model, "tip", "cup"), [0.0; 3]);
}

/// The example of the page.
#[test]
fn a_hand_takes_a_cup() -> Result<(), Box<dyn std::error::Error>> {
    let path = crate::scene("arm.xml");
    let now = Time::from_secs(1);
    let model = InnerModel::load(&path, &Folders::default())?;
    model.change(now, |edit| {
        edit.set_joint("joint_2", 0.7)?;
        edit.re_parent("cup", "tip")
    })?;
    let tree = model.snapshot();
    let cup = tree.transform("world", Point::origin(), "cup")?;
    near(cup, [300.0, 700.0, 100.0]);
    Ok(())
}

#[test]
fn attributes_are_added_set_and_removed() {
    let model = load("arm.xml");
    let add = |name: &str| {
        change(&model, |edit| {
            edit.add_attribute("cup", name, "string", "full")
        })
    };
    add("content").expect("a change");
    assert!(matches!(
        add("content"),
        Err(Error::DuplicateAttribute { .. })
    ));
    change(&model, |edit| {
        edit.set_attribute("cup", "content", "string", "empty")
    })
    .expect("a change");
    let tree = model.snapshot();
    let cup = tree.node("cup").expect("a node");
    assert_eq!(cup.attribute("content"), Ok(("string", "empty")));
    assert_eq!(cup.attributes().count(), 1);
    let error = change(&model, |edit| edit.remove_attribute("cup", "contents"));
    assert_eq!(
        error.map_err(|error| error.to_string()),
        Err("`cup` has no attribute `contents`, did you mean `content`?".to_owned())
    );
    change(&model, |edit| edit.remove_attribute("cup", "content")).expect("a change");
    assert!(matches!(
        change(&model, |edit| edit.set_attribute("cup", "content", "", "")),
        Err(Error::UnknownAttribute { nearest: None, .. })
    ));
}

#[test]
fn differences_between_versions() {
    let model = load("house.xml");
    let before = model.snapshot();
    assert_eq!(before.since(&before), []);
    change(&model, |edit| {
        edit.set_joint("pan", 0.2)?;
        edit.remove("bowl")?;
        edit.add("dining_table", frame("plate", 1.0))?;
        edit.move_to("lamp", "world")?;
        edit.add_attribute("bed", "made", "bool", "true")?;
        edit.set_pose("watcher", Pose::default())
    })
    .expect("a change");
    let now = model.snapshot();
    let id = |node: &NodeId| now.node(*node).expect("a node").id().to_owned();
    let mut seen: Vec<String> = now
        .since(&before)
        .iter()
        .map(|change| match change {
            Change::Removed { id, .. } => format!("removed {id}"),
            Change::Added(node) => format!("added {}", id(node)),
            Change::Parent(node) => format!("parent {}", id(node)),
            Change::Moved(node) => format!("moved {}", id(node)),
            Change::Data(node) => format!("data {}", id(node)),
        })
        .collect();
    seen.sort();
    assert_eq!(
        seen,
        [
            "added plate",
            "data bed",
            "moved pan",
            "moved watcher",
            "parent lamp",
            "removed bowl",
            "removed bowl_body",
        ]
    );
    let back = before.since(&now);
    assert_eq!(back.len(), seen.len());
}

#[test]
fn a_changed_tree_prints_as_a_file() {
    let model = load("house.xml");
    let text = model.snapshot().print();
    let again = InnerModel::parse(&text).expect("a model");
    assert_eq!(again.snapshot().len(), model.snapshot().len());
    change(&model, |edit| {
        edit.set_pose("eye", Pose::new(0.0, 0.0, 1.0, 0.5, 0.0, 0.0))?;
        edit.remove("furniture")?;
        edit.add("world", frame("new", 7.0))
    })
    .expect("a change");
    let tree = model.snapshot();
    let again = InnerModel::parse(&tree.print())
        .expect("a model")
        .snapshot();
    let ids: Vec<&str> = tree.nodes().map(|node| node.id()).collect();
    assert_eq!(ids, again.nodes().map(|node| node.id()).collect::<Vec<_>>());
    for id in ids {
        let (a, b) = (tree.between("root", id), again.between("root", id));
        let (a, b) = (a.expect("a node").matrix(), b.expect("a node").matrix());
        assert!((a - b).amax() < 1e-9, "{id}");
    }
}

#[test]
fn forks_and_restored_versions_are_independent() {
    let model = load("arm.xml");
    let start = model.snapshot();
    let fork = model.fork();
    change(&fork, |edit| edit.set_joint("joint_2", 1.0)).expect("a change");
    change(&model, |edit| edit.set_joint("joint_2", -1.0)).expect("a change");
    let (a, b) = (at(&model, "root", "tip"), at(&fork, "root", "tip"));
    assert!((a - b).norm() > 100.0);
    assert!((at(&model, "root", "tip") - a).norm() < 1e-12);
    model.restore(Time::ZERO, &start);
    let tip = start
        .transform("root", Point::origin(), "tip")
        .expect("a node");
    assert!((at(&model, "root", "tip") - tip).norm() < 1e-12);
    assert!(model.snapshot().version() > start.version());
}

#[test]
fn a_new_joint_is_within_its_limits() {
    let model = InnerModel::new();
    let joint = |id: &str, min: f64, max: f64| {
        let kind = kinds::Joint {
            axis: kinds::Axis::Z,
            min,
            max,
            home: 0.0,
            max_speed: 0.0,
            encoder: kinds::Encoder::default(),
            port: 0,
            low: [0.0; 3],
            high: [0.0; 3],
        };
        NewNode::new(id, Kind::Joint(kind), Pose::default())
    };
    let wanted = [
        ("a", 0.5, 1.0, 0.5),
        ("b", -2.0, -1.0, -1.0),
        ("c", -1.0, 1.0, 0.0),
    ];
    for (id, min, max, stands) in wanted {
        change(&model, |edit| edit.add("root", joint(id, min, max))).expect("a joint");
        let tree = model.snapshot();
        assert_eq!(tree.node(id).expect("a joint").position(), Some(stands));
    }
    let far = f64::INFINITY;
    for (min, max) in [(far, far), (-far, -far)] {
        let added = change(&model, |edit| edit.add("root", joint("d", min, max)));
        assert_eq!(added, Err(Error::NotFinite("d".to_owned())));
    }
    let added = change(&model, |edit| edit.add("root", frame("d\u{1}", 0.0)));
    assert_eq!(added, Err(Error::Character("d\\u{1}".to_owned())));
}

/// A kind is refused with the words that a file gets.
#[test]
fn the_numbers_of_a_kind_are_checked() {
    use innermodel::kinds::Shape;
    let model = InnerModel::parse(
        r#"<innerModel><sphere id="ball" radius="1"/><camera id="eye" width="8" height="6" focal="5"/>
           <transform id="box"/><differentialrobot id="base"/></innerModel>"#,
    )
    .expect("a model");
    let ball = |radius| {
        Kind::Solid(Solid {
            shape: Shape::Sphere { radius },
            texture: String::new(),
            collide: true,
        })
    };
    let of = |id: &str| model.snapshot().node(id).expect("a node").kind().clone();
    let (Kind::Camera(mut eye), Kind::Transform(mut heavy)) = (of("eye"), of("box")) else {
        panic!("a camera and a transform");
    };
    eye.camera.width = 8.5;
    heavy.mass = f64::NAN;
    let Kind::Robot(mut robot) = of("base") else {
        panic!("a robot");
    };
    robot.slip = 2.0;
    let cases = [
        (
            "ball",
            ball(-1.0),
            "`ball` is not possible: `radius` must be greater than 0, found `-1`",
        ),
        (
            "ball",
            ball(f64::INFINITY),
            "`ball` is not possible: expected a number for `radius`, found `inf`",
        ),
        (
            "eye",
            Kind::Camera(eye),
            "`eye` is not possible: `width` must be a whole number from 1, found `8.5`",
        ),
        (
            "box",
            Kind::Transform(heavy),
            "`box` is not possible: expected a number for `mass`, found `NaN`",
        ),
        (
            "base",
            Kind::Robot(robot),
            "`base` is not possible: `slip` must be from 0 to 1, found `2`",
        ),
    ];
    for (id, kind, expected) in cases {
        let error = change(&model, |edit| edit.set_kind(id, kind)).expect_err(expected);
        assert_eq!(error.to_string(), expected);
    }
    change(&model, |edit| edit.set_kind("ball", ball(2.0))).expect("a ball");
}

#[test]
fn the_id_of_a_new_node_names_nothing_in_earlier_versions() {
    let model = InnerModel::new();
    let add = |id: &str| change(&model, |edit| edit.add("root", frame(id, 1.0))).expect("a node");
    let first = add("first");
    let with_first = model.snapshot();
    change(&model, |edit| edit.remove(first)).expect("a change");
    let free = model.snapshot();
    let second = add("second");
    let with_second = model.snapshot();
    assert_ne!(first, second);
    for (tree, here, gone) in [
        (&with_first, Some(first), second),
        (&with_second, Some(second), first),
        (&free, None, first),
        (&free, None, second),
    ] {
        assert!(here.is_none_or(|node| tree.node(node).is_ok()));
        assert_eq!(
            tree.node(gone).map(|node| node.node_id()),
            Err(Error::Removed)
        );
    }
}
