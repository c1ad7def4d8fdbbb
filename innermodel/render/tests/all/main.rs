//! Pictures show things where they are.

mod clouds;
mod meshes;
mod textures;
mod transparency;

use innermodel::kinds::Camera;
use innermodel::{Folders, InnerModel, NodeId, Point, Vector, sensors};
use innermodel_collision::Space;
use innermodel_render::{Scene, View, camera, id_colours, look_at};
use std::path::Path;

fn load(name: &str) -> InnerModel {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    InnerModel::load(&folder.join(name), &Folders::default()).expect("a scene")
}

fn small() -> Camera {
    Camera {
        width: 160.0,
        height: 120.0,
        focal: 100.0,
    }
}

#[test]
fn a_ball_is_at_its_projected_pixel() {
    let balls: String = (0..20)
        .map(|n| {
            let (x, y, z) = (
                n * 37 % 11 * 60 - 300,
                n * 53 % 7 * 60 - 180,
                800 + n * 17 % 5 * 100,
            );
            format!(
                r##"<sphere id="b{n}" tx="{x}" ty="{y}" tz="{z}" radius="12" texture="#ff0000"/>"##
            )
        })
        .collect();
    let text = format!(
        r#"<innerModel>{balls}<transform id="t" ty="10"><camera id="c" width="640" height="480" focal="500"/></transform></innerModel>"#
    );
    let tree = InnerModel::parse(&text).expect("a model").snapshot();
    let view = camera(&tree, "c").expect("a node").expect("a camera");
    let image = Scene::new().draw(&tree, &view).expect("an image");
    let mut seen = 0;
    for n in 0..20 {
        let id = format!("b{n}");
        let node = tree.node(&id).expect("a node").node_id();
        let centre = tree.transform("c", Point::origin(), &id).expect("a point");
        let (u, v) = sensors::project(&view.camera, &centre).expect("a pixel");
        let pixels: Vec<(f64, f64)> = (0..image.nodes.len())
            .filter(|at| image.nodes[*at] == Some(node))
            .map(|at| ((at % 640) as f64 + 0.5, (at / 640) as f64 + 0.5))
            .collect();
        if pixels.len() < 50 {
            // Another ball is in front of it.
            continue;
        }
        let count = pixels.len() as f64;
        let x = pixels.iter().map(|p| p.0).sum::<f64>() / count;
        let y = pixels.iter().map(|p| p.1).sum::<f64>() / count;
        assert!(
            (x - u).abs() < 1.0 && (y - v).abs() < 1.0,
            "{id}: {x} {y}, not {u} {v}"
        );
        seen += 1;
    }
    assert!(seen > 10, "{seen} of 20 balls are seen");
}

/// The depth of each pixel, silhouettes aside, is that of a ray through its centre.
fn equals_rays(model: &InnerModel, view: &View) {
    let tree = model.snapshot();
    let image = Scene::new().draw(&tree, view).expect("an image");
    let space = Space::new(&tree);
    let start = view.place.point(&Point::origin());
    let mut compared = 0;
    for y in 1..image.height - 1 {
        for x in 1..image.width - 1 {
            let at = y * image.width + x;
            let around = [at - 1, at + 1, at - image.width, at + image.width];
            if around
                .iter()
                .any(|other| image.nodes[*other] != image.nodes[at])
            {
                continue;
            }
            let ray = sensors::ray(&view.camera, x as f64 + 0.5, y as f64 + 0.5);
            let way = view.place.vector(&ray);
            // The bars of axes are drawn, and are not bodies.
            let body = |node: NodeId| tree.node(node).is_ok();
            let hit = space
                .ray(NodeId::ROOT, start, way, 1e6, &body)
                .expect("a root");
            let drawn = image.nodes[at].filter(|node| {
                let kind = tree.node(*node).map(|node| node.kind().tag());
                kind != Ok("axes")
            });
            if image.nodes[at].is_none() {
                assert!(hit.is_none(), "{x} {y}: {hit:?} is not drawn");
            }
            let (Some(hit), Some(node)) = (hit, drawn) else {
                assert!(drawn.is_none(), "{x} {y}");
                continue;
            };
            let depth = hit.distance / ray.norm();
            // Boxes that lie in each other may differ in the node, not in the depth.
            assert!(
                (depth - image.depths[at]).abs() <= 1e-4 * depth,
                "{x} {y}: {node:?} at {}, {:?} at {depth}",
                image.depths[at],
                hit.node,
            );
            compared += 1;
        }
    }
    assert!(compared > 5000, "{compared}");
}

#[test]
fn depths_equal_rays_in_the_house() {
    let model = load("house.xml");
    let camera = camera(&model.snapshot(), "watch_camera")
        .expect("a node")
        .expect("a camera");
    equals_rays(
        &model,
        &View {
            camera: small(),
            ..camera
        },
    );
}

#[test]
fn depths_equal_rays_at_the_arm() {
    let model = load("arm.xml");
    let view = look_at(
        Point::new(900.0, 1500.0, 900.0),
        Point::new(0.0, 1000.0, 0.0),
        small(),
    );
    assert!((view.place.vector(&Vector::z()).norm() - 1.0).abs() < 1e-12);
    equals_rays(&model, &view);
}

#[test]
fn pictures_are_png_files() -> Result<(), Box<dyn std::error::Error>> {
    let tree = load("arm.xml").snapshot();
    let view = look_at(
        Point::new(900.0, 1500.0, 900.0),
        Point::new(0.0, 1000.0, 0.0),
        small(),
    );
    let mut scene = Scene::new();
    let image = scene.draw(&tree, &view)?;
    assert!(scene.problems().is_empty());
    for file in [image.png()?, image.id_png(&tree)?] {
        let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info()?;
        let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
        let about = reader.next_frame(&mut pixels)?;
        assert_eq!((about.width, about.height), (160, 120));
        if pixels != image.colours.as_flattened() {
            let middle = &pixels[(60 * 160 + 80) * 3..][..3];
            let node = image.node(80, 60).expect("the arm");
            let mut known = id_colours(&tree).filter(|(_, _, colour)| colour == middle);
            assert_eq!(known.next().map(|(known, ..)| known), Some(node));
            assert_eq!(pixels[..3], [0, 0, 0]);
        }
    }
    assert_eq!(image.node(0, 0), None);
    assert_eq!(image.node(160, 0), None);
    assert_eq!(camera(&tree, "cup"), Ok(None));
    Ok(())
}

#[test]
fn images_have_a_bound() {
    let tree = load("arm.xml").snapshot();
    for (width, height) in [(1e9, 1.0), (5000.0, 5000.0), (f64::NAN, 10.0), (-1.0, 10.0)] {
        let large = Camera {
            width,
            height,
            focal: 100.0,
        };
        let view = look_at(Point::origin(), Point::new(0.0, 0.0, 1.0), large);
        assert!(Scene::new().draw(&tree, &view).is_err());
    }
}

/// Bodies beyond all numbers, and what cameras see from there.
#[test]
fn numbers_that_are_none_are_not_drawn() {
    let balls: String = (0..20)
        .map(|n| {
            format!(r#"<sphere id="b{n}" tx="1e308" radius="1"/><plane id="p{n}" px="1e308"/>"#)
        })
        .collect();
    let far = format!(
        r#"<innerModel><transform id="a" tx="1e308" ry="1"><transform id="b" tx="1e308">{balls}</transform></transform>
        <sphere id="great" radius="1e308"/><plane id="wide" size="1e308,1e308,1e308"/>
        <cone id="flat" radius="1e308" length="1e-308"/><cylinder id="thin" radius="1e-308" length="1e308"/></innerModel>"#
    );
    let tree = InnerModel::parse(&far).expect("a model").snapshot();
    for from in [0.0, 1e308, f64::NAN, f64::INFINITY] {
        let view = look_at(Point::new(from, 0.0, -500.0), Point::origin(), small());
        let image = Scene::new().draw(&tree, &view).expect("an image");
        let is_seen = image.nodes.iter().any(Option::is_some);
        assert!(from.is_finite() || !is_seen, "{from}");
        assert!(image.depths.iter().all(|depth| *depth > 0.0), "{from}");
    }
}

#[test]
fn an_unreadable_mesh_is_reported_once() {
    let text =
        r#"<innerModel><mesh id="a" file="none.3ds"/><mesh id="b" file="none.3ds"/></innerModel>"#;
    let tree = InnerModel::parse(text).expect("a model").snapshot();
    let view = look_at(Point::origin(), Point::new(0.0, 0.0, 1.0), small());
    let mut scene = Scene::new();
    for _ in 0..2 {
        scene.draw(&tree, &view).expect("an image");
    }
    let problems = scene.problems();
    assert_eq!(problems.len(), 1);
    assert_eq!(problems[0].id, "a");
}
