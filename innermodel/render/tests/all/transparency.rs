//! Meshes through which others are seen, by pixels.

use crate::textures::from;
use innermodel::{Folders, InnerModel, Vector};
use innermodel_render::{Image, Scene};
use std::path::Path;

const RED: [u8; 3] = [255, 0, 0];
const GREEN: [u8; 3] = [0, 255, 0];

/// A square from −100 to 100 of a material that these lines describe.
fn write_square(folder: &Path, name: &str, material: &str) {
    let write = |ending: &str, text: String| {
        std::fs::write(folder.join(format!("{name}.{ending}")), text).expect("a file");
    };
    write("mtl", format!("newmtl skin\n{material}\n"));
    let corners = "v -100 -100 0\nv 100 -100 0\nv 100 100 0\nv -100 100 0\n";
    write(
        "obj",
        format!("mtllib {name}.mtl\n{corners}usemtl skin\nf 1 2 3 4\n"),
    );
}

/// The picture of a camera at z = −400 with the light behind it, so a surface that faces it has
/// exactly its own colour.
fn drawn(folder: &Path, inside: &str) -> (Image, InnerModel) {
    let path = folder.join("scene.xml");
    std::fs::write(&path, format!("<innerModel>{inside}</innerModel>")).expect("a file");
    let model = InnerModel::load(&path, &Folders::default()).expect("a model");
    let mut scene = Scene::new();
    scene.set_light(Some(-Vector::z()));
    let image = scene.draw(&model.snapshot(), &from(0.0, 0.0, -400.0));
    assert!(scene.problems().is_empty());
    (image.expect("an image"), model)
}

/// The colour at a pixel.
fn at(image: &Image, x: usize, y: usize) -> [u8; 3] {
    image.colours[y * image.width + x]
}

fn assert_near(seen: [u8; 3], expected: [u8; 3], what: &str) {
    let is_near = (0..3).all(|part| seen[part].abs_diff(expected[part]) <= 1);
    assert!(is_near, "{what}: {seen:?}, not {expected:?}");
}

#[test]
fn what_is_behind_a_material_is_seen_through_it() {
    let folder = tempfile::tempdir().expect("a folder");
    for (lines, expected) in [
        ("Kd 1 0 0\nd 0.25", [64, 191, 0]),
        ("Kd 1 0 0\nTr 0.25", [191, 64, 0]),
        ("Kd 1 0 0\nd -halo 0.25", [64, 191, 0]),
        ("d 0.25\nKd 1 0 0", [64, 191, 0]),
        ("Kd 1 0 0\nd 0", GREEN),
        ("Kd 1 0 0\nd 1", RED),
        ("Kd 1 0 0\nd 7", RED),
        ("Kd 1 0 0\nd nan", RED),
        ("Kd 1 0 0\nd", RED),
    ] {
        write_square(folder.path(), "glass", lines);
        let (image, model) = drawn(
            folder.path(),
            r##"<mesh id="glass" file="glass.obj"/>
            <plane id="wall" pz="200" size="2000,2000,2" texture="#00ff00"/>"##,
        );
        // Also at the edge that both triangles of the square share.
        for pixel in 30..70 {
            assert_near(at(&image, pixel, pixel), expected, lines);
            assert_near(at(&image, pixel, 99 - pixel), expected, lines);
        }
        assert_near(at(&image, 10, 50), GREEN, "beside the square");
        // Depth and node are those of the surface, unless nothing of it is seen.
        let (id, depth) = if expected == GREEN {
            ("wall", 599.0)
        } else {
            ("glass", 400.0)
        };
        let node = model.snapshot().node(id).expect("a node").node_id();
        assert_eq!(image.node(50, 50), Some(node), "{lines}");
        assert!((image.depths[50 * 100 + 50] - depth).abs() < 1e-6);
    }
}

/// The order in the file does not matter, and an opaque body hides what is behind it.
#[test]
fn the_nearest_of_several_layers_covers_the_others() {
    let folder = tempfile::tempdir().expect("a folder");
    write_square(folder.path(), "red", "Kd 1 0 0\nd 0.5");
    write_square(folder.path(), "blue", "Kd 0 0 1\nd 0.5");
    let red = r#"<mesh id="red" file="red.obj" tz="0"/>"#;
    let blue = r#"<mesh id="blue" file="blue.obj" tz="50"/>"#;
    let wall = r##"<plane id="wall" pz="200" size="2000,2000,2" texture="#00ff00"/>"##;
    for inside in [
        format!("{red}{blue}{wall}"),
        format!("{wall}{blue}{red}"),
        format!("{blue}{wall}{red}"),
    ] {
        let (image, _) = drawn(folder.path(), &inside);
        assert_near(at(&image, 50, 50), [128, 64, 64], &inside);
    }
    let board = r##"<plane id="board" pz="25" size="2000,2000,2" texture="#00ff00"/>"##;
    let (image, _) = drawn(folder.path(), &format!("{red}{blue}{board}"));
    assert_near(at(&image, 50, 50), [128, 128, 0], "a board between them");
    // Each of two squares that cross is in front on one side.
    let crossed = r#"<transform id="left" ry="0.5"><mesh id="red" file="red.obj"/></transform>
        <transform id="right" ry="-0.5"><mesh id="blue" file="blue.obj"/></transform>"#;
    let (image, _) = drawn(folder.path(), &format!("{crossed}{wall}"));
    let (one, other) = (at(&image, 40, 50), at(&image, 60, 50));
    assert!(one[0] > one[2] + 40 || one[2] > one[0] + 40, "{one:?}");
    assert_near([one[2], one[1], one[0]], other, "the sides differ");
}

/// Half of the picture is opaque, the other half lets a third of the light through.
fn gltf(folder: &Path, material: &str) -> Image {
    let mut data = Vec::new();
    let corners: [f32; 12] = [
        -100.0, -100.0, 0.0, 100.0, -100.0, 0.0, 100.0, 100.0, 0.0, -100.0, 100.0, 0.0,
    ];
    let places: [f32; 8] = [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    for number in corners.iter().chain(&places) {
        data.extend(number.to_le_bytes());
    }
    data.extend([0, 1, 2, 0, 2, 3]);
    std::fs::write(folder.join("mesh.bin"), &data).expect("a file");
    let file = std::fs::File::create(folder.join("picture.png")).expect("a file");
    let mut encoder = png::Encoder::new(file, 2, 1);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("a header");
    let pixels = [255, 0, 0, 255, 255, 0, 0, 85];
    writer.write_image_data(&pixels).expect("data");
    drop(writer);
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2,"material":0}}]}}],
        "materials":[{material}],"textures":[{{"source":0}}],"images":[{{"uri":"picture.png"}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
            {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},
            {{"bufferView":2,"componentType":5121,"count":6,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":32}},
            {{"buffer":0,"byteOffset":80,"byteLength":6}}],
        "buffers":[{{"byteLength":86,"uri":"mesh.bin"}}]}}"#
    );
    std::fs::write(folder.join("mesh.gltf"), text).expect("a file");
    let wall = r##"<plane id="wall" pz="200" size="2000,2000,2" texture="#00ff00"/>"##;
    drawn(
        folder,
        &format!(r#"<mesh id="mesh" file="mesh.gltf"/>{wall}"#),
    )
    .0
}

#[test]
fn alpha_modes_of_gltf_are_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = r#""baseColorTexture":{"index":0}"#;
    for (mode, factor, left, right) in [
        ("", "0.5", RED, RED),
        (r#","alphaMode":"OPAQUE""#, "0.5", RED, RED),
        (r#","alphaMode":"BLEND""#, "1", RED, [85, 170, 0]),
        (
            r#","alphaMode":"BLEND""#,
            "0.5",
            [128, 128, 0],
            [43, 213, 0],
        ),
        (r#","alphaMode":"MASK""#, "1", RED, GREEN),
        (r#","alphaMode":"MASK","alphaCutoff":0.2"#, "1", RED, RED),
        (
            r#","alphaMode":"MASK","alphaCutoff":0.2"#,
            "0.5",
            RED,
            GREEN,
        ),
    ] {
        let material = format!(
            r#"{{"pbrMetallicRoughness":{{{picture},"baseColorFactor":[1,1,1,{factor}]}}{mode}}}"#
        );
        let image = gltf(folder.path(), &material);
        assert_near(at(&image, 35, 50), left, &material);
        assert_near(at(&image, 65, 50), right, &material);
        // A hole is one in depths, too.
        let is_hole = mode.contains("MASK") && right == GREEN;
        let depth = image.depths[50 * 100 + 65];
        assert!((depth - if is_hole { 599.0 } else { 400.0 }).abs() < 1e-6);
    }
}

/// Of more layers than are drawn, the nearest ones count, and the body behind all is seen.
#[test]
fn layers_have_a_bound() {
    let folder = tempfile::tempdir().expect("a folder");
    write_square(folder.path(), "pane", "Kd 1 0 0\nd 0.01");
    let panes = (0..40).map(|n| format!(r#"<mesh id="p{n}" file="pane.obj" tz="{n}"/>"#));
    let wall = r##"<plane id="wall" pz="200" size="2000,2000,2" texture="#00ff00"/>"##;
    let (image, model) = drawn(folder.path(), &(panes.collect::<String>() + wall));
    let first = model.snapshot().node("p0").expect("a node").node_id();
    assert_eq!(image.node(50, 50), Some(first));
    let seen = at(&image, 50, 50);
    assert!(
        (36..=87).contains(&seen[0]) && seen[1] == 255 - seen[0],
        "{seen:?}"
    );
}
