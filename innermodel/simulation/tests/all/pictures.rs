//! Pictures of cameras.

use crate::{room, world};
use innermodel::{Pose, sensors};
use innermodel_collision::Space;
use innermodel_render::id_colours;

const INSIDE: &str = r##"<transform id="stand" tx="-500" ty="1100" tz="-900" ry="0.35" rx="0.1">
        <rgbd id="eye" width="160" height="120" focal="120"/>
        <camera id="colours" width="160" height="120" focal="120"/>
    </transform>
    <transform id="things" tx="300" ty="800" tz="600">
        <sphere id="ball" tx="-600" radius="250" texture="#ff8000"/>
        <cone id="cone" tx="400" radius="300" length="700" texture="#00ffff"/>
        <cylinder id="can" tx="1000" rx="0.5" radius="150" length="600" texture="#ff00ff"/>
        <plane id="box" py="-500" size="500,400,300" texture="#123456"/>
    </transform>"##;

#[test]
fn depths_equal_rays_through_the_centres_of_pixels() {
    let text = room(INSIDE);
    let mut world = world(&text);
    let picture = world.picture("eye").expect("a picture");
    let tree = world.tree();
    let space = Space::new(&tree);
    let caster = space.caster("eye").expect("a frame");
    let (image, mut seen, mut silhouettes) = (&picture.image, std::collections::HashSet::new(), 0);
    for (at, depth) in image.depths.iter().enumerate() {
        let (column, row) = (at % image.width, at / image.width);
        let way = sensors::ray(&picture.camera, column as f64 + 0.5, row as f64 + 0.5);
        let (node, distance) = caster
            .cast(&way.normalize(), 1e5, &|_| true)
            .expect("a wall behind everything");
        if image.nodes[at] != Some(node) {
            silhouettes += 1;
            continue;
        }
        seen.insert(node);
        let expected = distance / way.norm();
        assert!(
            (depth / expected - 1.0).abs() < 1e-4,
            "{column}, {row}: {depth} {expected}"
        );
    }
    assert!(seen.len() >= 7, "only {} bodies", seen.len());
    assert!(silhouettes <= 5, "{silhouettes} pixels show another body");
}

#[test]
fn points_project_back_onto_their_pixels() {
    let mut world = world(&room(INSIDE));
    let picture = world.picture("eye").expect("a picture");
    let mut count = 0;
    for (at, point) in picture.points().enumerate() {
        let point = point.expect("a wall behind everything");
        let (u, v) = sensors::project(&picture.camera, &point).expect("in front");
        assert!(
            (u - (at % 160) as f64 - 0.5).abs() < 1e-9
                && (v - (at / 160) as f64 - 0.5).abs() < 1e-9
        );
        count += 1;
    }
    assert_eq!(count, 160 * 120);
}

#[test]
fn colours_have_the_shade_of_one_light() {
    let mut world = world(&room(INSIDE));
    let picture = world.picture("colours").expect("a picture");
    let tree = world.tree();
    let node = |id: &str| tree.node(id).expect("a node").node_id();
    let colours = |id: &str| -> Vec<[u8; 3]> {
        let pixels = picture.image.nodes.iter().zip(&picture.image.colours);
        let own = pixels.filter(|(seen, _)| **seen == Some(node(id)));
        own.map(|(_, colour)| *colour).collect()
    };
    // A wall has one shade, whatever the angle is from which it is seen.
    let wall = colours("north");
    assert!(
        wall.len() > 100 && wall.iter().all(|colour| *colour == wall[0]),
        "{wall:?}"
    );
    assert!(wall[0][0] == 0 && wall[0][2] > 60);
    // A ball is bright above and dark below.
    let ball = colours("ball");
    let bright = |colour: &[u8; 3]| u32::from(colour[0]);
    let (first, last) = (bright(&ball[0]), bright(ball.last().expect("a ball")));
    assert!(first > 2 * last, "{first} {last}");
    // No two nodes of the picture of ids have the same colour.
    let known: std::collections::HashSet<_> =
        id_colours(&tree).map(|(.., colour)| colour).collect();
    assert_eq!(known.len(), tree.len());
    assert!(
        picture
            .image
            .id_png(&tree)
            .expect("a file")
            .starts_with(b"\x89PNG")
    );
}

#[test]
fn errors_of_depth_leave_colours() {
    let text = room(INSIDE);
    let exact = world(&text).picture("eye").expect("a picture");
    let noisy = text.replace(
        r#"<rgbd id="eye""#,
        r#"<rgbd id="eye" noise="5" dropout="0.1""#,
    );
    let noisy = world(&noisy).picture("eye").expect("a picture");
    assert_eq!(noisy.image.colours, exact.image.colours);
    let lost = noisy
        .image
        .depths
        .iter()
        .filter(|depth| depth.is_infinite())
        .count();
    let part = lost as f64 / noisy.image.depths.len() as f64;
    assert!((part - 0.1).abs() < 0.01, "{part}");
    let pairs = noisy.image.depths.iter().zip(&exact.image.depths);
    let squares: Vec<f64> = pairs
        .filter(|(noisy, _)| noisy.is_finite())
        .map(|(noisy, exact)| (noisy - exact).powi(2))
        .collect();
    let sigma = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!((sigma / 5.0 - 1.0).abs() < 0.03, "{sigma}");
}

#[test]
fn a_change_is_in_the_next_picture() {
    let mut world = world(&room(INSIDE));
    let ball = world.tree().node("ball").expect("a node").node_id();
    let sees = |world: &mut innermodel_simulation::World| {
        let picture = world.picture("eye").expect("a picture");
        picture
            .image
            .nodes
            .iter()
            .filter(|node| **node == Some(ball))
            .count()
    };
    assert!(sees(&mut world) > 50);
    let behind = Pose::new(0.0, 500.0, -1500.0, 0.0, 0.0, 0.0);
    world.teleport("ball", "root", behind).expect("a place");
    world.step().expect("a step");
    assert_eq!(sees(&mut world), 0);
}

#[test]
fn a_picture_has_a_size_and_a_bound() {
    let inside = r#"<camera id="large" width="4096" height="4096" focal="100"/>
        <rgbd id="flat" width="64" height="48"/><camera id="none" focal="5"/>"#;
    let mut world = world(&room(inside));
    let mut text = |id| world.picture(id).expect_err("no picture").to_string();
    assert_eq!(
        text("large"),
        "`large` would measure 16777216 values; at most 4096000 are possible"
    );
    let unset = "has no pictures: its width, its height and its focal length must be set";
    assert_eq!(text("flat"), format!("`flat` {unset}"));
    assert_eq!(text("none"), format!("`none` {unset}"));
}
