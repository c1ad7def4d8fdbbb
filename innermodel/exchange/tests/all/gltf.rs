//! Scenes of glTF.

use crate::{model, scene};
use innermodel::{Kind, Point, Vector};
use innermodel_exchange::gltf;

/// The triangles of the file are where the bodies are: x to the left, in metres.
#[test]
fn bodies_are_where_they_were() {
    for name in ["arm.xml", "house.xml"] {
        let document = scene(name);
        let (bytes, found) = gltf::write(&document);
        assert!(
            found.iter().all(|finding| finding.code == "lost-on-export"),
            "{name}"
        );
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.glb");
        std::fs::write(&path, bytes).expect("a file");
        let read = innermodel_mesh::read(&path).expect("a scene");
        let tree = model(&document).snapshot();
        let bodies = tree.nodes().filter(|node| {
            matches!(
                node.kind(),
                Kind::Plane(_) | Kind::Display(_) | Kind::Solid(_) | Kind::Mesh(_)
            )
        });
        assert!(bodies.count() > 10);
        let bounds = |points: &mut dyn Iterator<Item = Point>| {
            let first = points.next().expect("a point");
            points.fold((first, first), |(a, b), p| (a.inf(&p), b.sup(&p)))
        };
        let mut drawn = read
            .vertices
            .iter()
            .map(|[x, y, z]| Point::new(-x, *y, *z) * 1000.0);
        let drawn = bounds(&mut drawn);
        let mut floor = [-1.0, 1.0].into_iter().flat_map(|side| {
            let Kind::Plane(plane) = tree.node("floor").expect("a node").kind().clone() else {
                panic!("a plane");
            };
            // The floor lies: its width, depth and height are along x, z and y, or z along −y.
            let centre = Point::from(plane.point);
            let half = Vector::from(plane.size) / 2.0;
            [centre + Vector::new(half.x, 0.0, half.y) * side]
        });
        let floor = bounds(&mut floor);
        assert!((drawn.0.x - floor.0.x).abs() < 60.0, "{drawn:?} {floor:?}");
        assert!((drawn.1.z - floor.1.z).abs() < 60.0, "{drawn:?} {floor:?}");
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
