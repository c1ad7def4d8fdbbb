//! The contents of valid files.

use crate::{Disk, Texts, loaded, right, scenes};
use expect_test::expect;
use innermodel_language::model::{Axes, Engine, Form, Kind, Mesh, Plane, Render, Shape, Solid};
use innermodel_language::print;
use std::path::Path;

const EVERYTHING: &str = r##"<?xml version="1.0"?>
<InnerModel>
    <Transform id="world" t_x="1" y="2" tz="3" r_x="0.1" ry="0.2" rz="0.3" engine="bullet" mass="4">
        <translation id="t" x="5" y="-0" z="1e3" mass="1"/>
        <rotation id="r" x="0.5" ry="-.5"/>
        <JOINT id="j" lx="1" hz="2" tx="10" rz="1" min="-1" max="2" port="7" axis="x" home="0.5">
            <prismaticjoint id="p" min="0" max="100" position="20" offset="5" port="8" axis="y" home="10"/>
        </JOINT>
        <joint id="free" maxspeed="2"/>
        <touchsensor id="touch" dropout="0.1" type="binary" nx="1" min="0" max="5" port="9"/>
        <differentialrobot id="dr" tx="1" port="10" noise="0.1" collide="1"/>
        <omnirobot id="or" collide="true" maxspeed="500" maxturn="2" slip="0.1"/>
        <camera id="c" width="640" height="480" focal="500" rate="15" noise="2"/>
        <rgbd id="d" width="640" height="480" focal="500" noise="0.5" port="11" ifconfig="1,2"/>
        <laser id="l" port="12" min="100" max="30000" angle="3" measures="100" ifconfig="a &amp; &quot;b&quot;" rate="40" noise="5" quantum="1" dropout="0.01" drift="2" latency="0.1"/>
        <imu id="i" port="13" noise="0.1" gyronoise="0.01"/>
        <lidar id="li" max="30000" measures="360" rings="16" low="-0.2" high="0.3" rate="10"/>
        <ultrasound id="us" min="20" max="3000" angle="0.5" noise="10"/>
        <battery id="ba" endurance="100" level="0.5"/>
        <human id="hu" tx="5" path="0,0 1000,-50.5" speed="800" height="1600"><transform id="hat"/></human>
        <plane id="pl" texture="#ff0000" repeat="2" size="10,20" ny="1" px="1" collide="1"/>
        <plane id="pl0"/>
        <plane id="pl1" size="100"/>
        <display id="di" size="1,2,3" port="14"/>
        <mesh id="m" file="a&lt;b.obj" scale="2" render="WireFrame" tx="1" collide="0"/>
        <mesh id="m2" file="b.obj" scale="2,3"/>
        <pointcloud id="pc"/>
        <axes id="ax" length="100" lengthx="50" widthz="2"/>
        <sphere id="s" radius="1"/>
        <cylinder id="cy" radius="1" length="2" texture="#00ff00"/>
        <cone id="co" radius="1" length="2" tx="1" collide="1" allowed="s, cy"/>
    </Transform>
</InnerModel>
"##;

#[test]
fn every_element_prints_and_loads_again() {
    let document = right(EVERYTHING);
    let text = print(&document);
    expect![[r##"
        <innerModel>
            <transform id="world" tx="1" ty="2" tz="3" rx="0.1" ry="0.2" rz="0.3" engine="bullet" mass="4">
                <translation id="t" tx="5" tz="1000" mass="1"/>
                <rotation id="r" rx="0.5" ry="-0.5"/>
                <joint id="j" tx="10" rz="1" axis="x" min="-1" max="2" home="0.5" port="7" lx="1" hz="2">
                    <prismaticJoint id="p" axis="y" min="0" max="100" home="10" position="20" offset="5" port="8"/>
                </joint>
                <joint id="free" maxspeed="2"/>
                <touchsensor id="touch" type="binary" nx="1" min="0" max="5" port="9" dropout="0.1"/>
                <differentialrobot id="dr" tx="1" port="10" noise="0.1" collide="1"/>
                <omnirobot id="or" collide="1" maxspeed="500" maxturn="2" slip="0.1"/>
                <camera id="c" width="640" height="480" focal="500" rate="15" noise="2"/>
                <rgbd id="d" width="640" height="480" focal="500" noise="0.5" port="11" ifconfig="1,2"/>
                <laser id="l" port="12" min="100" max="30000" angle="3" measures="100" ifconfig="a &amp; &quot;b&quot;" rate="40" noise="5" quantum="1" dropout="0.01" drift="2" latency="0.1"/>
                <imu id="i" port="13" gyronoise="0.01" noise="0.1"/>
                <lidar id="li" max="30000" measures="360" rings="16" low="-0.2" high="0.3" rate="10"/>
                <ultrasound id="us" min="20" max="3000" angle="0.5" noise="10"/>
                <battery id="ba" endurance="100" level="0.5"/>
                <human id="hu" tx="5" path="0,0 1000,-50.5" speed="800" height="1600">
                    <transform id="hat"/>
                </human>
                <plane id="pl" size="10,20,0.1" texture="#ff0000" repeat="2" ny="1" px="1" collide="1"/>
                <plane id="pl0" size="2500,2500,25" nz="-1"/>
                <plane id="pl1" size="100,100,1" nz="-1"/>
                <display id="di" size="1,2,3" nz="-1" port="14"/>
                <mesh id="m" tx="1" file="a&lt;b.obj" scale="2,2,2" render="wireframe"/>
                <mesh id="m2" file="b.obj" scale="2,3,2"/>
                <pointcloud id="pc"/>
                <axes id="ax" lengthx="50" lengthy="100" lengthz="100" widthz="2"/>
                <sphere id="s" radius="1"/>
                <cylinder id="cy" radius="1" length="2" texture="#00ff00"/>
                <cone id="co" tx="1" radius="1" length="2" collide="1" allowed="s cy"/>
            </transform>
        </innerModel>
    "##]].assert_eq(&text);
    assert_eq!(right(&text), document);
}

#[test]
fn scenes_load_without_a_finding_and_print() {
    let scenes = scenes();
    assert!(scenes.len() >= 3);
    for path in scenes {
        let text = std::fs::read_to_string(&path).expect("a scene");
        let (document, found, output) = loaded(&Disk, &path, &text);
        assert!(found.is_empty(), "{output}");
        assert!(document.nodes.len() > 10);
        let (again, found, output) = loaded(&Disk, &path, &print(&document));
        assert!(found.is_empty(), "{output}");
        assert_eq!(again, document);
    }
}

#[test]
fn sizes_and_scales_have_one_two_or_three_numbers() {
    let document = right(EVERYTHING);
    let size = |id: &str| match &document.nodes[document.find(id).expect("a node")].kind {
        Kind::Plane(Plane { size, .. }) => *size,
        Kind::Mesh(Mesh { scale, .. }) => *scale,
        kind => panic!("{kind:?}"),
    };
    assert_eq!(size("pl0"), [2500.0, 2500.0, 25.0]);
    assert_eq!(size("pl1"), [100.0, 100.0, 1.0]);
    assert_eq!(size("pl"), [10.0, 20.0, 0.1]);
    assert_eq!(size("m"), [2.0, 2.0, 2.0]);
    assert_eq!(size("m2"), [2.0, 3.0, 2.0]);
}

#[test]
fn a_rotation_has_angles_and_a_translation_lengths() {
    let document = right(EVERYTHING);
    let node = |id: &str| &document.nodes[document.find(id).expect("a node")];
    assert_eq!(node("t").pose.translation, [5.0, 0.0, 1000.0]);
    assert_eq!(node("r").pose.rotation, [0.5, -0.5, 0.0]);
    assert_eq!(node("world").pose.translation, [1.0, 2.0, 3.0]);
    assert_eq!(node("world").pose.rotation, [0.1, 0.2, 0.3]);
    let Kind::Transform(world) = &node("world").kind else {
        panic!("{:?}", node("world"));
    };
    assert_eq!(
        (world.form, world.engine, world.mass),
        (Form::Transform, Engine::Bullet, 4.0)
    );
    let Kind::Joint(free) = &node("free").kind else {
        panic!("{:?}", node("free"));
    };
    assert_eq!((free.min, free.max), (f64::NEG_INFINITY, f64::INFINITY));
    let Kind::Mesh(mesh) = &node("m").kind else {
        panic!("{:?}", node("m"));
    };
    assert_eq!(
        (mesh.file.as_str(), mesh.render),
        ("a<b.obj", Render::Wireframe)
    );
}

#[test]
fn metres_hold_for_included_files_that_say_nothing() {
    let files = Texts::of(&[
        (
            "silent.xml",
            r#"<innerModel>
                <prismaticJoint id="slide" min="-1" max="2" home="0.5" offset="0.1" position="0.2"/>
                <laser id="laser" min="0.1" max="30" angle="3"/>
                <axes id="axes"/>
                <plane id="plane"/>
                <mesh id="mesh" scale="1,2,3"/>
                <camera id="camera" focal="400" width="640" height="480"/>
                <sphere id="ball" radius="0.1"/>
                <joint id="joint" min="-1" max="1"/>
            </innerModel>"#,
        ),
        (
            "exact.xml",
            r#"<innerModel units="millimetres"><plane id="board" size="10" px="3"/></innerModel>"#,
        ),
    ]);
    let text = r#"<innerModel units="metres">
        <transform id="t" tx="1.5" rx="1">
            <include path="silent.xml"/>
            <include path="exact.xml"/>
        </transform>
    </innerModel>"#;
    let (document, found, output) = loaded(&files, Path::new("world.xml"), text);
    assert!(!found.has_errors(), "{output}");
    let node = |id: &str| &document.nodes[document.find(id).expect("a node")];
    assert_eq!(node("t").pose.translation, [1500.0, 0.0, 0.0]);
    assert_eq!(node("t").pose.rotation, [1.0, 0.0, 0.0]);
    let Kind::Prismatic(slide) = &node("slide").kind else {
        panic!()
    };
    assert_eq!(
        (
            slide.min,
            slide.max,
            slide.home,
            slide.offset,
            slide.position
        ),
        (-1000.0, 2000.0, 500.0, 100.0, 200.0)
    );
    let Kind::Laser(laser) = &node("laser").kind else {
        panic!()
    };
    assert_eq!((laser.min, laser.max, laser.angle), (100.0, 30_000.0, 3.0));
    let Kind::Axes(Axes { lengths, widths }) = node("axes").kind else {
        panic!()
    };
    assert_eq!((lengths, widths), ([200.0; 3], [15.0; 3]));
    let Kind::Mesh(mesh) = &node("mesh").kind else {
        panic!()
    };
    assert_eq!(mesh.scale, [1000.0, 2000.0, 3000.0]);
    let Kind::Camera(camera) = &node("camera").kind else {
        panic!()
    };
    assert_eq!((camera.camera.focal, camera.camera.width), (400.0, 640.0));
    let Kind::Solid(Solid { shape, .. }) = &node("ball").kind else {
        panic!()
    };
    assert_eq!(*shape, Shape::Sphere { radius: 100.0 });
    let Kind::Plane(plane) = &node("plane").kind else {
        panic!()
    };
    assert_eq!(plane.size, [2500.0, 2500.0, 25.0]);
    let Kind::Plane(board) = &node("board").kind else {
        panic!()
    };
    assert_eq!(
        (board.size, board.point),
        ([10.0, 10.0, 0.1], [3.0, 0.0, 0.0])
    );
    let Kind::Joint(joint) = &node("joint").kind else {
        panic!()
    };
    assert_eq!((joint.min, joint.max), (-1.0, 1.0));
    // Printed, it is in millimetres.
    assert_eq!(right(&print(&document)).nodes.len(), document.nodes.len());
}

#[test]
fn included_meshes_stay_found_where_the_document_is_printed() {
    let files = Texts::of(&[
        (
            "world/parts/chair.xml",
            r#"<innerModel><mesh id="chair" file="chair.stl"/></innerModel>"#,
        ),
        ("world/parts/chair.stl", ""),
    ]);
    let text = r#"<innerModel><include path="parts/chair.xml"/></innerModel>"#;
    let (document, _, output) = loaded(&files, Path::new("world/main.xml"), text);
    assert_eq!(output, "");
    let (again, _, output) = loaded(&files, Path::new("world/main.xml"), &print(&document));
    assert_eq!(output, "");
    assert_eq!(again, document);
    let Kind::Mesh(mesh) = &document.nodes[0].kind else {
        panic!()
    };
    assert_eq!(mesh.file, "parts/chair.stl");
}
