//! Point clouds, by pixels.

use innermodel::{ColouredPoint, Error, InnerModel, Point, Pose, Time};
use innermodel_render::{Scene, View, look_at};

const RED: [u8; 3] = [255, 0, 0];

fn view() -> View {
    let camera = innermodel::kinds::Camera {
        width: 160.0,
        height: 120.0,
        focal: 140.0,
    };
    look_at(
        Point::new(300.0, 250.0, -900.0),
        Point::new(0.0, 50.0, 0.0),
        camera,
    )
}

fn model() -> InnerModel {
    let text = r##"<innerModel>
        <transform id="sensor" tx="40" ty="30" ry="0.5"><pointcloud id="seen"/></transform>
        <plane id="wall" pz="300" size="2000,2000,10" texture="#0000ff"/>
    </innerModel>"##;
    InnerModel::parse(text).expect("a model")
}

fn points() -> Vec<ColouredPoint> {
    let position = |at: u32| {
        [0.618_034_f32, 0.754_878, 0.569_84].map(|f| {
            let part = (at as f32 * f).fract();
            part * 400.0 - 200.0
        })
    };
    (1..30)
        .map(|at| ColouredPoint {
            position: position(at),
            colour: [255, at as u8, 0],
        })
        .collect()
}

#[test]
fn points_are_seen_at_their_projected_pixels() {
    let (model, view) = (model(), view());
    model.set_points("seen", points()).expect("points");
    let tree = model.snapshot();
    let node = tree.node("seen").expect("a node");
    let mut scene = Scene::new();
    scene.set_clouds(model.clouds());
    let image = scene.draw(&tree, &view).expect("an image");
    let mut shown = 0;
    for point in points() {
        let place = node
            .to_root()
            .point(&Point::from(point.position.map(f64::from)));
        let depth = view.place.inverse().point(&place).z;
        let (u, v) = view.pixel(&place).expect("a pixel");
        let at = v as usize * image.width + u as usize;
        assert_eq!(image.nodes[at], Some(node.node_id()));
        // A point may hide another one.
        if (image.depths[at] - depth).abs() < 1e-3 {
            assert_eq!(image.colours[at], point.colour);
            shown += 1;
        } else {
            assert!(image.depths[at] < depth);
        }
    }
    assert!(shown > 20, "{shown}");
    // Nothing else is of the cloud.
    let count = image.nodes.iter().filter(|n| **n == Some(node.node_id()));
    let count = count.count();
    assert!((shown * 4..=29 * 9).contains(&count), "{count}");
    let ids = image.id_png(&tree).expect("a picture");
    assert!(ids.starts_with(b"\x89PNG"));
}

/// A scene keeps the points that it got: later ones are seen after the next `set_clouds`.
#[test]
fn a_scene_keeps_its_points() -> Result<(), Box<dyn std::error::Error>> {
    let (model, view, mut scene) = (model(), view(), Scene::new());
    model.set_points("seen", points())?;
    scene.set_clouds(model.clouds());
    let tree = model.snapshot();
    let image = scene.draw(&tree, &view)?;
    model.set_points("seen", Vec::new())?;
    assert_eq!(scene.draw(&tree, &view)?, image);
    scene.set_clouds(model.clouds());
    assert_ne!(scene.draw(&tree, &view)?, image);
    Ok(())
}

#[test]
fn bodies_hide_points_and_points_follow_their_node() {
    let (model, view) = (model(), view());
    let point = |z: f32| ColouredPoint {
        position: [0.0, 0.0, z],
        colour: RED,
    };
    let mut scene = Scene::new();
    let mut count = || {
        scene.set_clouds(model.clouds());
        let tree = model.snapshot();
        let image = scene.draw(&tree, &view).expect("an image");
        let id = tree.node("seen").expect("a node").node_id();
        image.nodes.iter().filter(|node| **node == Some(id)).count()
    };
    assert_eq!(count(), 0);
    model.set_points("seen", vec![point(0.0)]).expect("points");
    assert_eq!(count(), 9);
    // Behind the wall, behind the camera, and nowhere.
    let hidden = vec![
        point(1000.0),
        point(-3000.0),
        point(f32::NAN),
        point(f32::INFINITY),
    ];
    model.set_points("seen", hidden).expect("points");
    assert_eq!(count(), 0);
    model.set_points("seen", vec![point(0.0)]).expect("points");
    let away = Pose::new(0.0, 0.0, 2000.0, 0.0, 0.0, 0.0);
    model
        .change(Time::ZERO, |edit| edit.set_pose("sensor", away))
        .expect("a change");
    assert_eq!(count(), 0);
}

#[test]
fn points_belong_to_point_clouds_and_have_a_bound() {
    let model = model();
    let wrong = model.set_points("wall", points()).expect_err("a plane");
    assert_eq!(wrong.to_string(), "`wall` is a plane, not a pointcloud");
    let wrong = model.set_points("sen", points()).expect_err("no node");
    assert!(wrong.to_string().contains("`seen`"), "{wrong}");
    let many = vec![ColouredPoint::default(); innermodel::Clouds::MOST_POINTS + 1];
    let wrong = model.set_points("seen", many);
    let (count, most) = (10_000_001, 10_000_000);
    assert_eq!(wrong, Err(Error::TooManyPoints { count, most }));
    model.set_points("seen", points()).expect("points");
    let (before, version) = (model.clouds(), model.snapshot().version());
    let fork = model.fork();
    let node = model.snapshot().node("seen").expect("a node").node_id();
    model
        .change(Time::ZERO, |edit| edit.remove("seen").map(drop))
        .expect("a change");
    model.forget_points();
    assert_eq!(model.clouds().of(node).len(), 0);
    // Those who have the clouds keep them.
    assert_eq!(
        (before.of(node).len(), fork.clouds().of(node).len()),
        (29, 29)
    );
    assert_eq!(model.snapshot().version(), version + 1);
}
