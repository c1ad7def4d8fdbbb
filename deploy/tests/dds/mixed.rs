//! Two middlewares in one network, in one component, and of one component: `patrol_mixed.ddsl`, as its file is.

use crate::patrol::of_user;
use crate::site::{Ran, Site};
use std::path::Path;

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

fn up(site: &Site) -> Ran {
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    command.args(["up", "--build", "--detach", "--profile", "dev"]);
    command.arg(site.ddsl()).env("CARGO_NET_OFFLINE", "true");
    site.run(command)
}

/// Builds what the network needs.
pub(crate) fn build() {
    let site = place("mixed_build");
    let up = up(&site);
    assert_eq!(up.code, 0, "{up:?}");
    assert_eq!(site.rcdeploy(&["down"], true).code, 0);
    site.assert_nothing_left();
}

/// How many poses a component says that it has heard.
fn poses(site: &Site, name: &str) -> u64 {
    let log = site.log(name);
    let mut counts = log.lines().filter_map(|line| line.rsplit_once("poses="));
    let last = counts.next_back().map(|(_, count)| count.trim().parse());
    last.map_or(0, |count| count.expect("a count"))
}

#[test]
fn poses_go_from_shared_memory_to_ros_2_and_one_component_hears_them_in_both() {
    crate::built();
    let before = of_user(&COMPONENTS);
    let site = place("mixed");
    let up = up(&site);
    assert_eq!(up.code, 0, "{up:?}");
    // All is there, also what was built last for another network of this target folder.
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
                _ => 1,
            };
            !slots.is_empty() && slots.iter().all(|slot| slot["peers"] == peers(slot))
        });
    }
    // In its first second each has heard none or few; a robot says twenty in the next one.
    for component in ["monitor", "listener", "watcher"] {
        Site::until("poses come", || poses(&site, component) > 20);
    }
    let down = site.rcdeploy(&["down"], true);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
    assert!(
        before == of_user(&COMPONENTS),
        "something of the user has changed"
    );
    for picture in ["patrol.svg", "patrol_ros2.svg"] {
        let picture = site.path("networks").join(picture);
        assert!(picture.exists(), "{} is drawn", picture.display());
    }
}
