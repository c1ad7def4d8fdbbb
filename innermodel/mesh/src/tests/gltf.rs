//! Tests of glTF.

use super::{problem, triangle, written};
use crate::{MeshError, TriangleMesh, read_with_looks};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

#[test]
fn nodes_have_transforms() {
    let mut bytes = Vec::new();
    for number in triangle().vertices.iter().flatten() {
        bytes.extend((*number as f32).to_le_bytes());
    }
    bytes.extend([0, 0, 1, 0, 2, 0]);
    let json = |buffer: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
            "nodes":[{{"children":[1],"translation":[10,0,0]}},
                {{"mesh":0,"scale":[2,2,2],"rotation":[0,0,0.7071067811865476,0.7071067811865476]}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},
                {{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],
            "buffers":[{{"byteLength":42{buffer}}}]}}"#
        )
    };
    let base64 = STANDARD.encode(&bytes);
    let inside = format!(r#","uri":"data:application/octet-stream;base64,{base64}""#);
    let text = written("a.gltf", json(&inside).as_bytes()).expect("a mesh");
    let json = json("");
    let json = format!(
        "{json}{}",
        " ".repeat(json.len().next_multiple_of(4) - json.len())
    );
    let mut glb = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    glb.extend((json.len() as u32).to_le_bytes());
    glb.extend(b"JSON");
    glb.extend(json.as_bytes());
    glb.extend((bytes.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(&bytes);
    assert_eq!(written("a.glb", &glb).expect("a mesh"), text);
    // A quarter of a turn about z, twice as large, ten to the right.
    let expected = [[10.0, 0.0, 0.0], [10.0, 2.0, 0.0], [6.0, 0.0, 1.0]];
    for (a, b) in text
        .vertices
        .iter()
        .flatten()
        .zip(expected.iter().flatten())
    {
        assert!((a - b).abs() < 1e-6, "{text:?}");
    }
    // A rotation that is not a unit quaternion turns, and does not scale.
    let long = written(
        "a.gltf",
        {
            let json = String::from_utf8_lossy(&glb[20..20 + json.len()]);
            let json = json.replace("[0,0,0.7071067811865476,0.7071067811865476]", "[0,0,3,3]");
            json.replace("\"byteLength\":42", &format!("\"byteLength\":42{inside}"))
                .as_bytes()
                .to_vec()
        }
        .as_slice(),
    )
    .expect("a mesh");
    for (a, b) in long
        .vertices
        .iter()
        .flatten()
        .zip(expected.iter().flatten())
    {
        assert!((a - b).abs() < 1e-6, "{long:?}");
    }
    for length in 0..glb.len() {
        let _ = written("a.glb", &glb[..length]);
    }
}

/// A file of primitives, each with its mode, the number of its vertices and its indices, over the
/// same four vertices.
fn primitives(list: &[(u32, usize, &[u8])]) -> Result<TriangleMesh, MeshError> {
    let mut bytes = Vec::new();
    for number in [
        [0.0_f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 1.0, 0.0],
    ]
    .as_flattened()
    {
        bytes.extend(number.to_le_bytes());
    }
    let (mut views, mut accessors, mut parts) = (String::new(), String::new(), Vec::new());
    for (at, (mode, count, indices)) in list.iter().enumerate() {
        let (start, length) = (bytes.len(), indices.len());
        bytes.extend(*indices);
        views += &format!(r#",{{"buffer":0,"byteOffset":{start},"byteLength":{length}}}"#);
        accessors += &format!(
            r#"{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3"}},
            {{"bufferView":{},"componentType":5121,"count":{length},"type":"SCALAR"}},"#,
            at + 1
        );
        let (points, corners) = (2 * at, 2 * at + 1);
        parts.push(format!(
            r#"{{"attributes":{{"POSITION":{points}}},"indices":{corners},"mode":{mode}}}"#
        ));
    }
    let (parts, accessors) = (parts.join(","), accessors.trim_end_matches(','));
    let json = format!(
        r#"{{"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{parts}]}}],
        "accessors":[{accessors}],"bufferViews":[{{"buffer":0,"byteLength":48}}{views}],
        "buffers":[{{"byteLength":{},"uri":"data:;base64,{}"}}]}}"#,
        bytes.len(),
        STANDARD.encode(&bytes)
    );
    written("a.gltf", json.as_bytes())
}

#[test]
fn strips_and_fans_are_triangles() {
    let mesh = primitives(&[
        (5, 4, &[0, 1, 2, 3]),
        (6, 4, &[0, 1, 3, 2]),
        (1, 4, &[0, 1]),
    ]);
    let mesh = mesh.expect("a mesh");
    assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2], [4, 5, 7], [4, 7, 6]]);
}

/// A primitive has its own vertices: those of another one are none of its corners.
#[test]
fn corners_are_vertices_of_their_primitive() {
    assert!(primitives(&[(4, 3, &[0, 1, 2]), (4, 3, &[0, 2, 1])]).is_ok());
    for wrong in [3, 255] {
        let found = primitives(&[(4, 3, &[0, 1, wrong]), (4, 3, &[0, 1, 2])]);
        let error = found.expect_err("a wrong corner").to_string();
        assert_eq!(error, "a triangle has a corner that does not exist");
    }
}

/// Few bytes that repeat each other a billion times are refused.
#[test]
fn what_repeats_has_a_bound() {
    let children = vec!["1"; 1000].join(",");
    let primitives = vec![r#"{"attributes":{}}"#; 2000].join(",");
    let json = format!(
        r#"{{"scenes":[{{"nodes":[0]}}],"nodes":[{{"children":[{children}]}},{{"mesh":0}}],
        "meshes":[{{"primitives":[{primitives}]}}]}}"#
    );
    let error = written("a.gltf", json.as_bytes()).expect_err("too many");
    assert_eq!(
        error.to_string(),
        "the scene has more than a million nodes and primitives"
    );
}

/// The count alone refuses them: the data, which are not there, are not read.
#[test]
fn triangles_have_a_bound_before_they_are_read() {
    for (mode, count) in [(4, 150_000_003), (5, 50_000_003), (6, 50_000_003)] {
        for (most, expected) in [
            (count, "the scene has more than 50 million triangles"),
            (3, "data of a mesh are missing"),
        ] {
            let json = format!(
                r#"{{"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
                "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"mode":{mode}}}]}}],
                "accessors":[{{"bufferView":0,"componentType":5126,"count":3}},
                {{"bufferView":0,"componentType":5121,"count":{most}}}]}}"#
            );
            let error = written("a.gltf", json.as_bytes()).expect_err("no mesh");
            assert_eq!(error.to_string(), expected, "{mode}");
        }
    }
}

/// A file of glTF over these bytes, with one triangle of the first accessor. `more` are further
/// members of its accessor, its primitive, its mesh, its node, and the file.
fn gltf_of(bytes: &[u8], views: &str, more: [&str; 5]) -> String {
    let [accessor, primitive, mesh, node, file] = more;
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0{node}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}{primitive}}}]{mesh}}}],
        "accessors":[{{"componentType":5126,"count":3,"type":"VEC3"{accessor}}}],
        "bufferViews":[{views}],
        "buffers":[{{"byteLength":{},"uri":"data:;base64,{}"}}]{file}}}"#,
        bytes.len(),
        STANDARD.encode(bytes)
    )
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.5];

/// Elements of an accessor that its sparse part changes, with and without data below.
#[test]
fn sparse_accessors_change_what_they_name() {
    let mut bytes = floats(&CORNERS);
    bytes.extend(floats(&[9.0, 8.0, 7.0]));
    bytes.extend([2]);
    let views = r#"{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12},
        {"buffer":0,"byteOffset":48,"byteLength":1}"#;
    let sparse = r#""sparse":{"count":1,"indices":{"bufferView":2,"componentType":5121},
        "values":{"bufferView":1}}"#;
    for (accessor, expected) in [
        (format!(r#","bufferView":0,{sparse}"#), [1.0, 0.0, 0.0]),
        (format!(",{sparse}"), [0.0; 3]),
    ] {
        let file = gltf_of(&bytes, views, [&accessor, "", "", "", ""]);
        let mesh = written("a.gltf", file.as_bytes()).expect("a mesh");
        assert_eq!(mesh.vertices, [[0.0; 3], expected, [9.0, 8.0, 7.0]]);
    }
    for (from, to, expected) in [
        (
            r#""count":1"#,
            r#""count":4"#,
            "a sparse accessor changes more elements than it has",
        ),
        (r#""count":1"#, r#""count":2"#, "data of a mesh are missing"),
        (
            "5121",
            "5126",
            "the places of vertices are not unsigned numbers",
        ),
        (
            r#""bufferView":2"#,
            r#""bufferView":0"#,
            "a sparse accessor changes what it lacks",
        ),
    ] {
        let mut accessor = format!(r#","bufferView":0,{sparse}"#).replace(from, to);
        if to == r#""bufferView":0"# {
            accessor = accessor
                .replace("5121", "5123")
                .replace(r#""count":1"#, r#""count":3"#);
        }
        let file = gltf_of(&bytes, views, [&accessor, "", "", "", ""]);
        let found = problem("a.gltf", file.as_bytes());
        assert!(
            found == expected || found == "data of a mesh are missing",
            "{found}: {to}"
        );
    }
    let zeros = gltf_of(&bytes, views, [&format!(",{sparse}"), "", "", "", ""]);
    let zeros = zeros.replace(r#""count":3"#, r#""count":10000001"#);
    let found = problem("a.gltf", zeros.as_bytes());
    assert_eq!(found, "an accessor has more than 10 million zeros");
}

#[test]
fn a_required_extension_is_read_or_refused() {
    let bytes = floats(&CORNERS);
    let view = r#"{"buffer":0,"byteLength":36}"#;
    let needs = |name: &str| {
        let file = format!(r#","extensionsRequired":["{name}"]"#);
        let file = gltf_of(&bytes, view, [r#","bufferView":0"#, "", "", "", &file]);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.gltf");
        std::fs::write(&path, file).expect("a file");
        read_with_looks(&path)
    };
    for shape in [
        "KHR_draco_mesh_compression",
        "EXT_meshopt_compression",
        "EXT_mesh_gpu_instancing",
    ] {
        let error = needs(shape).expect_err("no mesh").to_string();
        assert_eq!(
            error,
            format!(
                "the shape needs the extension `{shape}`, which is not read; export the file without it"
            )
        );
    }
    // Compressed data without others, though the file does not say that it needs the extension.
    let draco = r#","extensions":{"KHR_draco_mesh_compression":{"bufferView":0}}"#;
    let file = gltf_of(&bytes, view, ["", draco, "", "", ""]);
    let error = problem("a.gltf", file.as_bytes());
    assert!(
        error.contains("the extension `KHR_draco_mesh_compression`, which is not read"),
        "{error}"
    );
    let (mesh, looks) = needs("KHR_mesh_quantization").expect("a mesh");
    assert_eq!((mesh, looks.problems), (triangle(), Vec::new()));
    let (mesh, looks) = needs("KHR_texture_transform").expect("a mesh");
    assert_eq!(mesh, triangle());
    let expected = "its looks need the extension `KHR_texture_transform`, which is not read";
    assert_eq!(looks.problems, [expected]);
}

#[test]
fn morph_targets_have_the_weights_of_the_file() {
    let mut bytes = floats(&CORNERS);
    bytes.extend(floats(&[10.0, 0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 0.0, 30.0]));
    let views = r#"{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":36}"#;
    let second = r#","bufferView":0},{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3""#;
    let target = r#","targets":[{"POSITION":1}]"#;
    let read = |mesh: &str, node: &str| {
        let file = gltf_of(&bytes, views, [second, target, mesh, node, ""]);
        written("a.gltf", file.as_bytes()).map(|mesh| mesh.vertices)
    };
    let weights = r#","weights":[0.5]"#;
    let half = vec![[5.0, 0.0, 0.0], [1.0, 10.0, 0.0], [0.0, 2.0, 15.5]];
    assert_eq!(read("", "").expect("a mesh"), triangle().vertices);
    assert_eq!(read(weights, "").expect("a mesh"), half);
    // The weights of a node replace those of its mesh.
    assert_eq!(read("", weights).expect("a mesh"), half);
    let none = r#","weights":[0]"#;
    assert_eq!(read(weights, none).expect("a mesh"), triangle().vertices);
    let file = gltf_of(&bytes, views, [second, target, weights, "", ""]);
    let file = file.replacen(
        r#""count":3,"type":"VEC3"},{"#,
        r#""count":2,"type":"VEC3"},{"#,
        1,
    );
    let file = file.replacen(r#""count":3"#, r#""count":2"#, 1);
    let found = problem("a.gltf", file.as_bytes());
    assert_eq!(found, "a morph target has not one place for each vertex");
}

/// The vertices of a skin are where its joints are, wherever the node of the mesh is.
#[test]
fn skins_have_the_pose_of_their_joints() {
    let mut bytes = floats(&CORNERS);
    // The inverse of the place at which the first joint was bound, then of the second one.
    let bound = |x: f32| {
        let mut columns = [0.0; 16];
        for at in [0, 5, 10, 15] {
            columns[at] = 1.0;
        }
        columns[12] = x;
        floats(&columns)
    };
    bytes.extend([bound(0.0), bound(-1.0)].concat());
    bytes.extend([0, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    bytes.extend([255, 0, 0, 0, 255, 0, 0, 0, 51, 204, 0, 0]);
    let views = r#"{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":128},
        {"buffer":0,"byteOffset":164,"byteLength":12},{"buffer":0,"byteOffset":176,"byteLength":12}"#;
    let accessors = r#","bufferView":0},{"bufferView":1,"componentType":5126,"count":2,"type":"MAT4"},
        {"bufferView":2,"componentType":5121,"count":3,"type":"VEC4"},
        {"bufferView":3,"componentType":5121,"normalized":true,"count":3,"type":"VEC4""#;
    let skin = r#","skins":[{"joints":[1,2],"inverseBindMatrices":1}]"#;
    let file = gltf_of(
        &bytes,
        views,
        [
            accessors,
            "",
            "",
            r#","skin":0,"translation":[50,0,0]"#,
            skin,
        ],
    );
    let file = file.replace(
        r#""POSITION":0"#,
        r#""POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3"#,
    );
    let joints = r#"},{"children":[2],"translation":[0,0,100]},{"translation":[1,10,0]}]"#;
    let file = file.replace("[50,0,0]}]", &format!("[50,0,0]{joints}"));
    let mesh = written("a.gltf", file.as_bytes()).expect("a mesh");
    // The first corner follows the first joint, the second one the second, the third one both.
    let expected = [[0.0, 0.0, 100.0], [1.0, 10.0, 100.0], [0.0, 10.0, 100.5]];
    for (found, expected) in mesh
        .vertices
        .iter()
        .flatten()
        .zip(expected.iter().flatten())
    {
        assert!((found - expected).abs() < 1e-5, "{:?}", mesh.vertices);
    }
    for (from, to, expected) in [
        (
            r#""joints":[1,2]"#,
            r#""joints":[1]"#,
            "a vertex follows a joint that is missing",
        ),
        (
            r#""joints":[1,2]"#,
            r#""joints":[1,9]"#,
            "a joint of a skin is missing",
        ),
        (
            r#""children":[2]"#,
            r#""children":[1]"#,
            "nodes are nested more than 64 deep",
        ),
        (r#""skin":0"#, r#""skin":1"#, "a skin is missing"),
    ] {
        assert_eq!(
            problem("a.gltf", file.replace(from, to).as_bytes()),
            expected
        );
    }
}

#[test]
fn other_versions_of_gltf_are_named() {
    let old = r#"{"asset":{"version":"1.0"},"nodes":{"a":{}}}"#;
    let expected = "expected version 2.0 of glTF, found 1.0";
    assert_eq!(problem("a.gltf", old.as_bytes()), expected);
    let glb = b"glTF\x01\0\0\0\x14\0\0\0\0\0\0\0\0\0\0\0";
    assert_eq!(
        problem("a.glb", glb),
        "expected version 2.0 of glTF, found 1"
    );
    let bytes = floats(&CORNERS);
    let file = gltf_of(
        &bytes,
        r#"{"buffer":0,"byteLength":36}"#,
        [r#","bufferView":0"#, "", "", "", ""],
    );
    let flat = file.replace("VEC3", "VEC2");
    assert_eq!(
        problem("a.gltf", flat.as_bytes()),
        "an accessor is not of the type VEC3"
    );
    // Bytes that are written out, without base64.
    let text: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    let file = file.replace(
        &format!(";base64,{}", STANDARD.encode(&bytes)),
        &format!(",{text}"),
    );
    assert_eq!(
        written("a.gltf", file.as_bytes()).expect("a mesh"),
        triangle()
    );
}
