//! Colours and pictures of meshes, by pixels.

use crate::textures::{BLUE, GREEN, QUARTERS, RED, YELLOW, assert_shows, from, write_png};
use innermodel::{Folders, InnerModel, sensors};
use innermodel_render::{Image, Scene};
use std::path::Path;

/// A square from −100 to 100 with the whole picture on it, seen from −z: a file's z is mirrored.
const SQUARE: &str = "v -100 -100 0\nv 100 -100 0\nv 100 100 0\nv -100 100 0\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

/// The camera's picture of `mesh.NAME` in the folder, and the findings.
fn drawn(folder: &Path, file: &str) -> (Image, Vec<String>) {
    let path = folder.join("scene.xml");
    let text = format!(r#"<innerModel><mesh id="mesh" file="{file}"/></innerModel>"#);
    std::fs::write(&path, text).expect("a file");
    let model = InnerModel::load(&path, &Folders::default()).expect("a model");
    let mut scene = Scene::new();
    let tree = model.snapshot();
    let image = scene
        .draw(&tree, &from(0.0, 0.0, -400.0))
        .expect("an image");
    let problems = scene.problems();
    // The next picture reads no file again.
    let again = scene.draw(&tree, &from(0.0, 0.0, -400.0));
    assert_eq!(again.expect("an image"), image);
    assert!(scene.problems().is_empty());
    (
        image,
        problems.iter().map(|p| p.error.to_string()).collect(),
    )
}

/// A square whose material is described by these lines.
fn square(material: &str, faces: &str) -> (Image, Vec<String>) {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    write_png(&at("quarters.png"));
    write_png(&at("my quarters.png"));
    std::fs::write(at("quarters.jpg"), include_bytes!("quarters.jpg")).expect("a file");
    std::fs::write(at("my colours.mtl"), format!("newmtl skin\n{material}\n")).expect("a file");
    let text = format!("mtllib my colours.mtl\n{SQUARE}usemtl skin\n{faces}\n");
    std::fs::write(at("mesh.obj"), text).expect("a file");
    drawn(folder.path(), "mesh.obj")
}

const WHOLE: &str = "f 1/1 2/2 3/3 4/4";

#[test]
fn pictures_of_obj_files_are_where_their_places_say() {
    for file in [
        "quarters.png",
        "quarters.jpg",
        "my quarters.png",
        "/home/another/quarters.png",
        r"C:\models\quarters.png",
    ] {
        let (image, problems) = square(&format!("Kd 1 1 1\nmap_Kd {file}"), WHOLE);
        assert_eq!(problems, [""; 0]);
        assert_shows(&image, QUARTERS, file);
    }
    let (image, _) = square("map_Kd quarters.png", "f 1/2 2/3 3/4 4/1");
    assert_shows(&image, [BLUE, RED, YELLOW, GREEN], "turned");
    let (image, _) = square("map_Kd -s -1 1 1 quarters.png", WHOLE);
    assert_shows(&image, [GREEN, RED, YELLOW, BLUE], "mirrored");
    let (image, _) = square("map_Kd -blendu on -o 0 0.5 quarters.png", WHOLE);
    assert_shows(&image, [BLUE, YELLOW, RED, GREEN], "moved");
    let (image, _) = square("map_Kd -o 0.5 -clamp on quarters.png", WHOLE);
    assert_shows(&image, [GREEN, GREEN, YELLOW, YELLOW], "clamped");
}

#[test]
fn colours_of_materials_tint_and_need_no_picture() {
    let (image, problems) = square("Kd 0.5 0.25 1", WHOLE);
    assert_eq!(problems, [""; 0]);
    assert_shows(&image, [[128, 64, 255]; 4], "a colour");
    let (image, _) = square("Kd 0.5 0.5 0.5\nmap_Kd quarters.png", WHOLE);
    let half = QUARTERS.map(|colour| colour.map(|part| part / 2));
    assert_shows(&image, half, "tinted");
    let (image, _) = square("Kd 1 0 0", "usemtl nothing\nf 1 2 3 4");
    assert_shows(&image, [[180; 3]; 4], "no such material");
}

/// A picture far away is not stretched: what is nearer has larger parts.
#[test]
fn pictures_are_seen_in_perspective() {
    let folder = tempfile::tempdir().expect("a folder");
    write_png(&folder.path().join("quarters.png"));
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    write("c.mtl", "newmtl skin\nmap_Kd quarters.png\n");
    // A floor at y = −100 from z = −200 to 600, its picture's upper side far away.
    let floor = "mtllib c.mtl\nv -100 -100 200\nv 100 -100 200\nv 100 -100 -600\nv -100 -100 -600\n\
        vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl skin\nf 1/1 2/2 3/3 4/4\n";
    write("mesh.obj", floor);
    let (image, problems) = drawn(folder.path(), "mesh.obj");
    assert_eq!(problems, [""; 0]);
    let view = from(0.0, 0.0, -400.0);
    let mut count = 0;
    for (x, z) in [(-50.0, 150.0), (50.0, 150.0), (-50.0, 250.0), (50.0, 250.0)] {
        let point = view
            .place
            .inverse()
            .point(&innermodel::Point::new(x, -100.0, z));
        let (u, v) = sensors::project(&view.camera, &point).expect("a pixel");
        let expected = QUARTERS[usize::from(x > 0.0) + if z > 200.0 { 0 } else { 2 }];
        let seen = image.colours[v as usize * image.width + u as usize];
        // It is seen from the side, so it is darker, but has the same hue.
        let hue =
            |colour: [u8; 3]| colour.map(|part| part > *colour.iter().max().expect("a part") / 2);
        assert_eq!(hue(seen), hue(expected), "({x}, {z}): {seen:?}");
        count += 1;
    }
    assert_eq!(count, 4);
}

fn gltf(folder: &Path, wrap: u32, image: &str, places: [f32; 8]) -> (Image, Vec<String>) {
    let mut data = Vec::new();
    let corners: [f32; 12] = [
        -100.0, -100.0, 0.0, 100.0, -100.0, 0.0, 100.0, 100.0, 0.0, -100.0, 100.0, 0.0,
    ];
    for number in corners.iter().chain(&places) {
        data.extend(number.to_le_bytes());
    }
    data.extend([0, 1, 2, 0, 2, 3]);
    std::fs::write(folder.join("data of it.bin"), &data).expect("a file");
    let png = std::fs::read(folder.join("quarters.png")).expect("a picture");
    std::fs::write(folder.join("more.bin"), &png).expect("a file");
    let length = png.len();
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2,"material":0}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
        "textures":[{{"source":0,"sampler":0}}],"samplers":[{{"wrapS":{wrap},"wrapT":{wrap}}}],
        "images":[{image}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
            {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},
            {{"bufferView":2,"componentType":5121,"count":6,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":32}},
            {{"buffer":0,"byteOffset":80,"byteLength":6}},{{"buffer":1,"byteLength":{length}}}],
        "buffers":[{{"byteLength":86,"uri":"data%20of%20it.bin"}},{{"byteLength":{length},"uri":"more.bin"}}]}}"#
    );
    std::fs::write(folder.join("mesh.gltf"), text).expect("a file");
    drawn(folder, "mesh.gltf")
}

/// glTF counts downwards.
const UPRIGHT: [f32; 8] = [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];

#[test]
fn base_colour_textures_of_gltf_files_are_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    write_png(&path.join("quarters.png"));
    let png = std::fs::read(path.join("quarters.png")).expect("a picture");
    let inside = format!(
        r#"{{"uri":"data:image/png;base64,{}"}}"#,
        base64::Engine::encode(&base64::engine::general_purpose::STANDARD, png)
    );
    for image in [r#"{"uri":"quarters.png"}"#, r#"{"bufferView":3}"#, &inside] {
        let (seen, problems) = gltf(path, 10497, image, UPRIGHT);
        assert_eq!(problems, [""; 0], "{image}");
        assert_shows(&seen, QUARTERS, image);
    }
    // From half of the picture to half of the next one.
    let moved = UPRIGHT.map(|at| at + 0.5);
    let file = r#"{"uri":"quarters.png"}"#;
    let (seen, _) = gltf(path, 10497, file, moved);
    assert_shows(&seen, [YELLOW, BLUE, GREEN, RED], "repeated");
    let (seen, _) = gltf(path, 33071, file, moved);
    assert_shows(&seen, [YELLOW; 4], "clamped");
    let (seen, _) = gltf(path, 33648, file, UPRIGHT.map(|at| at + 1.0));
    assert_shows(&seen, [YELLOW, BLUE, GREEN, RED], "mirrored");
}

#[test]
fn what_cannot_be_read_of_materials_is_reported() {
    let (image, problems) = square("Kd 1 0 0\nmap_Kd nothing.png", WHOLE);
    assert_shows(&image, [[255, 0, 0]; 4], "the colour alone");
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert!(
        problems[0].starts_with("its texture: No such file"),
        "{problems:?}"
    );
    let (_, problems) = square("map_Kd my colours.mtl", WHOLE);
    assert_eq!(problems, ["its texture: expected a picture in PNG or JPEG"]);
    let (_, problems) = square("map_Kd ../../../../../../../../../dev/zero", WHOLE);
    assert_eq!(problems.len(), 1, "{problems:?}");
    let folder = tempfile::tempdir().expect("a folder");
    let text = format!("mtllib other.mtl\n{SQUARE}{WHOLE}\n");
    std::fs::write(folder.path().join("mesh.obj"), text).expect("a file");
    let (image, problems) = drawn(folder.path(), "mesh.obj");
    assert_shows(&image, [[180; 3]; 4], "without colours");
    assert!(
        problems[0].starts_with("its materials in `other.mtl`: No such file"),
        "{problems:?}"
    );
    write_png(&folder.path().join("quarters.png"));
    let (image, problems) = gltf(folder.path(), 10497, r#"{"bufferView":9}"#, UPRIGHT);
    assert_shows(&image, [[255; 3]; 4], "the colour alone");
    assert_eq!(problems, ["a picture is missing"]);
}

/// Eight thousand pixels in each direction, three times: the third picture is one too many.
#[test]
fn pictures_have_a_bound_together() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let (mut materials, mut faces) = (String::new(), String::from(SQUARE));
    for number in 0..3 {
        let file = std::fs::File::create(at(&format!("{number}.png"))).expect("a file");
        let mut encoder = png::Encoder::new(file, 8192, 8192);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::One);
        let mut writer = encoder.write_header().expect("a header");
        writer
            .write_image_data(&vec![0; 8192 * 1024])
            .expect("data");
        materials += &format!("newmtl m{number}\nmap_Kd {number}.png\n");
        faces += &format!("usemtl m{number}\nf 1/1 2/2 3/3\n");
    }
    std::fs::write(at("all.mtl"), materials).expect("a file");
    std::fs::write(at("mesh.obj"), format!("mtllib all.mtl\n{faces}")).expect("a file");
    let (_, problems) = drawn(folder.path(), "mesh.obj");
    let expected = "its texture: expected at most 134217728 pixels in all pictures of the scene";
    assert_eq!(problems, [expected]);
}
