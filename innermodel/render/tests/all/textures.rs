//! Textures of boxes and wireframes, by pixels.

use innermodel::{Folders, InnerModel, Point};
use innermodel_render::{Image, Scene, View, look_at};
use std::path::Path;

pub(crate) const RED: [u8; 3] = [220, 30, 30];
pub(crate) const GREEN: [u8; 3] = [30, 200, 30];
pub(crate) const BLUE: [u8; 3] = [30, 30, 220];
pub(crate) const YELLOW: [u8; 3] = [220, 220, 30];
/// Top left, top right, bottom left, bottom right.
pub(crate) const QUARTERS: [[u8; 3]; 4] = [RED, GREEN, BLUE, YELLOW];

/// A picture of four quarters as PNG.
pub(crate) fn write_png(path: &Path) {
    let (side, mut data) = (8_usize, Vec::new());
    for at in 0..side * side {
        let (x, y) = (at % side / (side / 2), at / side / (side / 2));
        data.extend(QUARTERS[y * 2 + x]);
    }
    let file = std::fs::File::create(path).expect("a file");
    let mut encoder = png::Encoder::new(file, side as u32, side as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&data).expect("data");
}

/// A scene in a folder with `quarters.png`, `quarters.jpg`, `broken.png` and `frame.obj`.
pub(crate) fn load(inside: &str) -> (tempfile::TempDir, InnerModel, String) {
    let folder = tempfile::tempdir().expect("a folder");
    write_png(&folder.path().join("quarters.png"));
    let jpeg = include_bytes!("quarters.jpg");
    std::fs::write(folder.path().join("quarters.jpg"), jpeg).expect("a file");
    std::fs::write(folder.path().join("broken.png"), &jpeg[..300]).expect("a file");
    let square = "v -100 -100 0\nv 100 -100 0\nv 100 100 0\nv -100 100 0\nf 1 2 3 4\n";
    std::fs::write(folder.path().join("frame.obj"), square).expect("a file");
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, format!("<innerModel>{inside}</innerModel>")).expect("a file");
    let (document, warnings) = innermodel::read(&path, &Folders::default()).expect("a scene");
    let model = InnerModel::from_document(&document).expect("a model");
    (folder, model, warnings)
}

pub(crate) fn from(x: f64, y: f64, z: f64) -> View {
    let camera = innermodel::kinds::Camera {
        width: 100.0,
        height: 100.0,
        focal: 100.0,
    };
    look_at(Point::new(x, y, z), Point::origin(), camera)
}

/// The colours at the middles of the four quarters of an image. The body fills most of it.
pub(crate) fn quarters(image: &Image) -> [[u8; 3]; 4] {
    [(35, 35), (65, 35), (35, 65), (65, 65)].map(|(x, y)| image.colours[y * image.width + x])
}

/// The light is at the camera, so what faces it has nearly its own colour. JPEG loses some.
pub(crate) fn assert_shows(image: &Image, expected: [[u8; 3]; 4], what: &str) {
    for (seen, expected) in quarters(image).iter().zip(expected) {
        for (seen, expected) in seen.iter().zip(expected) {
            assert!(
                seen.abs_diff(expected) <= 12,
                "{what}: {:?}",
                quarters(image)
            );
        }
    }
}

#[test]
fn each_side_of_a_box_shows_its_texture_upright() {
    for file in ["quarters.png", "quarters.jpg"] {
        let text = format!(r#"<plane id="box" size="200,200,200" texture="{file}"/>"#);
        let (_folder, model, warnings) = load(&text);
        assert_eq!(warnings, "");
        let (tree, mut scene) = (model.snapshot(), Scene::new());
        let mut shows = |(x, y, z): (f64, f64, f64), what: &str| {
            let image = scene.draw(&tree, &from(x, y, z)).expect("an image");
            assert_shows(&image, QUARTERS, &format!("{file}, {what}"));
        };
        shows((0.0, 0.0, -400.0), "front");
        shows((0.0, 0.0, 400.0), "back");
        shows((-400.0, 0.0, 0.0), "left");
        shows((400.0, 0.0, 0.0), "right");
        assert!(scene.problems().is_empty());
    }
}

/// A floor and a wall that are turned by their normals, and a node that is turned.
#[test]
fn textures_follow_the_box() {
    let text = r#"<transform id="turned" rz="3.14159265358979">
        <plane id="wall" size="200,200,10" texture="quarters.png"/></transform>"#;
    let (_folder, model, _) = load(text);
    let image = Scene::new().draw(&model.snapshot(), &from(0.0, 0.0, -400.0));
    assert_shows(
        &image.expect("an image"),
        [YELLOW, BLUE, GREEN, RED],
        "upside down",
    );
    let (_folder, model, _) =
        load(r#"<plane id="floor" ny="1" size="200,200,10" texture="quarters.png"/>"#);
    let image = Scene::new().draw(&model.snapshot(), &from(0.0, 400.0, -1.0));
    assert_shows(&image.expect("an image"), QUARTERS, "from above");
}

#[test]
fn what_cannot_be_read_is_grey_and_reported() {
    let (_folder, model, warnings) = load(
        r#"<plane id="missing" size="200,200,10" texture="bricks.jpg"/>
<plane id="broken" pz="500" size="200,200,10" texture="broken.png"/>"#,
    );
    let expected = "scene.xml:1:60: warning[missing-texture]: cannot find the texture `bricks.jpg`";
    assert!(warnings.contains(expected), "{warnings}");
    let mut scene = Scene::new();
    let tree = model.snapshot();
    let image = scene
        .draw(&tree, &from(0.0, 0.0, -400.0))
        .expect("an image");
    assert_shows(&image, [[180; 3]; 4], "grey");
    let problems: Vec<String> = scene
        .problems()
        .iter()
        .map(|problem| format!("{}: {}", problem.id, problem.error))
        .collect();
    assert_eq!(problems.len(), 2, "{problems:?}");
    assert_eq!(
        problems[0],
        "missing: its texture: the file was not found when the node was read"
    );
    assert!(
        problems[1].starts_with("broken: its texture: "),
        "{problems:?}"
    );
    // Each file is read once, so it is reported once.
    scene
        .draw(&tree, &from(0.0, 0.0, -400.0))
        .expect("an image");
    assert!(scene.problems().is_empty());
}

#[test]
fn a_wireframe_has_edges_only() {
    let (_folder, model, warnings) = load(
        r##"<mesh id="mesh" file="frame.obj" render="wireframe"/>
<plane id="behind" pz="200" size="900,900,10" texture="#ff0000"/>"##,
    );
    assert_eq!(warnings, "");
    let tree = model.snapshot();
    let image = Scene::new().draw(&tree, &from(0.0, 0.0, -400.0));
    let image = image.expect("an image");
    let id = |name: &str| Some(tree.node(name).expect("a node").node_id());
    // The square is 50 pixels wide. Its middle row crosses three edges.
    assert_eq!(image.node(50, 40), id("behind"));
    let row = |y: usize| -> Vec<usize> {
        let columns = 0..image.width;
        columns
            .filter(|x| image.node(*x, y) == id("mesh"))
            .collect()
    };
    let seen = row(40);
    assert!((3..=9).contains(&seen.len()), "{seen:?}");
    assert!(
        (25..=26).contains(&seen[0]) && (73..=75).contains(&seen[seen.len() - 1]),
        "{seen:?}"
    );
    assert!(row(25).len() > 45, "{:?}", row(25));
}
