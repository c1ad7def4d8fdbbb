//! Scenes of glTF.

use crate::{model, scene};
use innermodel::{Kind, NodeId, Point, Vector};
use innermodel_collision::Space;
use innermodel_exchange::gltf;
use innermodel_mesh::AlphaMode;

/// Rays from the middle of a scene meet the exported triangles where they meet the bodies.
#[test]
fn bodies_are_where_they_were() {
    for name in ["arm.xml", "house.xml", "robot.xml"] {
        let document = scene(name);
        let (bytes, found) = gltf::write(&document);
        assert!(
            found.iter().all(|finding| finding.code == "lost-on-export"),
            "{name}"
        );
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.glb");
        std::fs::write(&path, bytes).expect("a file");
        // The file has metres, X to the left and Z to the front.
        let text = format!(
            r#"<innerModel><rotation id="turn" ry="3.141592653589793"><mesh id="all" file="{}" scale="1000"/></rotation></innerModel>"#,
            path.display()
        );
        let (exported, _) =
            innermodel::read_text(&text, "x.xml".as_ref(), &innermodel::Folders::default())
                .expect("a text");
        let before = Space::new(&model(&document).snapshot());
        let after = Space::new(&model(&exported).snapshot());
        let start = Point::new(137.0, 911.0, 263.0);
        let (mut hits, mut differ) = (0, 0);
        for at in 0..500 {
            // Directions that cover the sphere evenly: a spiral of Fibonacci.
            let y = 1.0 - (2.0 * f64::from(at) + 1.0) / 500.0;
            let angle = f64::from(at) * 2.399_963_229_728_653;
            let across = (1.0 - y * y).sqrt();
            let direction = Vector::new(across * angle.cos(), y, across * angle.sin());
            let meet = |space: &Space| {
                let hit = space.ray(NodeId::ROOT, start, direction, 1e5, &|_| true);
                hit.expect("the root").map(|hit| hit.distance)
            };
            let (before, after) = (meet(&before), meet(&after));
            if let (Some(before), Some(after)) = (before, after)
                && (before - after).abs() < 5.0
            {
                hits += 1;
            } else if before != after {
                differ += 1;
            }
        }
        // Flat triangles take the place of round bodies, which shows where a ray grazes one.
        assert!(differ <= 3, "{name}: {differ} of {hits}");
        assert!(hits > 20, "{name}: {hits}");
    }
}

/// Each triangle of a body of rotation or a box turns to the left, seen from outside.
#[test]
fn triangles_face_outwards() {
    for element in [
        r#"<sphere id="b" radius="100"/>"#,
        r#"<cylinder id="b" radius="50" length="300"/>"#,
        r#"<cone id="b" radius="50" length="300"/>"#,
        r#"<plane id="b" size="100,200,300" nx="1"/>"#,
    ] {
        let text = format!("<innerModel>{element}</innerModel>");
        let (document, _) =
            innermodel::read_text(&text, "x.xml".as_ref(), &innermodel::Folders::default())
                .expect("a text");
        let (bytes, _) = gltf::write(&document);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.glb");
        std::fs::write(&path, bytes).expect("a file");
        let read = innermodel_mesh::read(&path).expect("a scene");
        for corners in &read.triangles {
            let [a, b, c] = corners.map(|at| Vector::from(read.vertices[at as usize]));
            let normal = (b - a).cross(&(c - a));
            assert!(normal.dot(&(a + b + c)) > 0.0, "{element}: {a} {b} {c}");
        }
    }
}

/// The materials of a mesh file are those of the exported one, each on its triangle, with their
/// opacity.
#[test]
fn meshes_keep_their_colours() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    write(
        "two.mtl",
        "newmtl red\nKd 1 0.2 0\nnewmtl blue\nKd 0 0 0.5\nd 0.6\n",
    );
    let faces = "usemtl blue\nf 1 2 3\nusemtl red\nf 1 3 4\nusemtl none\nf 1 2 4\n";
    let text = format!("mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n{faces}");
    write("two.obj", &text);
    write(
        "world.xml",
        r#"<innerModel><mesh id="m" file="two.obj" scale="100"/></innerModel>"#,
    );
    let path = folder.path().join("world.xml");
    let read = innermodel::read(&path, &innermodel::Folders::default());
    let (bytes, found) = gltf::write(&read.expect("a world").0);
    assert!(found.is_empty());
    let path = folder.path().join("world.glb");
    std::fs::write(&path, bytes).expect("a file");
    let (mesh, looks) = innermodel_mesh::read_with_looks(&path).expect("a scene");
    assert_eq!(looks.problems, [""; 0]);
    // The farthest corner of each triangle from the first vertex tells which one it is.
    let mut seen: Vec<([i64; 3], [u8; 3], bool)> = Vec::new();
    for (triangle, look) in mesh.triangles.iter().zip(&looks.triangles) {
        let corners = triangle.map(|at| mesh.vertices[at as usize]);
        let sum = [0, 1, 2].map(|axis| {
            let sum: f64 = corners.iter().map(|corner| corner[axis]).sum();
            (sum.abs() * 10.0).round() as i64
        });
        let at = look.material.expect("a material") as usize;
        let material = &looks.materials[at];
        let is_seen_through = material.alpha_mode == AlphaMode::Blend;
        assert!((material.alpha - if is_seen_through { 0.6 } else { 1.0 }).abs() < 1e-6);
        seen.push((sum, material.colour, is_seen_through));
    }
    seen.sort_unstable();
    // Grey is the colour of bodies without one.
    let expected = [
        ([1, 1, 0], [180; 3], false),
        ([1, 2, 0], [255, 51, 0], false),
        ([2, 1, 0], [0, 0, 128], true),
    ];
    assert_eq!(seen, expected);
}

/// The names, the hierarchy and the cameras are those of the tree.
#[test]
fn nodes_have_their_names() {
    let document = scene("house.xml");
    let (bytes, _) = gltf::write(&document);
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let root: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).expect("JSON");
    let nodes = root["nodes"].as_array().expect("a list");
    assert_eq!(nodes.len(), document.nodes.len());
    for (node, written) in document.nodes.iter().zip(nodes) {
        assert_eq!(written["name"], node.id);
        let is_camera = matches!(node.kind, Kind::Camera(_) | Kind::Rgbd(_));
        assert_eq!(written["camera"].is_number(), is_camera, "{written}");
    }
    assert_eq!(root["cameras"].as_array().map(Vec::len), Some(2));
    assert_eq!(bytes.len() % 4, 0);
}
