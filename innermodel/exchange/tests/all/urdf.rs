//! URDF, both ways.

use crate::{imported, model, scene};
use innermodel::{Point, Time, frames};
use innermodel_exchange::urdf;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// A document that was exported and read back moves as before.
fn same_after_both_ways(name: &str, joints: &[(&str, f64)], ids: &[&str]) {
    let before = scene(name);
    let (text, _) = urdf::write(&before, "robot");
    let (after, found) = imported(&text);
    assert!(!found.contains("error"), "{found}\n{text}");
    let (before, after) = (model(&before), model(&after));
    for tree in [&before, &after] {
        tree.change(Time::ZERO, |edit| {
            for (joint, position) in joints {
                edit.set_joint(*joint, *position)?;
            }
            Ok::<_, innermodel::Error>(())
        })
        .expect("joints");
    }
    for id in ids {
        for corner in [Point::origin(), Point::new(10.0, 20.0, 30.0)] {
            let place = |tree: &innermodel::InnerModel| {
                tree.snapshot()
                    .transform("root", corner, *id)
                    .expect("a point")
            };
            let (a, b) = (place(&before), place(&after));
            assert!((a - b).norm() < 1e-6, "{id}: {a} {b}");
        }
    }
}

#[test]
fn the_arm_moves_as_before() {
    let joints = [
        ("joint_1", 0.4),
        ("joint_2", 0.9),
        ("joint_4", -0.6),
        ("joint_7", 2.0),
        ("left", 33.0),
    ];
    same_after_both_ways(
        "arm.xml",
        &joints,
        &["tip", "link_6", "cup_body", "left", "joint_5"],
    );
}

#[test]
fn the_house_stands_as_before() {
    let joints = [("pan", 0.7), ("tilt", -0.3)];
    same_after_both_ways(
        "house.xml",
        &joints,
        &["bowl_body", "eye", "laser_pose", "camera", "wheel_left"],
    );
}

/// A joint of URDF turns its child as the specification says, whatever its axis is.
#[test]
fn joints_turn_about_their_axes() {
    for (axis, q) in [
        ([1.0, 0.0, 0.0], 0.7),
        ([0.0, 1.0, 0.0], -0.4),
        ([0.0, 0.0, -1.0], 1.1),
        ([0.6, -0.48, 0.64], 0.9),
    ] {
        let [x, y, z] = axis;
        let text = format!(
            r#"<robot name="r"><link name="base"/><link name="tip"/>
            <joint name="j" type="revolute"><parent link="base"/><child link="tip"/>
            <origin xyz="0.1 0.2 0.3" rpy="0.3 -0.5 0.8"/><axis xyz="{x} {y} {z}"/>
            <limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"#
        );
        let (document, found) = imported(&text);
        assert_eq!(found, "");
        let tree = model(&document);
        tree.change(Time::ZERO, |edit| edit.set_joint("j", q))
            .expect("a joint");
        let there = tree.snapshot().between("base", "tip").expect("two links");
        let there = frames::to_ros(&there);
        let axis = nalgebra::Unit::new_normalize(Vector3::new(x, y, z));
        let expected = Isometry3::from_parts(
            Translation3::new(0.1, 0.2, 0.3),
            UnitQuaternion::from_euler_angles(0.3, -0.5, 0.8)
                * UnitQuaternion::from_axis_angle(&axis, q),
        );
        let point = Point3::new(0.4, -0.2, 0.9);
        let apart = (there * point) - (expected * point);
        assert!(apart.norm() < 1e-9, "{axis:?}: {apart}");
    }
}

#[test]
fn bodies_and_prismatic_joints_are_imported() {
    let text = r#"<robot name="r">
        <material name="blue"><color rgba="0 0 1 1"/></material>
        <link name="root">
            <visual name="floor"><geometry><box size="2 3 0.1"/></geometry><material name="blue"/></visual>
            <collision><geometry><box size="2 3 0.1"/></geometry></collision>
        </link>
        <link name="slide">
            <inertial><mass value="2.5"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
            <visual name="pole"><origin xyz="0 0 0.5"/><geometry><cylinder radius="0.1" length="1"/></geometry></visual>
            <visual name="hand"><geometry><mesh filename="package://r/meshes/hand.stl" scale="1 1 2"/></geometry></visual>
        </link>
        <joint name="lift" type="prismatic"><parent link="root"/><child link="slide"/>
            <origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="-0.5" upper="1.5" effort="1" velocity="1"/></joint>
        <transmission name="t"/>
    </robot>"#;
    let (document, found) = imported(text);
    assert_eq!(
        found,
        "robot.urdf:8:14: warning[lost-on-import]: InnerModel has no moments of inertia: `slide` loses them\n\
         robot.urdf:14:10: warning[lost-on-import]: InnerModel has no words for `<transmission>`\n"
    );
    let printed = innermodel::language::print(&document);
    let expected = r##"<innerModel>
    <plane id="floor" size="3000,100,2000" texture="#0000ff" repeat="1" nz="-1" collide="1"/>
    <transform id="lift_base" ty="1000">
        <prismaticJoint id="lift" axis="y" min="-500" max="1500" maxspeed="1000">
            <transform id="slide" mass="2.5">
                <cylinder id="pole" ty="500" radius="100" length="1000"/>
                <mesh id="hand" rx="-1.5707963267948966" rz="-1.5707963267948966" file="meshes/hand.stl" scale="1000,1000,2000"/>
            </transform>
        </prismaticJoint>
    </transform>
</innerModel>
"##;
    // The angles of the mesh are one of several ways to say the same.
    let lines = |text: &str| -> Vec<String> {
        let lines = text.lines().filter(|line| !line.contains("<mesh"));
        lines.map(str::to_owned).collect()
    };
    assert_eq!(lines(&printed), lines(expected), "{printed}");
    let tree = model(&document).snapshot();
    // The vertex (1, 0, 0) of the file is a metre in front of the link, (0, 0, 1) two metres above.
    let node = tree.node("hand").expect("a node");
    let innermodel::Kind::Mesh(mesh) = node.kind() else {
        panic!("{node:?}");
    };
    for (vertex, expected) in [
        ([1.0, 0.0, 0.0], [0.0, 0.0, 1000.0]),
        ([0.0, 0.0, 1.0], [0.0, 2000.0, 0.0]),
    ] {
        let [x, y, z] = [0, 1, 2].map(|n| vertex[n] * mesh.scale[n]);
        let there = node.local().point(&Point::new(x, y, -z));
        assert!((there - Point::from(expected)).norm() < 1e-9, "{there}");
    }
}

#[test]
fn wrong_files_are_refused_with_a_place() {
    for (text, expected) in [
        (
            "<model/>",
            "1:2: error[not-a-urdf]: expected `<robot>`, found `<model>`",
        ),
        ("<robot>", "error[malformed-xml]"),
        (
            r#"<robot><link name="a"/><link name="b"/><joint name="j" type="fixd"><parent link="a"/><child link="b"/></joint></robot>"#,
            "unknown type of a joint `fixd`",
        ),
        (
            r#"<robot><link name="arm"/><link name="b"/><joint name="j" type="fixed"><parent link="amr"/><child link="b"/></joint></robot>"#,
            "error[unknown-link]: there is no link `amr`",
        ),
        (
            r#"<robot><link name="a"/><link name="b"/>
            <joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
            <joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint></robot>"#,
            "3:26: error[unknown-link]: the joints `j`, `k` form a cycle (a URDF is a tree:",
        ),
        (
            r#"<robot><link name="a"><visual><geometry><sphere radius="0,1"/></geometry></visual></link></robot>"#,
            "expected a number for `radius`, found `0,1`",
        ),
        (
            r#"<robot><link name="a"/><link name="a"/></robot>"#,
            "duplicate link `a`",
        ),
        (
            r#"<robot><joint name="a"/></robot>"#,
            "the joint has no `<parent>`",
        ),
        (r#"<robot><link name=""/></robot>"#, "a link has no name"),
        (
            r#"<robot><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit lower="1" upper="0"/></joint></robot>"#,
            "`lower` is greater than `upper`",
        ),
    ] {
        let (_, found) = imported(text);
        assert!(found.contains(expected), "{text}: {found}");
    }
}

/// The root of a tree has the id `root`: a link below another one gets a similar one.
#[test]
fn a_link_with_the_id_of_the_root_gets_another_one() {
    let text = r#"<robot><link name="base"/><link name="root"/><joint name="j" type="fixed"><parent
        link="base"/><child link="root"/></joint></robot>"#;
    let (document, found) = imported(text);
    assert_eq!(found, "");
    let ids = document.nodes.iter().map(|node| node.id.as_str());
    assert_eq!(ids.collect::<Vec<_>>(), ["base", "root_2"]);
    crate::model(&document);
}

/// What `xacro` has to expand is not a robot yet, wherever it stands.
#[test]
fn macros_are_refused() {
    let robot = |inner: &str| {
        let xmlns = "http://www.ros.org/wiki/xacro";
        imported(&format!(
            "<robot name='r' xmlns:xacro='{xmlns}'>\n{inner}\n</robot>"
        ))
    };
    for (inner, expected) in [
        (
            "<xacro:include filename='arm.xacro'/>",
            "error[not-a-urdf]: `<xacro:include>` is a macro of xacro",
        ),
        (
            "<link name='a'/><link name='b'><xacro:inertia/></link>",
            "error[not-a-urdf]: `<xacro:inertia>` is a macro of xacro",
        ),
        (
            "<link name='${prefix}base'/>",
            "error[not-a-urdf]: `${prefix}base` is an expression of xacro",
        ),
        (
            "<link name='a'><visual><geometry><mesh filename='$(find arm)/a.stl'/></geometry></visual></link>",
            "error[not-a-urdf]: `$(find arm)/a.stl` is an expression of xacro",
        ),
        ("", "error[not-a-urdf]: `<robot>` has no `<link>`"),
    ] {
        let (document, found) = robot(inner);
        assert_eq!(document.nodes.len(), 0);
        let line = if inner.is_empty() {
            "robot.urdf:1:"
        } else {
            "robot.urdf:2:"
        };
        let first = found.lines().next().unwrap_or_default();
        assert!(
            first.starts_with(line) && first.contains(expected),
            "{found}"
        );
        assert_eq!(
            first.contains("expand the file first"),
            !inner.is_empty(),
            "{found}"
        );
    }
    let expanded = "<link name='a'/><gazebo><plugin name='${x}'/></gazebo>";
    let (document, found) = robot(expanded);
    assert!(!found.contains("error"), "{found}");
    assert_eq!(document.nodes.len(), 1);
}

#[test]
fn joints_that_follow_each_other_are_reported_once() {
    let mut text = "<robot name='r'><link name='l0'/>".to_owned();
    // `d` and `e` lead into the circle of the others.
    for (number, (name, leader)) in [("a", "b"), ("b", "c"), ("c", "a"), ("d", "a"), ("e", "d")]
        .into_iter()
        .enumerate()
    {
        let below = number + 1;
        text += &format!(
            "<link name='l{below}'/><joint name='{name}' type='revolute'>
            <parent link='l{number}'/><child link='l{below}'/>
            <limit lower='0' upper='1' effort='1' velocity='1'/><mimic joint='{leader}'/></joint>"
        );
    }
    let (_, found) = imported(&(text + "</robot>"));
    assert_eq!(found.matches("error[").count(), 1, "{found}");
    let message = "error[mimic-circle]: `a` follows `b`, which follows `c`, which follows `a`: no joint leads";
    assert!(found.contains(message), "{found}");
}

/// The formula is in the units of InnerModel.
#[test]
fn a_joint_that_follows_has_a_formula() {
    let gripper = |mimic: &str| {
        imported(&format!(
            "<robot name='r'><link name='hand'/><link name='left'/><link name='right'/>
            <joint name='turn' type='revolute'><parent link='hand'/><child link='left'/>
                <limit lower='0' upper='1' effort='1' velocity='1'/></joint>
            <joint name='slide' type='prismatic'><parent link='hand'/><child link='right'/>
                <limit lower='0' upper='1' effort='1' velocity='1'/>{mimic}</joint></robot>"
        ))
    };
    let (document, found) = gripper("<mimic joint='turn' multiplier='-0.5' offset='0.02'/>");
    assert!(document.nodes.len() > 2, "{found}");
    let expected = "warning[lost-on-import]: InnerModel couples no joints: move `slide` to \
        -500 * `turn` + 20 wherever you move `turn`";
    assert!(found.contains(expected), "{found}");
    let (_, found) = gripper("<mimic joint='slide' offset='-0.5'/>");
    assert!(
        found.contains("error[mimic-circle]: `slide` follows `slide`: no joint leads"),
        "{found}"
    );
    let (_, found) = gripper("<mimic joint='trun'/>");
    assert!(
        found.contains("error[unknown-joint]: there is no joint `trun`"),
        "{found}"
    );
}
