//! A component that imagines motions in clones of the simulated world, as processes.

use crate::network::house::control;
use crate::network::observe::json_of;
use rc_test_site::site::Site;
use serde_json::{Value, json};
use std::time::Duration;

const PLAN: &str = include_str!("../../../../components/networks/plan.ddsl");
/// The goal of `planner.pdsl`, in mm.
const GOAL: [f64; 2] = [0.0, 1800.0];
const TOLERANCE: f64 = 150.0;
/// It bounds a hang. How long the way takes depends on the computer.
const LIMIT: Duration = Duration::from_mins(2);

fn call(site: &Site, operation: &str, request: &str) -> Value {
    json_of(&control(site, operation, request))["result"]["return"].clone()
}

fn place(site: &Site) -> [f64; 2] {
    let pose = call(
        site,
        "getPose",
        r#"{"world": "", "id": "base", "base": "root"}"#,
    );
    ["x", "z"].map(|axis| pose[axis].as_f64().expect("a number"))
}

#[test]
fn the_planner_drives_around_obstacles_and_plans_anew_after_a_surprise() {
    let site = Site::new("plan");
    site.write_ddsl(&PLAN.replace("Deployment plan", "Deployment patrol"));
    let up = site.rcdeploy(
        &[
            "up",
            "--detach",
            "--profile",
            "dev",
            "--set",
            "rcis.rate=0",
            "--set",
            "rcis.paused=true",
            "--set",
            "planner.turns=3",
        ],
        true,
    );
    assert_eq!(up.code, 0, "{up:?}");
    let start = place(&site);

    // In the middle of the first plan, which begins after 600 ms, somebody moves the robot.
    call(&site, "step", r#"{"world": "", "count": 20}"#);
    Site::until_within(LIMIT, "the steps are made", || {
        call(&site, "getClock", r#"{"world": ""}"#)["pending"] == 0
    });
    let before = place(&site);
    assert!(before[1] > start[1] + 10.0, "{start:?} {before:?}");
    assert!(!site.log("planner").contains("not where it was expected"));
    let [x, z] = [before[0] - 200.0, before[1]];
    let pose = json!({ "x": x, "y": 0.0, "z": z, "rx": 0.0, "ry": 0.0, "rz": 0.0 });
    let moved = json!({ "world": "", "id": "base", "base": "root", "pose": pose }).to_string();
    call(&site, "teleport", &moved);
    call(&site, "setPaused", r#"{"paused": false}"#);
    Site::until_within(LIMIT, "the goal", || {
        site.count_in_log("planner", "at the goal") > 0
    });

    let [x, z] = place(&site);
    let far = (x - GOAL[0]).hypot(z - GOAL[1]);
    assert!(far <= TOLERANCE, "{far} mm from the goal");
    let log = site.log("planner");
    assert_eq!(log.matches("not where it was expected").count(), 1, "{log}");
    assert!(log.contains(" 1 surprises"), "{log}");
    // It imagines much faster than time passes.
    let figures = log.split("imagined ").nth(1).unwrap_or_default();
    let mut figures = figures
        .split([' ', 's'])
        .filter_map(|word| word.parse().ok());
    let (imagined, needed): (Option<f64>, Option<f64>) = (figures.next(), figures.next());
    assert!(imagined > needed && needed > Some(0.0), "{log}");
    assert_eq!(call(&site, "getClones", "{}"), Value::Array(Vec::new()));
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
