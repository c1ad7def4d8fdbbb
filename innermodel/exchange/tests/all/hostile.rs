//! Files that say what cannot be.

use crate::imported;
use innermodel::language::print;

/// A file that is imported without an error loads.
#[test]
fn wrong_parts_of_robots_are_refused_with_a_place() {
    let visual = |geometry: &str| format!(r#"<link name="a"><visual>{geometry}</visual></link>"#);
    let joint = |inside: &str| {
        format!(
            r#"<link name="a"/><link name="b"/><joint name="j" {inside}<parent link="a"/><child link="b"/></joint>"#
        )
    };
    for (inside, expected) in [
        (
            visual(r#"<geometry><sphere radius="-1"/></geometry>"#),
            "1:57: error[bad-value]: `radius` must be greater than 0, found `-1`",
        ),
        (
            visual(r#"<geometry><sphere radius="1e306"/></geometry>"#),
            "1:57: error[bad-value]: `radius` is too great, found `1e306`",
        ),
        (
            visual("<geometry><sphere/></geometry>"),
            "1:42: error[missing-attribute]: `<sphere>` has no attribute `radius`",
        ),
        (
            visual("<geometry><box/></geometry>"),
            "`<box>` has no attribute `size`",
        ),
        (
            visual(r#"<geometry><box size="1 -1 1"/></geometry>"#),
            "`size` cannot be negative, found `1 -1 1`",
        ),
        (
            visual(r#"<geometry><cylinder radius="0" length="1"/></geometry>"#),
            "`radius` must be greater than 0",
        ),
        (
            visual(r#"<geometry><cylinder radius="1"/></geometry>"#),
            "`<cylinder>` has no attribute `length`",
        ),
        (
            visual(r#"<geometry><mesh filename="a.stl" scale="1e306 1 1"/></geometry>"#),
            "`scale` is too great",
        ),
        (
            visual("<geometry><mesh/></geometry>"),
            "`<mesh>` has no attribute `filename`",
        ),
        (visual(""), "1:24: error[missing-attribute]: `<visual>` has no geometry"),
        (visual("<geometry/>"), "`<visual>` has no geometry"),
        (
            r#"<link name="a"><collision/></link>"#.to_owned(),
            "`<collision>` has no geometry",
        ),
        (
            joint(r#"type="fixed"><origin xyz="0 1e306 0"/>"#),
            "`xyz` is too great, found `0 1e306 0`",
        ),
        (
            joint(r#"type="prismatic"><limit lower="-1e306" upper="1"/>"#),
            "`lower` is too great, found `-1e306`",
        ),
        (
            joint(r#"type="revolute"><limit lower="nan" upper="1"/>"#),
            "expected a number for `lower`, found `nan`",
        ),
        (joint(r#"type="revolute"><axis xyz="0 0 0"/>"#), "the axis of the joint is 0"),
        (joint(">"), "`<joint>` has no attribute `type`"),
        (
            joint(r#"type="revolut">"#),
            "unknown type of a joint `revolut` (did you mean `revolute`?)",
        ),
        (
            joint(r#"type="fixed"><parent link="b"/>"#),
            "the joint `j` moves a link in itself",
        ),
        (
            r#"<link name="a"/><link name="b"/><joint type="fixed"><parent link="a"/><child link="b"/></joint>"#.to_owned(),
            "`<joint>` has no attribute `name`",
        ),
        (
            r#"<link name="a"/><link name="b"/><link name="c"/>
            <joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
            <joint name="j" type="fixed"><parent link="a"/><child link="c"/></joint>"#.to_owned(),
            "3:26: error[duplicate-id]: duplicate joint `j`; first used here at robot.urdf:2:26",
        ),
        (
            "<link name=\"a\"/>\n<link name=\"a\"/>".to_owned(),
            "2:13: error[duplicate-id]: duplicate link `a`; first used here at robot.urdf:1:20",
        ),
        (
            r#"<link name="a"/><link name="b"/><link name="c"/>
            <joint name="i" type="fixed"><parent link="a"/><child link="c"/></joint>
            <joint name="j" type="fixed"><parent link="b"/><child link="c"/></joint>"#.to_owned(),
            "the link `c` has two joints above it; first used here at robot.urdf:2:",
        ),
        (
            joint(r#"type="continuous"><limit effort="1" velocity="-1"/>"#),
            "error[bad-value]: `velocity` cannot be negative, found `-1`",
        ),
    ] {
        let (_, found) = imported(&format!("<robot>{inside}</robot>"));
        assert!(found.contains(expected), "{inside}: {found}");
    }
}

#[test]
fn ten_thousand_links_are_refused_at_once() {
    let links: String = (0..10_000)
        .map(|n| format!(r#"<link name="l{n}"/>"#))
        .collect();
    let joints = (1..10_000).map(|n| {
        let above = n - 1;
        format!(
            r#"<joint name="j{n}" type="fixed"><parent link="l{above}"/><child link="l{n}"/></joint>"#
        )
    });
    let (_, found) = imported(&format!(
        "<robot>{links}{}</robot>",
        joints.collect::<String>()
    ));
    assert!(
        found.contains("links are nested more than 512 deep"),
        "{found}"
    );
}

/// A joint keeps its greatest speed, also that which a joint without one gets in URDF.
#[test]
fn speeds_of_joints_are_kept() {
    let text = r#"<innerModel><joint id="a" maxspeed="2"><prismaticJoint id="b" maxspeed="300">
        <joint id="c"/></prismaticJoint></joint></innerModel>"#;
    let before = innermodel::InnerModel::parse(text).expect("a tree");
    let before = before.snapshot().document();
    let (exported, _) = innermodel_exchange::urdf::write(&before, "robot");
    assert!(exported.contains(r#"velocity="0.3""#), "{exported}");
    let (after, found) = imported(&exported);
    let printed = print(&after);
    assert_eq!(found, "");
    assert!(
        printed.contains(r#"axis="z" maxspeed="2""#) || printed.contains(r#"id="a" maxspeed="2""#),
        "{printed}"
    );
    assert_eq!(printed.matches("maxspeed").count(), 2, "{printed}");
    assert!(printed.contains(r#"maxspeed="300""#), "{printed}");
    let text = r#"<innerModel><joint id="a" maxspeed="10"><prismaticJoint id="b" maxspeed="10000"/>
        </joint></innerModel>"#;
    let before = innermodel::InnerModel::parse(text).expect("a tree");
    let (exported, _) = innermodel_exchange::urdf::write(&before.snapshot().document(), "robot");
    let (after, _) = imported(&exported);
    let printed = print(&after);
    assert!(printed.contains(r#"maxspeed="10""#), "{printed}");
    assert!(printed.contains(r#"maxspeed="10000""#), "{printed}");
}

/// glTF has numbers of 32 bits: a greater body is told, and the file is one without it.
#[test]
fn what_is_too_great_for_gltf_is_told() {
    let text = r#"<innerModel><sphere id="great" radius="1e200"/><sphere id="small" radius="1"/></innerModel>"#;
    let tree = innermodel::InnerModel::parse(text).expect("a tree");
    let (file, found) = innermodel_exchange::gltf::write(&tree.snapshot().document());
    let messages: Vec<_> = found
        .iter()
        .map(|finding| finding.message.as_str())
        .collect();
    assert_eq!(
        messages,
        ["glTF cannot hold such large coordinates: `great` has no body in the file"]
    );
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("world.glb");
    std::fs::write(&path, file).expect("a file");
    let mesh = innermodel_mesh::read(&path).expect("a mesh");
    assert!(mesh.vertices.iter().flatten().all(|n| n.abs() < 0.002));
}
