//! Components that share a world, in processes of their own.

use rc_test_site::site::Site;
use rustix::process::{Pid, Signal, kill_process};

/// The network of `components/networks/home.ddsl`.
const HOME: &str = include_str!("../../../../components/networks/home.ddsl");

#[test]
fn what_one_component_writes_another_one_gets_and_a_restarted_one_catches_up() {
    let site = Site::new("world_home");
    site.write_ddsl(&HOME.replace("Deployment home", "Deployment patrol"));
    let plan = site.rcdeploy(&["plan", "--profile", "dev"], true);
    let text = "door_finder  writes door, RT, door.opened stream 20ms; reads room";
    assert!(plan.stdout.contains(text), "{plan:?}");
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    // The room goes to the finder, its door comes back with a pose in that room, then the stream.
    site.await_in_log("door_finder", "a door is found");
    site.await_in_log("room_keeper", "door front of 0.8 m at 1.2 0");
    site.await_in_log("room_keeper", "door front is open by");

    // A keeper that is new gets the door, and the values of the stream after that.
    let doors = site.count_in_log("room_keeper", "door front of");
    let restarted = site.rcdeploy(&["restart", &site.network, "room_keeper"], false);
    assert_eq!(restarted.code, 0, "{restarted:?}");
    Site::until("the door comes again", || {
        site.count_in_log("room_keeper", "door front of") > doors
    });
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}

/// A component that stands still is split off from the world of the others, until it goes on.
#[test]
fn a_replica_that_nobody_hears_is_an_event_and_its_return_another_one() {
    let site = Site::new("world_split");
    site.write_ddsl(&HOME.replace("Deployment home", "Deployment patrol"));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_in_log("room_keeper", "door front of 0.8 m");

    let status = site.status();
    let mut components = status["components"].as_array().into_iter().flatten();
    let finder = components.find(|component| component["name"] == "door_finder");
    let pid = finder.and_then(|finder| finder["pid"].as_i64());
    let pid = Pid::from_raw(pid.expect("a pid") as i32).expect("a pid");
    kill_process(pid, Signal::STOP).expect("it runs");
    let await_event = |code: &str| {
        Site::until(code, || {
            let events = site.events("room_keeper");
            events.iter().any(|(own, _)| own == code)
        });
    };
    await_event("world-split");
    let status = site.rcdeploy(&["status", &site.network, "--format", "json"], false);
    assert!(status.stdout.contains("world-split"), "{status:?}");
    kill_process(pid, Signal::CONT).expect("it stands still");
    await_event("world-whole");
    let events = site.events("room_keeper");
    let split = events.iter().find(|(code, _)| code == "world-split");
    let text = &split.expect("it was there").1;
    let wanted = "its world hears nothing from door_finder, still running; each side goes on with what it has";
    assert_eq!(text, wanted);
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}
