//! Two middlewares in one network, and in one component.

use crate::site::Site;

const MIXED: &str = include_str!("../../../components/networks/patrol_mixed.ddsl");

#[test]
fn poses_go_from_shared_memory_to_ros_2() {
    let site = Site::new("mixed");
    let text = MIXED.replace("Deployment patrol_mixed", "Deployment patrol");
    site.write_ddsl(&text);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    // In its first second it has heard none; a robot says twenty in the next one.
    site.await_in_log("listener", "heard in ROS 2: x=");
    for component in ["relay", "listener"] {
        Site::until("both ends of each slot have found each other", || {
            let status = site.ask(component, "status");
            let slots = status["slots"].as_array().cloned().unwrap_or_default();
            !slots.is_empty() && slots.iter().all(|slot| slot["peers"] == 1)
        });
    }
    Site::until("poses come in ROS 2", || {
        let log = site.log("listener");
        let last = log
            .lines()
            .rev()
            .find_map(|line| line.rsplit_once("poses="));
        last.is_some_and(|(_, count)| count.trim().parse::<u64>().is_ok_and(|count| count > 20))
    });
    let down = site.rcdeploy(&["down"], true);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}
