//! Motions and efforts beside `MuJoCo`, a second oracle.

use crate::pinocchio::{Case, answers, difference, driven, numbers, random_urdf, robot, states};
use rc_robot::State;
use rc_robot::dynamics::{self, Motions};
use serde_json::{Value, json};
use std::path::Path;

/// An interpreter with it, if it can be installed.
pub(crate) fn python(test: &str) -> Option<&'static Path> {
    rc_test_support::python::packages("mujoco", "mujoco==4.0.0\n", test)
}

/// Compares robots with it in `count` states. Returns why it refuses some.
///
/// Its numbers are exact where nothing limits, touches or closes a loop: the tolerances are those of rounding.
pub(crate) fn compare(
    python: &Path,
    robots: &[Case],
    count: usize,
    random: &mut fastrand::Rng,
) -> Vec<Option<String>> {
    let (mut cases, mut own) = (Vec::new(), Vec::new());
    for Case { robot, source } in robots {
        let gravity = numbers::<3>(random, 9.81);
        let states = states(random, robot.coordinates.len(), count);
        let plain = |state: &State| {
            json!({
                "positions": state.positions,
                "velocities": state.velocities,
                "accelerations": state.accelerations,
            })
        };
        // The root is the world there.
        let links: Vec<(usize, &str)> = robot.links().skip(1).collect();
        let is_weightless = dynamics::weightless(robot).is_some();
        cases.push(json!({
            source.0: source.1,
            "gravity": gravity,
            "coordinates": robot.coordinates,
            "driven": driven(robot).0,
            "is_weightless": is_weightless,
            "bodies": links.iter().map(|(_, name)| name).collect::<Vec<_>>(),
            "states": states.iter().map(plain).collect::<Vec<_>>(),
        }));
        let of = |state: &State| {
            let places = links.iter().map(|(body, _)| {
                let pose = robot.chain(0, *body).expect("one tree").moved(state).pose;
                [&pose.translation[..], &pose.rotation.concat()].concat()
            });
            let efforts = &state.accelerations;
            let motions = Motions {
                state,
                efforts,
                gravity,
            };
            let accelerations = if is_weightless {
                Vec::new()
            } else {
                dynamics::accelerations(robot, &motions, &[])
            };
            json!({
                "efforts": dynamics::efforts(robot, state, gravity, &[]),
                "mass": dynamics::mass_matrix(robot, state, &[]),
                "accelerations": accelerations,
                "places": places.collect::<Vec<_>>(),
            })
        };
        own.push(states.iter().map(of).collect::<Vec<Value>>());
    }
    let other = answers(python, "beside_mujoco.py", &json!(cases));
    let mut refused = Vec::new();
    for (at, states) in own.iter().enumerate() {
        let reason = other[at].get("refused");
        refused.push(reason.map(Value::to_string));
        if reason.is_some() {
            continue;
        }
        let name = &robots[at].robot.name;
        for (state, own) in states.iter().enumerate() {
            let other = &other[at][state];
            let condition = other["condition"].as_f64().expect("a number");
            // Rounding of a mass matrix may be as great in its inverse.
            let accelerations = f64::max(1e-9, 1e-14 * condition);
            for (what, most) in [
                ("places", 1e-9),
                ("mass", 1e-9),
                ("efforts", 1e-9),
                ("accelerations", accelerations),
            ] {
                let far = difference(&own[what], &other[what]);
                assert!(far < most, "{name} ({at}), state {state}, {what}: {far}");
            }
        }
    }
    refused
}

#[test]
fn motions_and_efforts_are_those_of_mujoco() {
    let Some(python) = python("motions_and_efforts_are_those_of_mujoco") else {
        return;
    };
    let mut random = fastrand::Rng::with_seed(12);
    // It knows no joints in a plane, and has quaternions for free ones.
    let of_it = |text: &String| {
        !["planar", "floating", "spherical"]
            .iter()
            .any(|word| text.contains(word))
    };
    let mut texts: Vec<String> = Vec::new();
    while texts.len() < 8 {
        let links = 4 + texts.len();
        texts.extend(Some(random_urdf(&mut random, links)).filter(of_it));
    }
    assert!(texts.iter().any(|text| text.contains("<mimic")));
    let cases: Vec<Case> = texts
        .into_iter()
        .map(|text| Case {
            robot: robot(&text),
            source: ("urdf", text),
        })
        .collect();
    let refused = compare(python, &cases, 20, &mut random);
    assert!(refused.iter().all(Option::is_none), "{refused:?}");
}
