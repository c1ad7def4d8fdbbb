//! Two middlewares in one network and in one component: the unchanged `patrol_mixed.ddsl`. And the
//! unchanged `patrol.ddsl` over ROS 2.

use crate::patrol::{assert_unchanged, of_user};
use crate::{await_well, patrol::END, tools};
use rc_record::bag::Info;
use rc_test_site::site::{CommandOutput, PATROL, Site};
use rc_test_support::python;
use std::path::Path;
use std::process::Command;

const MIXED: &str = include_str!("../../../components/networks/patrol_mixed.ddsl");
const COMPONENTS: [&str; 5] = [
    "simulator",
    "pose_monitor",
    "pose_relay",
    "pose_listener",
    "avoider",
];

fn place(name: &str) -> Site {
    let site = Site::new(name);
    site.write_ddsl(&MIXED.replace("Deployment patrol_mixed", "Deployment patrol"));
    site
}

fn place_patrol(name: &str) -> Site {
    let site = Site::new(name);
    site.write_ddsl(PATROL);
    site
}

fn up(site: &Site, domain: &str, more: &[&str]) -> CommandOutput {
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    command.args(["up", "--build", "--detach", "--profile", "dev"]);
    command.args(more).arg(site.ddsl());
    // The variables of an environment of ROS 2.
    command.envs([("ROS_DOMAIN_ID", domain), ("ROS_LOCALHOST_ONLY", "1")]);
    command.env("CARGO_NET_OFFLINE", "true");
    site.run(command)
}

fn down(site: &Site) {
    let down = site.rcdeploy(&["down"], true);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}

/// Builds the components of the networks.
pub(crate) fn build() {
    for (site, more) in [
        (place("mixed_build"), &[][..]),
        (place_patrol("patrol_ros2_build"), &IN_ROS[..]),
    ] {
        let up = up(&site, DOMAIN, more);
        assert_eq!(up.code, 0, "{up:?}");
        down(&site);
    }
}

/// Of ROS 2.
const DOMAIN: &str = "38";
const SIMULATED_DOMAIN: &str = "39";
const RECORDED_DOMAIN: &str = "37";
const IN_ROS: [&str; 2] = ["--middleware", "ros2"];

/// The number of poses that a component has received, by its log.
fn poses(site: &Site, name: &str) -> u64 {
    let log = site.log(name);
    let mut counts = log.lines().filter_map(|line| line.rsplit_once("poses="));
    let last = counts.next_back().map(|(_, count)| count.trim().parse());
    last.map_or(0, |count| count.expect("a count"))
}

#[test]
fn one_component_receives_poses_over_shared_memory_and_over_ros_2() {
    crate::built();
    let before = of_user(&COMPONENTS);
    let site = place("mixed");
    let up = up(&site, DOMAIN, &[]);
    assert_eq!(up.code, 0, "{up:?}");
    // All programs are there, also those that were last built for another network.
    assert!(!up.stderr.contains("Compiling"), "{up:?}");
    for (name, middleware) in [("monitor", "iceoryx2"), ("watcher", "ros2")] {
        let status = site.ask(name, "status");
        assert_eq!(status["component"], "pose_monitor", "{status}");
        assert_eq!(status["middleware"], middleware, "{status}");
    }
    site.await_in_log("listener", "heard in ROS 2: x=");
    for component in ["relay", "listener", "monitor", "watcher"] {
        Site::until("both ends of each slot have found each other", || {
            let status = site.ask(component, "status");
            let slots = status["slots"].as_array().cloned().unwrap_or_default();
            let peers = |slot: &serde_json::Value| match slot["name"].as_str() {
                Some("ros") if component == "relay" => 2,
                Some("tf") => 0,
                _ => 1,
            };
            !slots.is_empty() && slots.iter().all(|slot| slot["peers"] == peers(slot))
        });
    }
    // In its first second a monitor receives few poses or none; the robot publishes twenty a
    // second.
    for component in ["monitor", "listener", "watcher"] {
        Site::until("poses come", || poses(&site, component) > 20);
    }
    assert_transforms(&site, DOMAIN, None);
    down(&site);
    assert_unchanged(&before, &COMPONENTS);
    for picture in ["patrol.svg", "patrol_ros2.svg"] {
        let picture = site.path("networks").join(picture);
        assert!(picture.exists(), "{} is drawn", picture.display());
    }
}

/// The relay in simulated time.
const SIMULATED: &str = "Deployment patrol\n{\n    time simulated by clock;\n\n    \
    Component simulator { cdsl \"../simulator/simulator.cdsl\"; };\n    \
    Component relay { cdsl \"../pose_relay/pose_relay.cdsl\"; };\n    \
    Component clock { cdsl \"../clock/clock.cdsl\"; config \"clock.toml\"; };\n    \
    bind relay.robot -> simulator.FullPoseEstimationPub;\n};\n";

#[test]
fn transforms_in_ros_2_have_the_simulated_time() {
    crate::built();
    let site = Site::new("mixed_time");
    site.write_ddsl(SIMULATED);
    let clock = "[parameters]\nstep = \"50ms\"\nrate = 1.0\n";
    std::fs::write(site.path("networks/clock.toml"), clock).expect("to write");
    let up = up(&site, SIMULATED_DOMAIN, &[]);
    assert_eq!(up.code, 0, "{up:?}");
    assert_transforms(&site, SIMULATED_DOMAIN, Some("50"));
    down(&site);
}

/// The pose is on `/tf`, in the frames of the parameters. `step`: the time of the network is a
/// multiple of so many milliseconds; else it is the system's.
fn assert_transforms(site: &Site, domain: &str, step: Option<&str>) {
    let Some(python) = python::interpreter("cyclonedds==11.0.1", "poses are on /tf") else {
        return;
    };
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../middleware/ros2/tests/stranger/transforms.py"
    );
    let loopback = "<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>";
    let output = Command::new(python)
        .args(["-B", script, &site.network, domain])
        .args(step)
        .env("CYCLONEDDS_URI", loopback)
        .output()
        .expect("Python");
    assert_eq!(
        String::from_utf8_lossy(&output.stdout),
        "map base_link\n",
        "{output:?}"
    );
}

#[test]
fn the_patrol_runs_over_ros_2_and_its_files_do_not_change() {
    crate::built();
    let before = of_user(&COMPONENTS);
    let site = place_patrol("patrol_ros2");
    let up = up(&site, DOMAIN, &IN_ROS);
    assert_eq!(up.code, 0, "{up:?}");
    for name in ["simulator", "avoider", "monitor"] {
        assert_eq!(site.ask(name, "status")["middleware"], "ros2");
    }
    await_well(&site, "avoider");
    Site::until("poses come", || poses(&site, "monitor") > 20);
    tools::look(&site, "ros2");
    rc_test_site::foxglove::look(&site, "the_patrol_runs_over_ros_2");
    down(&site);
    assert_eq!(site.count_in_log("avoider", END), 0);
    assert_unchanged(&before, &COMPONENTS);
}

#[test]
fn a_patrol_over_ros_2_is_recorded_and_played() {
    crate::built();
    let site = place_patrol("recorded_ros2");
    let up = up(&site, RECORDED_DOMAIN, &IN_ROS);
    assert_eq!(up.code, 0, "{up:?}");
    await_well(&site, "avoider");
    let file = tools::record_and_play(&site);
    down(&site);

    // Nodes that take their time from `/clock` get the recorded one.
    let sim_time = "middleware ros2 { use_sim_time true; };";
    site.write_ddsl(&PATROL.replace("middleware iceoryx2;", sim_time));
    let up = self::up(&site, RECORDED_DOMAIN, &[]);
    assert_eq!(up.code, 0, "{up:?}");
    let clock = || site.ask("monitor", "status")["clock"].clone();
    assert_eq!(clock()["kind"], "ros");
    let times = Info::read(Path::new(&file)).expect("a recording").times;
    let (first, last) = times.expect("times");
    let recorded = (first as f64 / 1e9 - 1.0)..(last as f64 / 1e9 + 1.0);
    let is_recorded = || {
        let time = clock()["time_s"].as_f64();
        time.is_some_and(|time| recorded.contains(&time))
    };
    assert!(!is_recorded(), "{}", clock());
    let ran = ["play", &file, "--network", &site.network, "--clock"];
    let ran = site.rcdeploy(&ran, false);
    assert_eq!(ran.code, 0, "{ran:?}");
    Site::until("the recorded time", is_recorded);
    down(&site);
}
