//! Robots in URDF are read as `urdf-rs` reads them: the same links at the same places, with joints
//! that move them alike.

use innermodel::{Error, Folders, InnerModel, Time, frames};
use innermodel_exchange::urdf;
use k::nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use rc_diagnostics::{Format, SourceMap, render};
use std::collections::HashMap;
use std::path::Path;
use urdf_rs::JointType;

/// Fixed, turning and sliding joints, with axes along and across those of their frames.
const ARM: &str = r#"<robot name="arm">
    <link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
    <link name="column"/><link name="boom"/><link name="slider"/><link name="wheel"/><link name="tool"/>
    <joint name="turn" type="continuous"><parent link="base"/><child link="column"/>
        <origin xyz="0.1 -0.2 0.3" rpy="0.1 0.2 0.3"/><axis xyz="0 0 1"/></joint>
    <joint name="lift" type="revolute"><parent link="column"/><child link="boom"/>
        <origin xyz="0 0 1" rpy="-1.2 0.4 2.9"/><axis xyz="0.6 -0.48 0.64"/>
        <limit lower="-3" upper="3" effort="1" velocity="2"/></joint>
    <joint name="reach" type="prismatic"><parent link="boom"/><child link="slider"/>
        <origin xyz="0.5 0 0"/><axis xyz="0 -1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
    <joint name="roll" type="continuous"><parent link="slider"/><child link="wheel"/>
        <origin rpy="3.141592653589793 0 1.5707963267948966"/></joint>
    <joint name="flange" type="fixed"><parent link="wheel"/><child link="tool"/>
        <origin xyz="0 0 0.05" rpy="0 1.5707963267948966 0"/></joint>
</robot>"#;

fn isometry(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let ([x, y, z], [roll, pitch, yaw]) = (pose.xyz.0, pose.rpy.0);
    Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

/// Where the links are, as `urdf-rs` has read them.
fn theirs(
    robot: &urdf_rs::Robot,
    positions: &HashMap<String, f64>,
) -> HashMap<String, Isometry3<f64>> {
    let is_below = |name: &str| robot.joints.iter().any(|joint| joint.child.link == name);
    let mut places: HashMap<String, Isometry3<f64>> = HashMap::new();
    for link in robot.links.iter().filter(|link| !is_below(&link.name)) {
        places.insert(link.name.clone(), Isometry3::identity());
    }
    while places.len() < robot.links.len() {
        let before = places.len();
        for joint in &robot.joints {
            let Some(above) = places.get(&joint.parent.link).copied() else {
                continue;
            };
            let position = positions.get(&joint.name).copied().unwrap_or(0.0);
            let axis = Vector3::from(joint.axis.xyz.0);
            let moved = match joint.joint_type {
                JointType::Revolute | JointType::Continuous => Isometry3::from_parts(
                    Translation3::identity(),
                    UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), position),
                ),
                JointType::Prismatic => {
                    Isometry3::translation(axis.x * position, axis.y * position, axis.z * position)
                }
                _ => Isometry3::identity(),
            };
            let there = above * isometry(&joint.origin) * moved;
            places.insert(joint.child.link.clone(), there);
        }
        assert!(places.len() > before, "a tree");
    }
    places
}

/// Compares all links of a robot. Returns how many they are.
fn compare(text: &str) -> usize {
    let robot = urdf_rs::read_from_string(text).expect("a robot");
    let positions: HashMap<String, f64> = robot
        .joints
        .iter()
        .zip(1..)
        .filter(|(joint, _)| joint.joint_type != JointType::Fixed)
        .map(|(joint, number)| {
            let wanted = f64::from(number) * 0.37 % 1.1 - 0.4;
            let limit = &joint.limit;
            let has_limits = joint.joint_type != JointType::Continuous;
            let position = if has_limits {
                wanted.clamp(limit.lower, limit.upper)
            } else {
                wanted
            };
            (joint.name.clone(), position)
        })
        .collect();
    let places = theirs(&robot, &positions);

    let mut sources = SourceMap::new();
    let source = sources.add("robot.urdf", text);
    let (document, found) = urdf::read(&sources, source);
    assert!(
        !found.has_errors(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    let model = InnerModel::from_document(&document).expect("a tree");
    model
        .change(Time::ZERO, |edit| {
            for (joint, position) in &positions {
                let slides = edit.snapshot().node(joint)?.kind().tag() == "prismaticJoint";
                edit.set_joint(joint, position * if slides { 1000.0 } else { 1.0 })?;
            }
            Ok::<_, Error>(())
        })
        .expect("the joints");
    let tree = model.snapshot();
    for (link, expected) in &places {
        let ours = frames::to_ros(&tree.between("root", link.as_str()).expect("a link"));
        let (t, q) = (ours.translation.vector, ours.rotation);
        let apart = (Vector3::new(t.x, t.y, t.z) - expected.translation.vector).norm();
        assert!(
            apart < 1e-9,
            "{link}: {t:?}, not {:?}",
            expected.translation
        );
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for axis in [x, y, z] {
            let turned = q * innermodel::Vector::from(axis);
            let wanted = expected.rotation * Vector3::from(axis);
            let apart = (Vector3::new(turned.x, turned.y, turned.z) - wanted).norm();
            assert!(apart < 1e-9, "{link}: {turned:?}, not {wanted:?}");
        }
    }
    places.len()
}

#[test]
fn a_robot_is_read_as_urdf_rs_reads_it() {
    assert_eq!(compare(ARM), 6);
}

/// Our exports are robots for `urdf-rs`, too.
#[test]
fn exported_scenes_are_read_as_urdf_rs_reads_them() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../innermodel/scenes");
    for name in ["arm.xml", "robot.xml", "house.xml"] {
        let (document, _) =
            innermodel::read(&scenes.join(name), &Folders::default()).expect("a scene");
        let (text, _) = urdf::write(&document, "scene");
        assert!(compare(&text) > 10, "{name}");
    }
}
