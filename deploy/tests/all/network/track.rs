//! A component that follows a person in the depths of a simulated camera, as processes.

use crate::network::caller::Caller;
use crate::network::recorded::{Tool, down};
use rc_test_site::site::Site;
use serde_json::{Value, json};
use std::process::{Command, Stdio};

const TRACK: &str = include_str!("../../../../components/networks/track.ddsl");
/// The images of a minute, one in each step.
const IMAGES: usize = 300;
/// The greatest distance of the head from the true place, in mm.
const BOUND: f64 = 100.0;
/// Until then, in ms, the person has walked far enough to count as one.
const FOUND_AT: i64 = 1500;

fn three(of: &Value) -> [f64; 3] {
    ["x", "y", "z"].map(|axis| of[axis].as_f64().expect("a number"))
}

/// The time in ms, and the true place of the head in the frame of the camera, which is that of its
/// stand.
fn truth(world: &mut Caller, tree: &mut Caller) -> (i64, [f64; 3]) {
    let clock = &world.call("getClock", &json!({ "world": "" }))["return"];
    let time = clock["time"].as_i64().expect("a time") / 1_000_000;
    let skeleton = &world.call("getSkeleton", &json!({ "world": "", "id": "ann" }))["return"];
    let joints = skeleton.as_array().expect("joints");
    let head = joints.iter().find(|joint| joint["name"] == "head");
    let place = &head.expect("a head")["place"];
    let coord = json!({ "x": place["x"], "y": place["y"], "z": place["z"] });
    let request = json!({ "base": "stand", "item": "root", "coordInItem": coord });
    let there = tree.call("transform", &request);
    (time, three(&there["coordInBase"]))
}

/// Makes a step, and waits until it is over.
fn step(world: &mut Caller) {
    world.call("step", &json!({ "world": "", "count": 1 }));
    Site::until("the step", || {
        world.call("getClock", &json!({ "world": "" }))["return"]["pending"] == 0
    });
}

#[test]
fn the_tracker_holds_the_head_of_a_walking_person_for_a_minute() {
    let site = Site::new("track");
    site.write_ddsl(&TRACK.replace("Deployment track", "Deployment patrol"));
    let up = [
        "up",
        "--detach",
        "--profile",
        "dev",
        "--set",
        "rcis.rate=0",
        "--set",
        "rcis.step=200ms",
        "--set",
        "rcis.paused=true",
    ];
    let up = site.rcdeploy(&up, true);
    assert_eq!(up.code, 0, "{up:?}");
    let mut world = Caller::new(&site, "rcis", "Simulation");
    let mut tree = Caller::new(&site, "rcis", "InnerModelManager");

    let file = site.path("people");
    let topic = "tracker.HumanCameraBody.newPeopleData";
    let mut echo = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    echo.args(["echo", &site.network, topic, "--format", "json"]);
    site.place(&mut echo);
    let output = std::fs::File::create(&file).expect("a file");
    echo.stdout(output).stderr(Stdio::null());
    let _echo = Tool(echo.spawn().expect("rcdeploy"));
    let text = || std::fs::read_to_string(&file).expect("the file");
    let samples = || text().lines().count();
    let mut heads = Vec::new();
    Site::until("the tool to hear a sample", || {
        step(&mut world);
        samples() > 0
    });
    while heads.len() < IMAGES {
        let before = samples();
        step(&mut world);
        heads.push(truth(&mut world, &mut tree));
        Site::until("the sample of the image before", || samples() > before);
    }
    step(&mut world);
    Site::until("the last sample", || {
        let last = heads.last().map(|(time, _)| *time);
        let text = text();
        let mut whole = text.lines().filter_map(people);
        whole.any(|people| time(&people) == last)
    });

    let text = text();
    // The tool may be writing its last line.
    let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
    let mut farthest = 0.0_f64;
    let mut ids = Vec::new();
    let mut missed = Vec::new();
    let mut seen = 0;
    for line in whole.lines() {
        let people = people(line).expect("JSON");
        // Images before the first one that was watched have no true place here.
        let of = |(at, _): &&(i64, [f64; 3])| time(&people) == Some(*at);
        let Some((at, truth)) = heads.iter().find(of) else {
            continue;
        };
        seen += 1;
        let list = people["peoplelist"].as_array().expect("a list");
        assert!(list.len() < 2, "one person at {at} ms: {people}");
        let Some(person) = list.first() else {
            missed.push(*at);
            continue;
        };
        let is = three(&person["joints"]["head"]);
        let squares = (0..3).map(|axis| (is[axis] - truth[axis]).powi(2));
        let far = squares.sum::<f64>().sqrt();
        farthest = farthest.max(far);
        assert!(far <= BOUND, "{far} mm at {at} ms: {is:?} {truth:?}");
        ids.push(person["id"].clone());
    }
    println!("the head is at most {farthest:.1} mm from its place in {seen} images");
    assert_eq!(seen, IMAGES);
    let is_early = |at: &i64| *at <= FOUND_AT;
    assert!(missed.iter().all(is_early), "no person at {missed:?} ms");
    ids.dedup();
    assert_eq!(ids.len(), 1, "{ids:?}");
    down(&site);
}

/// The value of a line, if the tool has written it to its end.
fn people(line: &str) -> Option<Value> {
    let sample: Value = serde_json::from_str(line).ok()?;
    Some(sample["value"]["people"].clone())
}

fn time(people: &Value) -> Option<i64> {
    people["timestamp"].as_i64()
}
