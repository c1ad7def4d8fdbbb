//! Distances equal those of coal.

use innermodel::{InnerModel, Pose, Time};
use innermodel_collision::Space;
use rc_test_support::python;
use serde_json::{Value, json};
use std::fmt::Write;
use std::process::Command;

/// Numbers that look random, the same in each run.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self, from: f64, to: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        from + (to - from) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

const VERTICES: [[f64; 3]; 5] = [
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.2],
    [1.0, 1.0, -0.1],
    [-1.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
];
const TRIANGLES: [[u32; 3]; 6] = [
    [0, 1, 4],
    [1, 2, 4],
    [2, 3, 4],
    [3, 0, 4],
    [0, 2, 1],
    [0, 3, 2],
];

/// A tag without its end, and the same shape for coal.
fn shape(at: usize, n: &mut Numbers) -> (String, Value) {
    let (a, b, c) = (
        n.next(50.0, 300.0),
        n.next(50.0, 300.0),
        n.next(50.0, 300.0),
    );
    match at {
        // A normal of −z leaves the box as it is.
        0 => (
            format!(r#"<plane nz="-1" size="{a},{b},{c}""#),
            json!(["box", a, b, c]),
        ),
        1 => (format!(r#"<sphere radius="{a}""#), json!(["sphere", a])),
        2 => (
            format!(r#"<cylinder radius="{a}" length="{b}""#),
            json!(["cylinder", a, b]),
        ),
        3 => (
            format!(r#"<cone radius="{a}" length="{b}""#),
            json!(["cone", a, b]),
        ),
        _ => {
            let corners: Vec<_> = VERTICES.map(|[x, y, z]| [x * a, y * a, -z * a]).into();
            (
                format!(r#"<mesh file="m.obj" scale="{a}""#),
                json!(["mesh", corners, TRIANGLES]),
            )
        }
    }
}

#[test]
fn five_hundred_poses_agree() {
    let Some(python) = python::interpreter("coal==3.0.1", "five_hundred_poses_agree") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let mut obj = String::new();
    VERTICES
        .iter()
        .for_each(|[x, y, z]| writeln!(obj, "v {x} {y} {z}").expect("a text"));
    for [a, b, c] in TRIANGLES {
        writeln!(obj, "f {} {} {}", a + 1, b + 1, c + 1).expect("a text");
    }
    std::fs::write(folder.path().join("m.obj"), obj).expect("a file");
    let mut n = Numbers(7);
    let mut list = Vec::new();
    for case in 0..500 {
        let (one, a) = shape(case % 5, &mut n);
        let (other, b) = shape(case / 5 % 5, &mut n);
        let text = format!(
            r#"<innerModel><transform id="a">{one} id="one" collide="1"/></transform>
                <transform id="b">{other} id="other" collide="1"/></transform></innerModel>"#
        );
        let path = folder.path().join("world.xml");
        std::fs::write(&path, text).expect("a file");
        let model = InnerModel::load(&path, &innermodel::Folders::default()).expect("a model");
        let mut poses = Vec::new();
        for id in ["a", "b"] {
            let pose = Pose {
                translation: [(); 3].map(|()| n.next(-300.0, 300.0)),
                rotation: [(); 3].map(|()| n.next(-3.0, 3.0)),
            };
            model
                .change(Time::ZERO, |edit| edit.set_pose(id, pose))
                .expect("a change");
            let there = innermodel::Transform::of(&pose);
            let rows = there.rotation.transpose();
            poses.push([rows.as_slice(), there.translation.as_slice()].concat());
        }
        let space = Space::new(&model.snapshot());
        let near = space
            .distance("a", "b")
            .expect("two nodes")
            .expect("two bodies");
        list.push(json!([a, b, poses[0], poses[1], near.distance]));
    }
    let path = folder.path().join("list.json");
    std::fs::write(&path, Value::from(list).to_string()).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/distances.py");
    let output = Command::new(python)
        .arg(script)
        .arg(&path)
        .output()
        .expect("python");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
}
