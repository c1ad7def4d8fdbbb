//! Transforms equal those that scipy composes from the files.

use crate::scene;
use innermodel::{Error, Folders, InnerModel, Pose, Time, Transform, frames};
use rc_test_support::python;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;

/// The InnerModel files in the folder that `RC_REAL_FILES` names, where there is one.
fn real_files() -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = std::env::var_os("RC_REAL_FILES")
        .map(PathBuf::from)
        .into_iter()
        .collect();
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "xml") {
                files.push(path);
            }
        }
    }
    // The tests of the language say which files are wrong.
    files.retain(|path| InnerModel::load(path, &Folders::default()).is_ok());
    eprintln!("{} real files", files.len());
    files
}

#[test]
fn every_pair_of_nodes_equals_scipy() {
    let Some(python) = python::interpreter("scipy==1.15.3", "every_pair_of_nodes_equals_scipy")
    else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/oracle.py");
    let scenes = ["arm.xml", "robot.xml", "house.xml"].map(scene);
    for path in scenes.into_iter().chain(real_files()) {
        let name = path.display();
        let model = InnerModel::load(&path, &Folders::default()).expect("a file");
        let joints: BTreeMap<String, f64> = model
            .snapshot()
            .nodes()
            .enumerate()
            .filter(|(_, node)| node.position().is_some())
            .map(|(at, node)| (node.id().to_owned(), 0.37 * at as f64 - 2.0))
            .collect();
        model
            .change(Time::ZERO, |edit| {
                for (id, position) in &joints {
                    edit.set_joint(id, *position)?;
                }
                Ok::<_, Error>(())
            })
            .expect("a change");
        let tree = model.snapshot();
        let joints: BTreeMap<&str, f64> = tree
            .nodes()
            .filter_map(|node| Some((node.id(), node.position()?)))
            .collect();
        let ids: Vec<&str> = tree.nodes().map(|node| node.id()).collect();
        let mut pairs = Vec::new();
        for to in &ids {
            for from in &ids {
                let matrix = tree.matrix(*to, *from).expect("two nodes").transpose();
                pairs.push(json!([to, from, matrix.as_slice()]));
            }
        }
        let ros: Vec<_> = (0..100)
            .map(|at| {
                let n = |k: i32| f64::from((at * 37 + k * 101) % 311 - 155) / 50.0;
                let pose = Pose::new(n(1) * 1000.0, n(2), n(3), n(4), n(5), n(6));
                let there = frames::to_ros(&Transform::of(&pose));
                let (t, q) = (there.translation.vector, there.rotation);
                let here = [pose.translation, pose.rotation].concat();
                json!([here, [t.x, t.y, t.z, q.i, q.j, q.k, q.w]])
            })
            .collect();
        let list = folder.path().join("list.json");
        let given = json!({"pairs": pairs, "joints": joints, "ros": ros});
        std::fs::write(&list, given.to_string()).expect("a file");
        let output = Command::new(python)
            .arg(script)
            .arg(&path)
            .arg(&list)
            .output();
        let output = output.expect("python");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{name}: {errors}");
    }
}
