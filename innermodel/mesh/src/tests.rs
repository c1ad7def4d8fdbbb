//! Tests of the readers.

use crate::{Looks, MeshError, Picture, TriangleMesh, Wrap, read, read_with_looks};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::path::PathBuf;

fn written(name: &str, bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    let folder = tempfile::tempdir().expect("a folder");
    let path: PathBuf = folder.path().join(name);
    std::fs::write(&path, bytes).expect("a file");
    read(&path)
}

fn triangle() -> TriangleMesh {
    TriangleMesh {
        vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.5]],
        triangles: vec![[0, 1, 2]],
    }
}

#[test]
fn obj() {
    let text = "# a\nv 0 0 0\nv 1 0 0 1.0\nvn 0 0 1\nv 0 2e0 .5\nf 1/1/1 2//1 -1\n";
    assert_eq!(
        written("a.OBJ", text.as_bytes()).expect("a mesh"),
        triangle()
    );
    let quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4";
    let quad = written("a.obj", quad.as_bytes()).expect("a mesh");
    assert_eq!(quad.triangles, [[0, 1, 2], [0, 2, 3]]);
    for bad in [
        "v 0 0\nf 1 1 1",
        "v 0 0 0\nf 1 2 3",
        "v 0 0 0\nf a b c",
        "v 0 0 nan\nf 1 1 1",
    ] {
        assert!(
            matches!(written("a.obj", bad.as_bytes()), Err(MeshError::Wrong(_))),
            "{bad}"
        );
    }
    assert!(matches!(
        written("a.obj", b"v 0 0 0"),
        Err(MeshError::Empty)
    ));
}

#[test]
fn stl() {
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 0.5\nendloop\nendfacet\nendsolid a\n";
    assert_eq!(
        written("a.stl", text.as_bytes()).expect("a mesh"),
        triangle()
    );
    let mut bytes = vec![b's'; 80];
    bytes[..5].copy_from_slice(b"solid");
    bytes.extend(1_u32.to_le_bytes());
    bytes.extend([0; 12]);
    for number in triangle().vertices.iter().flatten() {
        bytes.extend((*number as f32).to_le_bytes());
    }
    bytes.extend([0; 2]);
    assert_eq!(written("a.stl", &bytes).expect("a mesh"), triangle());
    bytes.pop();
    assert!(matches!(written("a.stl", &bytes), Err(MeshError::Empty)));
    assert!(matches!(
        written("a.stl", b"nothing"),
        Err(MeshError::Wrong(_))
    ));
}

#[test]
fn gltf() {
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
    for length in 0..glb.len() {
        let _ = written("a.glb", &glb[..length]);
    }
}

#[test]
fn other_formats_say_how_to_convert() {
    let error = written("a.osg", b"").err().map(|error| error.to_string());
    assert_eq!(
        error.as_deref(),
        Some(
            "cannot read .osg; convert it to .obj first: `osgconv FILE FILE.obj` of OpenSceneGraph does it"
        )
    );
    assert!(matches!(
        written("a.3ds", b""),
        Err(MeshError::NeedsConversion(..))
    ));
    assert!(matches!(
        written("a.txt", b""),
        Err(MeshError::UnknownFormat(_))
    ));
    assert!(matches!(
        read("/nowhere.obj".as_ref()),
        Err(MeshError::Unreadable(_))
    ));
    assert!(matches!(
        read("/dev/null.obj/..".as_ref()),
        Err(MeshError::UnknownFormat(_))
    ));
}

/// However a file of materials is cut, there is one look for each triangle, and each material that
/// is named exists.
#[test]
fn looks_fit_their_mesh() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.obj");
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt nan 1\n\
        usemtl a\nf 1/1 2/2 3/3 4/-1\nf 1 2\nusemtl b\nf 1/9 2/x 3/\nusemtl\nf 1 2 3\n";
    std::fs::write(&path, obj).expect("a file");
    let mtl = "map_Kd early.png\nnewmtl a\nKd 1 0 2\nmap_Kd -s 2 -mm 0 1 -o 1 2 3 -clamp on p.png\n\
        newmtl b\nKd spectral x\nmap_Kd -s\nmap_Kd\nnewmtl b\nKd 0.5\n";
    let look = |mtl: &str| -> Looks {
        std::fs::write(folder.path().join("a.mtl"), mtl).expect("a file");
        let (mesh, looks) = read_with_looks(&path).expect("a mesh");
        assert_eq!(mesh, read(&path).expect("a mesh"));
        assert_eq!(looks.triangles.len(), mesh.triangles.len());
        for look in &looks.triangles {
            let count = looks.materials.len() as u32;
            assert!(look.material.is_none_or(|at| at < count), "{mtl}");
            assert!(look.corners.iter().flatten().all(|n| n.is_finite()));
        }
        looks
    };
    for length in 0..mtl.len() {
        look(&mtl[..length]);
    }
    let looks = look(mtl);
    let places: Vec<Option<u32>> = looks.triangles.iter().map(|look| look.material).collect();
    // Of two materials with one name, the later one holds.
    assert_eq!(places, [Some(0), Some(0), Some(2), None]);
    assert_eq!(looks.materials[0].colour, [255, 0, 255]);
    assert_eq!(looks.materials[0].wrap, [Wrap::Clamp; 2]);
    let picture = Picture::File(folder.path().join("p.png"));
    assert_eq!(looks.materials[0].picture, Some(picture));
    assert_eq!(looks.materials[2].colour, [128; 3]);
    // Twice as large and moved; upwards becomes downwards.
    assert_eq!(looks.triangles[0].corners[1], [3.0, -1.0]);
}

#[test]
fn materials_and_their_files_have_bounds() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let face = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
    std::fs::write(at("a.mtl"), "newmtl a\n".repeat(10_001)).expect("a file");
    std::fs::write(at("a.obj"), format!("mtllib a.mtl\n{face}")).expect("a file");
    let (_, looks) = read_with_looks(&at("a.obj")).expect("a mesh");
    assert_eq!(looks.materials.len(), 10_000);
    assert_eq!(looks.problems, ["it has more than 10000 materials"]);
    let large = std::fs::File::create(at("large.mtl")).expect("a file");
    large.set_len((16 << 20) + 1).expect("a length");
    std::fs::write(
        at("a.obj"),
        format!("mtllib large.mtl\nmtllib ../x\u{7}\n{face}"),
    )
    .expect("a file");
    let (_, looks) = read_with_looks(&at("a.obj")).expect("a mesh");
    let [large, missing] = &looks.problems[..] else {
        panic!("{:?}", looks.problems);
    };
    assert_eq!(
        large,
        "its materials in `large.mtl`: expected at most 16 MiB"
    );
    assert!(
        missing.starts_with("its materials in `../x\\u{7}`: No such file"),
        "{missing}"
    );
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
        assert_eq!(error, "a triangle has a corner that is not there");
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
