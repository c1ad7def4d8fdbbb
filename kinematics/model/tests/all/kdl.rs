//! Poses and Jacobians beside KDL, as Debian's `python3-pykdl` has it.

use crate::pinocchio::{answers, difference, random_urdf, robot, states};
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

#[test]
fn poses_and_jacobians_are_those_of_kdl() {
    // The package is for the interpreter of the system.
    let python = Path::new("/usr/bin/python3");
    let loaded = Command::new(python).args(["-c", "import PyKDL"]).output();
    if !loaded.is_ok_and(|output| output.status.success()) {
        let test = "poses_and_jacobians_are_those_of_kdl";
        return rc_test_support::python::skipped(test, "there is no python3-pykdl");
    }
    let mut random = fastrand::Rng::with_seed(31);
    let mut texts: Vec<String> = Vec::new();
    while texts.len() < 5 {
        let text = random_urdf(&mut random, 5 + texts.len());
        let others = ["<mimic", "planar", "floating", "spherical"];
        if !others.iter().any(|word| text.contains(word)) {
            texts.push(text);
        }
    }
    let (mut cases, mut own) = (Vec::new(), Vec::new());
    for text in &texts {
        let robot = robot(text);
        let states = states(&mut random, robot.coordinates.len(), 40);
        let links: Vec<(usize, &str)> = robot.links().skip(1).collect();
        let all: Vec<&Vec<f64>> = states.iter().map(|state| &state.positions).collect();
        cases.push(json!({
            "urdf": text,
            "coordinates": robot.coordinates,
            "links": links.iter().map(|(_, name)| name).collect::<Vec<_>>(),
            "states": all,
        }));
        for state in &states {
            let moved = links.iter().map(|(body, _)| {
                let moved = robot.chain(0, *body).expect("one tree").moved(state);
                let rows = (0..6).map(|row| {
                    let part = |column: &rc_robot::Column<f64>| {
                        [column.linear, column.angular][row / 3][row % 3]
                    };
                    moved.jacobian.iter().map(part).collect::<Vec<f64>>()
                });
                json!({
                    "place": moved.pose.translation,
                    "rotation": moved.pose.rotation.concat(),
                    "jacobian": rows.collect::<Vec<_>>(),
                })
            });
            own.push(moved.collect::<Vec<Value>>());
        }
    }
    let theirs = answers(python, "beside_kdl.py", &json!(cases));
    let theirs = theirs.as_array().expect("robots").iter();
    let theirs: Vec<&Value> = theirs
        .flat_map(|robot| robot.as_array().expect("states"))
        .collect();
    assert_eq!(own.len(), theirs.len());
    for (own, theirs) in own.iter().zip(theirs) {
        for (link, own) in own.iter().enumerate() {
            for what in ["place", "rotation", "jacobian"] {
                let far = difference(&own[what], &theirs[link][what]);
                assert!(far < 1e-10, "link {link}, {what}: {far}");
            }
        }
    }
}
