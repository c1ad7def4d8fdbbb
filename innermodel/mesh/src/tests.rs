//! Tests of the readers.

mod gltf;

use crate::{Looks, MeshError, Picture, TriangleMesh, Wrap, read, read_with_looks};
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
    assert!(matches!(
        written("a.stl", b"nothing"),
        Err(MeshError::Wrong(_))
    ));
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

fn problem(name: &str, content: &[u8]) -> String {
    written(name, content).expect_err("no mesh").to_string()
}

#[test]
fn lines_of_obj_go_on_and_have_comments() {
    let text = "\u{feff}v 0 0 0 # the first\nv 1 \\\n 0 0#x\nv 0 \\  \r\n2 0.5\n\
        usemtl a\nf 1 2 \\\n3 # a comment\n";
    let mesh = written("a.obj", text.as_bytes());
    assert_eq!(mesh.expect("a mesh"), triangle());
    let alone = text.replace("\r\n", "\n").replace('\n', "\r");
    let mesh = written("a.obj", alone.as_bytes());
    assert_eq!(mesh.expect("a mesh"), triangle());
    let error = problem("a.obj", b"v 0 0 \\\n0\nv 1 0\n");
    assert_eq!(error, "line 3: expected three numbers");
    let error = problem(
        "a.obj",
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nsurf 0 1 0 1 1 2\n",
    );
    assert_eq!(
        error,
        "line 5: curved surfaces and other files are not read"
    );
}

#[test]
fn names_and_comments_of_obj_end_with_their_line() {
    let text = "# made from C:\\models\\\ng C:\\parts\\\no a\\\nv 0 0 0 # of C:\\x\\\nv 1 0 0\n\
        usemtl b\\\nmtllib C:\\looks\\\nv 0 2 0.5\nfo 1 2 3\n";
    let mesh = written("a.obj", text.as_bytes());
    assert_eq!(mesh.expect("a mesh"), triangle());
    // A file that is cut in a face.
    let corners = "v 0 0 0\nv 1 0 0\nv 0 2 0.5\n";
    let error = problem("a.obj", format!("{corners}f 1 2 3\nf 1 2").as_bytes());
    assert_eq!(
        error,
        "line 5: the file is cut: a face has three corners or more"
    );
    let error = problem("a.obj", format!("{corners}f 1 2 3\nbzp 1 2 3").as_bytes());
    assert_eq!(
        error,
        "line 5: curved surfaces and other files are not read"
    );
}

/// The area of the triangles is that of the face, so none of them lies outside.
#[test]
fn faces_that_are_not_convex_keep_their_shape() {
    for (corners, expected) in [
        // An arrow, an L, and a comb, from two sides.
        ("0 0;4 4;0 1;-4 4", 4.0),
        ("0 0;2 0;2 1;1 1;1 2;0 2", 3.0),
        ("0 0;5 0;5 3;4 3;4 1;3 1;3 3;2 3;2 1;1 1;1 3;0 3", 11.0),
    ] {
        let count = corners.split(';').count();
        let places: Vec<String> = (1..=count).map(|n| n.to_string()).collect();
        let turned: Vec<String> = places.iter().rev().cloned().collect();
        for places in [places, turned] {
            let vertices = corners.split(';').map(|two| format!("v 7 {two}\n"));
            let text = vertices.collect::<String>() + "f " + &places.join(" ");
            let mesh = written("a.obj", text.as_bytes()).expect("a mesh");
            assert_eq!(mesh.triangles.len(), count - 2);
            let area = |of: &[u32; 3]| {
                let [a, b, c] = of.map(|at| mesh.vertices[at as usize]);
                ((b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])) / 2.0
            };
            let areas: Vec<f64> = mesh.triangles.iter().map(area).collect();
            let sum: f64 = areas.iter().map(|area| area.abs()).sum();
            assert_eq!(sum, expected, "{corners}");
            assert!(areas.iter().all(|area| area * areas[0] >= 0.0), "{areas:?}");
        }
    }
}

#[test]
fn stl_of_other_programs() {
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
        vertex 0 2 0.5\nendloop\nendfacet\nendsolid a\n";
    let two = format!("{text}{}", text.replace("solid a", "solid"));
    for (content, count) in [
        (text.to_uppercase(), 1),
        (format!("\u{feff}{text}"), 1),
        (text.replace('\n', "\r\n"), 1),
        (text.replace('\n', "\r"), 1),
        (format!("{text}\0\0\u{1a}written by a program\n"), 1),
        (two, 2),
    ] {
        let mesh = written("a.STL", content.as_bytes()).expect("a mesh");
        assert_eq!(mesh.triangles.len(), count, "{content}");
        assert_eq!(mesh.vertices[..3], triangle().vertices);
    }
    // Nothing is left out or shifted.
    let lines: Vec<&str> = text.lines().collect();
    for (cut, expected) in [
        (1, "the file is cut: `endsolid` is missing"),
        (4, "line 2: the file is cut: `endfacet` is missing"),
        (7, "line 2: the file is cut: `endfacet` is missing"),
        (8, "the file is cut: `endsolid` is missing"),
    ] {
        assert_eq!(
            problem("a.stl", lines[..cut].join("\n").as_bytes()),
            expected
        );
    }
    for (from, to, expected) in [
        (
            "vertex 1 0 0\n",
            "",
            "line 7: expected three corners of the facet, found 2",
        ),
        (
            "endloop",
            "vertex 1 1 1",
            "line 8: expected three corners of the facet, found 4",
        ),
        (
            "endfacet\n",
            "",
            "line 8: expected `vertex` or `endfacet`, found `endsolid`",
        ),
        (
            "endfacet",
            "endfacet\nvertex 1 1 1",
            "line 9: expected `facet` or `endsolid`, found `vertex`",
        ),
        (
            "vertex 1 0 0",
            "vertex 1 0",
            "line 5: expected three numbers",
        ),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_eq!(problem("a.stl", changed.as_bytes()), expected, "{changed}");
    }
}

#[test]
fn triangles_that_the_header_of_stl_does_not_count_are_found() {
    for normal in [[0.0, 0.0, 0.0], [0.0, -0.242_535_63, 0.970_142_5]] {
        let mut triangle_bytes = Vec::new();
        for number in normal {
            triangle_bytes.extend(f32::to_le_bytes(number));
        }
        for number in triangle().vertices.iter().flatten() {
            triangle_bytes.extend((*number as f32).to_le_bytes());
        }
        triangle_bytes.extend([0; 2]);
        for (count, there) in [(0_u32, 1), (1, 3), (2, 5)] {
            let mut bytes = vec![b' '; 80];
            bytes.extend(count.to_le_bytes());
            bytes.extend(triangle_bytes.repeat(there));
            bytes.extend(b"a note");
            let more = there - count as usize;
            assert_eq!(
                problem("a.stl", &bytes),
                format!("the header says {count} triangles, but {more} more of them follow")
            );
        }
    }
}

#[test]
fn bytes_behind_the_triangles_of_stl_are_no_triangles() {
    for header in ["solid of bytes", "SOLID\nmade", "a program"] {
        let mut bytes = vec![b' '; 80];
        bytes[..header.len()].copy_from_slice(header.as_bytes());
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend([0; 12]);
        for number in triangle().vertices.iter().flatten() {
            bytes.extend((*number as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
        let whole = bytes.clone();
        for behind in [0, 1, 50, 49] {
            bytes.resize(whole.len() + behind, 7);
            let mesh = written("a.stl", &bytes);
            assert_eq!(mesh.expect("a mesh"), triangle(), "{header} {behind}");
        }
        assert_eq!(
            problem("a.stl", &whole[..whole.len() - 1]),
            "the header says 1 triangles, but the file ends after 0"
        );
    }
}
