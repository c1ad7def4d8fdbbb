//! Motions and efforts beside `MuJoCo`, a second oracle.

use crate::pinocchio::{answers, difference, numbers, random_urdf, robot, states};
use rc_robot::State;
use rc_robot::dynamics::{self, Motions};
use serde_json::{Value, json};

#[test]
fn motions_and_efforts_are_those_of_mujoco() {
    let test = "motions_and_efforts_are_those_of_mujoco";
    let python = rc_test_support::python::packages("mujoco", "mujoco==4.0.0\n", test);
    let Some(python) = python else { return };
    let mut random = fastrand::Rng::with_seed(12);
    // It knows no joints that follow, and none in a plane.
    let of_it = |text: &String| {
        !["<mimic", "planar", "floating"]
            .iter()
            .any(|word| text.contains(word))
    };
    let mut texts: Vec<String> = Vec::new();
    while texts.len() < 8 {
        let links = 4 + texts.len();
        texts.extend(Some(random_urdf(&mut random, links)).filter(of_it));
    }
    let (mut cases, mut own) = (Vec::new(), Vec::new());
    for text in &texts {
        let robot = robot(text);
        let gravity = numbers::<3>(&mut random, 9.81);
        let states = states(&mut random, robot.coordinates.len(), 20);
        let plain = |state: &State| {
            json!({
                "positions": state.positions,
                "velocities": state.velocities,
                "accelerations": state.accelerations,
            })
        };
        // The root is the world there.
        let links: Vec<(usize, &str)> = robot.links().skip(1).collect();
        cases.push(json!({
            "urdf": text,
            "gravity": gravity,
            "coordinates": robot.coordinates,
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
            json!({
                "efforts": dynamics::efforts(&robot, state, gravity, &[]),
                "mass": dynamics::mass_matrix(&robot, state, &[]),
                "accelerations": dynamics::accelerations(&robot, &motions, &[]),
                "places": places.collect::<Vec<_>>(),
            })
        };
        own.push(states.iter().map(of).collect::<Vec<Value>>());
    }
    let other = answers(python, "beside_mujoco.py", &json!(cases));
    for (robot, states) in own.iter().enumerate() {
        for (state, own) in states.iter().enumerate() {
            for what in ["places", "mass", "efforts", "accelerations"] {
                let far = difference(&own[what], &other[robot][state][what]);
                assert!(far < 1e-9, "robot {robot}, state {state}, {what}: {far}");
            }
        }
    }
}
