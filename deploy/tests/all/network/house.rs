//! The robot of the patrol in a simulated house: its programs are the same, and only the network's
//! file differs.

use crate::network::recorded::{Tool, info, play};
use rc_test_site::recordings::count;
use rc_test_site::site::{CommandOutput, PATROL, Site};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::process::Command;

const HOUSE: &str = include_str!("../../../../components/networks/house.ddsl");
/// Four seconds.
const POSES: usize = 80;

/// The programs of the avoider and of the monitor.
fn programs(site: &Site, network: &str) -> Vec<(Value, Value)> {
    site.write_ddsl(&network.replace("Deployment house", "Deployment patrol"));
    let plan = ["plan", "--unbuilt", "--format", "json", "--profile", "dev"];
    let ran = site.rcdeploy(&plan, true);
    assert_eq!(ran.code, 0, "{ran:?}");
    let plan: Value = serde_json::from_str(&ran.stdout).expect("one document");
    let components = plan["components"].as_array().expect("a list").iter();
    let components = components.map(|c| (c["name"].clone(), c["executable"].clone()));
    let mut named: Vec<_> = components
        .filter(|(name, _)| name == "avoider" || name == "monitor")
        .collect();
    named.sort_by_key(|(name, _)| name.to_string());
    named
}

/// Calls an operation of `Simulation`.
pub(crate) fn control(site: &Site, operation: &str, request: &str) -> CommandOutput {
    let operation = format!("rcis.Simulation.{operation}");
    let network = &site.network;
    site.rcdeploy(
        &["call", network, &operation, request, "--format", "json"],
        false,
    )
}

#[test]
fn the_robot_drives_in_a_simulated_house_with_the_programs_of_the_patrol() {
    let site = Site::new("house");
    let patrol = programs(&site, PATROL);
    let house = programs(&site, HOUSE);
    assert_eq!(patrol.len(), 2, "{patrol:?}");
    assert_eq!(patrol, house);

    // The list in the file is the one that the scene gives.
    let mut rcview = Command::new(Site::executable("rcview"));
    rcview
        .arg(Site::components().join("rcis/house.xml"))
        .arg("--slots");
    let printed = site.run(rcview);
    assert_eq!(printed.code, 0, "{printed:?}");
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let lines = printed
        .stdout
        .lines()
        .map(|line| line.split(" //").next().unwrap_or_default());
    let clause = words(&lines.collect::<Vec<_>>().join(" "));
    assert!(words(HOUSE).contains(&clause), "{clause}");

    // The monitor makes the folder.
    let trace = site.path("new/folder/trace");
    let up = site.rcdeploy(
        &[
            "up",
            "--detach",
            "--profile",
            "dev",
            "--set",
            &format!("monitor.trace={}", trace.display()),
            "--set",
            &format!("monitor.samples={POSES}"),
        ],
        true,
    );
    assert_eq!(up.code, 0, "{up:?}");
    site.await_end_of("monitor");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    let text = std::fs::read_to_string(trace).expect("a trace");
    let poses: Vec<Vec<f64>> = text
        .lines()
        .map(|line| {
            line.split(',')
                .filter_map(|number| number.parse().ok())
                .collect()
        })
        .filter(|numbers: &Vec<f64>| numbers.len() == 4)
        .collect();
    assert_eq!(poses.len(), POSES, "{text}");
    let (first, last) = (&poses[0], &poses[POSES - 1]);
    let moved = (last[1] - first[1]).hypot(last[2] - first[2]);
    let turned = (last[3] - first[3]).abs();
    assert!(
        moved > 100.0 || turned > 0.2,
        "moved by {moved} mm, turned by {turned} rad"
    );
}

/// `rcview` draws the world of the simulator without a window.
fn check_pictures(site: &Site) {
    let png = site.path("now.png");
    let draw = |network: Option<&str>, camera: &str| {
        let mut rcview = Command::new(Site::executable("rcview"));
        rcview.arg("--live").args(network);
        rcview.args(["--camera", camera, "--size", "64x48", "--png"]);
        site.run({
            rcview.arg(&png).env_remove("DISPLAY");
            rcview
        })
    };
    let refused = draw(Some(&site.network), "camer");
    assert_eq!(refused.code, 1, "{refused:?}");
    assert!(
        refused.stderr.contains("did you mean `camera`?"),
        "{refused:?}"
    );
    let refused = draw(Some("no_such_network"), "camera");
    assert_eq!(refused.code, 3, "{refused:?}");
    assert!(!png.exists());
    // Without a name, the only network that runs here is meant.
    for (network, camera) in [
        (Some(site.network.as_str()), "camera"),
        (Some(&site.network), "0,2000,-2000"),
        (None, "0,2000,-2000,0,0,0"),
    ] {
        let drawn = draw(network, camera);
        assert_eq!(drawn.code, 0, "{drawn:?}");
        let file = std::fs::read(&png).expect("a picture");
        let size = [64_u32, 48].map(u32::to_be_bytes);
        assert_eq!(file[..8], *b"\x89PNG\r\n\x1a\n");
        assert_eq!(file[16..24], *size.as_flattened());
        std::fs::remove_file(&png).expect("to remove it");
    }
}

/// In lockstep, whoever steps the world hears which follower hangs, and the steps are made once it
/// goes on.
#[test]
fn a_follower_that_hangs_is_named_to_those_who_step() {
    let site = Site::new("house_lockstep");
    let lockstep = "Deployment patrol\n{\n    time simulated by rcis;";
    let waits = HOUSE.replace("Deployment house\n{", lockstep);
    site.write_ddsl(&waits.replace("        time system;\n", ""));
    let up = [
        "up",
        "--detach",
        "--profile",
        "dev",
        "--set",
        "rcis.paused=true",
        "--set",
        "rcis.limit=300ms",
    ];
    let up = site.rcdeploy(&up, true);
    assert_eq!(up.code, 0, "{up:?}");
    let call = |operation: &str, request: &str| control(&site, operation, request);
    let clock = || {
        let ran = call("getClock", r#"{"world": ""}"#);
        assert_eq!(ran.code, 0, "{ran:?}");
        let reply: Value = serde_json::from_str(&ran.stdout).expect("one document");
        let clock = &reply["result"]["return"];
        let number = |name: &str| clock[name].as_i64().expect("a number");
        (number("steps"), number("pending"))
    };
    let step = |count: u32| call("step", &format!(r#"{{"world": "", "count": {count}}}"#));
    assert_eq!(step(5).code, 0);
    Site::until("five steps", || clock() == (5, 0));
    check_pictures(&site);

    let avoider = site.ask("avoider", "status")["pid"].as_i64();
    let avoider = avoider.and_then(|pid| Pid::from_raw(i32::try_from(pid).ok()?));
    let avoider = avoider.expect("a pid");
    kill_process(avoider, Signal::STOP).expect("to stop it");
    assert_eq!(step(50).code, 0);
    site.await_component("rcis", |c| c["clock"]["waiting_for"][0] == "avoider");
    let is_named = |(code, message): &(String, String)| {
        code == "time-waits" && message.contains("waits for avoider")
    };
    // `status` asks the component; the event comes with its next heartbeat.
    Site::until("the avoider is named", || {
        site.events("rcis").iter().any(is_named)
    });
    // Other requests are served, and no step is made without the follower.
    let (steps, pending) = clock();
    assert!(steps < 55 && steps + pending == 55, "{steps} {pending}");
    let refused = step(1);
    let text = format!("{}{}", refused.stdout, refused.stderr);
    assert_ne!(refused.code, 0, "{text}");
    let expected = format!("{pending} steps are not over: `avoider` has not done the last one");
    assert!(text.contains(&expected) && text.contains("Busy"), "{text}");
    assert_eq!(clock(), (steps, pending));

    kill_process(avoider, Signal::CONT).expect("to go on");
    Site::until("all steps", || clock() == (55, 0));
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// One process of the avoider drives in the simulator, and then against its recording.
#[test]
fn the_avoider_runs_against_a_recording_of_the_simulator() {
    let site = Site::new("house_log");
    site.write_ddsl(&HOUSE.replace("Deployment house", "Deployment patrol"));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let file = site.path("drive.mcap");
    let recorder = Tool::record(&site, &["-o", &file.display().to_string()]);
    Site::until("a drive in the file", || {
        let info = info(&file);
        count(&info, "/lasers/front/getLaserData/_reply") > 20
            && count(&info, "/bases/base/setSpeedBase/_request") > 20
    });
    assert_eq!(recorder.end(Signal::INT), Some(0));
    let stop = site.rcdeploy(&["stop", &site.network, "rcis"], false);
    assert_eq!(stop.code, 0, "{stop:?}");

    let program = |site: &Site| {
        let pid = site.ask("avoider", "status")["pid"].clone();
        let exe = std::fs::read_link(format!("/proc/{pid}/exe")).expect("a program");
        (pid, exe)
    };
    let before = program(&site);
    let ran = play(&site, &file, &[]);
    let words: Vec<&str> = ran.stdout.split_whitespace().collect();
    let calls = words.windows(2).find(|pair| pair[1] == "calls");
    let calls: u64 = calls.and_then(|pair| pair[0].parse().ok()).expect("calls");
    assert!(calls > 20, "{ran:?}");
    assert_eq!(program(&site), before);
    site.await_component("avoider", |c| c["state"] == "running");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
