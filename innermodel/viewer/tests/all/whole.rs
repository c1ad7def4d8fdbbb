//! From where a tree is seen at first: all of it, from above and behind.

use innermodel::{Folders, InnerModel, NodeId, NodeRef};
use innermodel_render::{Image, Scene};
use innermodel_viewer::{Navigator, innermodel};
use std::path::Path;

/// A window with its picture.
fn seen(model: &InnerModel, size: (usize, usize)) -> Image {
    let view = Navigator::of(model, size).view(size.0, size.1);
    let drawn = Scene::new().draw(&model.snapshot(), &view);
    drawn.expect("a picture")
}

fn node(model: &InnerModel, id: &str) -> NodeId {
    model.snapshot().node(id).expect("a node").node_id()
}

/// The least and most columns and rows that show something.
fn bounds(image: &Image) -> [usize; 4] {
    let shown = image.nodes.iter().enumerate();
    let places = shown.filter(|(_, node)| node.is_some());
    let places = places.map(|(at, _)| (at % image.width, at / image.width));
    places.fold([usize::MAX, 0, usize::MAX, 0], |b, (x, y)| {
        [b[0].min(x), b[1].max(x), b[2].min(y), b[3].max(y)]
    })
}

/// Nothing is cut off, and the picture is not mostly empty, whatever the bodies and their size.
#[test]
fn a_tree_fits_its_window() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh =
        "v -200 0 -250\nv 200 0 -250\nv 0 300 250\nv 0 0 250\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n";
    std::fs::write(folder.path().join("robot.obj"), mesh).expect("a file");
    let mesh = r#"<transform id="t" tx="9000"><mesh id="m" file="robot.obj"/></transform>"#;
    let arm = r#"<cylinder id="c" radius="20" length="3000"/>"#;
    let ground =
        r#"<plane id="ground" size="200000,10,200000"/><sphere id="s" ty="60" radius="50"/>"#;
    let joints = r#"<sphere id="s" radius="1"/><sphere id="s2" tx="3" radius="1"/>"#;
    for text in [mesh, arm, joints, ground] {
        let text = format!("<innerModel>{text}</innerModel>");
        let place = folder.path().join("scene.xml");
        let read = innermodel::read_text(&text, &place, &Folders::default());
        let model = InnerModel::from_document(&read.expect("a scene").0).expect("a tree");
        for size in [(960, 640), (300, 600), (640, 200)] {
            let mut image = seen(&model, size);
            if text.contains("ground") {
                // The ground goes on; the ball on it is what fills the picture.
                let ball = Some(node(&model, "s"));
                let others = image.nodes.iter_mut().filter(|node| **node != ball);
                others.for_each(|node| *node = None);
            }
            let [left, right, top, bottom] = bounds(&image);
            assert!(left > 0 && right + 1 < size.0, "{text}: {left} {right}");
            assert!(top > 0 && bottom + 1 < size.1, "{text}: {top} {bottom}");
            let wide = (right - left) as f64 / size.0 as f64;
            let high = (bottom - top) as f64 / size.1 as f64;
            assert!(wide.max(high) > 0.4, "{text} {size:?}: {wide} {high}");
        }
    }
}

/// No wall hides the robot, which drives away from the camera.
#[test]
fn a_robot_in_a_house_is_seen_from_behind() {
    let components = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../components");
    for (scene, robot) in [("rcis/house.xml", "base"), ("planner/room.xml", "base")] {
        let model = InnerModel::load(&components.join(scene), &Folders::default());
        let model = model.expect("a tree");
        let image = seen(&model, (960, 640));
        let tree = model.snapshot();
        let is_robot = |at: &NodeId| {
            let node = tree.node(*at).expect("a node");
            std::iter::successors(Some(node), NodeRef::parent).any(|n| n.id() == robot)
        };
        let seen = image.nodes.iter().flatten().filter(|at| is_robot(at));
        let count = seen.count();
        assert!(count > 400, "{scene}: {count}");
        let view = Navigator::of(&model, (960, 640)).view(960, 640);
        let front = tree.node(robot).expect("a robot").to_root();
        let front = front.vector(&innermodel::Vector::z());
        let camera = view.place.vector(&innermodel::Vector::z());
        assert!(front.dot(&camera) > 0.2, "{scene}: {camera}");
    }
}
