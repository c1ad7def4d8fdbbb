//! Killed supervisors and guards: nothing of the network is left.

use crate::bench::{self, Bench, await_end, component, kill, well};
use rc_deploy::Component;
use rc_deploy::process::Identity;
use rustix::process::Signal;
use std::time::{Duration, Instant};

/// A network with a component that exits by itself, one that does not, and one with children.
fn mixed(bench: &Bench) -> bench::Up {
    let deaf = Component {
        stop: Duration::from_millis(300),
        ..component("deaf", "deaf", &[])
    };
    let well = Component {
        stop: Duration::from_millis(300),
        ..well("well")
    };
    let children = Component {
        stop: Duration::from_millis(300),
        ..component("parent", "children", &[])
    };
    let mut up = bench.start(vec![well, deaf, children]);
    up.await_event("up", None);
    up
}

fn guard(bench: &Bench) -> Identity {
    let pid = bench.status().guard.expect("a guard");
    Identity::of(pid).expect("it runs")
}

#[test]
fn the_guard_cleans_up_after_a_killed_supervisor() {
    let bench = Bench::new();
    let up = mixed(&bench);
    let guard = guard(&bench);
    up.kill();
    await_end(&[guard]);
    assert!(bench.journal().contains(&"well orphan".to_owned()));
    assert!(bench.journal().contains(&"well end".to_owned()));
    bench.assert_nothing_left();
    assert_eq!(bench.cleanups(), 1);
    let log = std::fs::read_to_string(bench.log("rcdeploy-guard")).expect("a log");
    assert!(
        log.contains("the supervisor has ended; components left: well, deaf, parent"),
        "{log}"
    );
}

#[test]
fn an_up_waits_for_the_guard_of_a_killed_one() {
    let bench = Bench::new();
    mixed(&bench).kill();
    let mut up = bench.start(vec![well("new")]);
    up.await_event("up", None);
    assert!(bench.position("well end") < bench.position("new start"));
    assert_eq!(bench.cleanups(), 1);
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0));
    assert!(
        events.iter().all(|e| e["code"] != "recovered"),
        "{events:#?}"
    );
    bench.assert_nothing_left();
}

/// No other process can clean up, so the next `up` says what to do, and works as soon as it is
/// done.
#[test]
fn an_up_names_the_stopped_guard_of_a_killed_supervisor() {
    let bench = Bench::new();
    let up = bench.start_well();
    let guard = guard(&bench);
    let pid = rustix::process::Pid::from_raw(guard.pid).expect("a pid");
    rustix::process::kill_process(pid, Signal::STOP).expect("it runs");
    up.kill();
    let (code, events) = bench.start(vec![well("new")]).end();
    let message = events[0]["message"].as_str().expect("a message");
    let advice = format!(
        "the process that does it, its guard, is stopped: continue it (`kill -CONT {0}`), or end it (`kill -KILL {0}`)",
        guard.pid
    );
    assert!(message.contains(&advice), "{message}");
    assert_eq!(code, Some(3), "{events:#?}");
    kill(guard);
    let mut up = bench.start(vec![well("new")]);
    up.await_event("recovered", None);
    up.await_event("up", None);
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// The guard of a network whose only service is never ready. Returns when it has begun to create
/// it.
fn late(bench: &Bench) -> (bench::Up, Identity) {
    let file = bench.path("late");
    let up = bench.start_in(
        vec![well("a")],
        &["--hold", "1"],
        &[("RC_TEST_LATE", file.to_str().expect("a path"))],
    );
    let end = Instant::now() + bench::LIMIT;
    while !file.exists() {
        assert!(Instant::now() < end, "the guard does not begin");
        std::thread::sleep(Duration::from_millis(5));
    }
    (up, guard(bench))
}

/// It would create files after all have been removed.
#[test]
fn a_guard_that_is_late_leaves_nothing_when_its_network_stops() {
    let bench = Bench::new();
    let (up, guard) = late(&bench);
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    await_end(&[guard]);
    bench.assert_nothing_left();
    assert!(!bench.path("late").exists());
}

#[test]
fn a_guard_that_is_late_leaves_nothing_after_a_killed_supervisor() {
    let bench = Bench::new();
    let (up, guard) = late(&bench);
    up.kill();
    await_end(&[guard]);
    bench.assert_nothing_left();
    assert_eq!(bench.cleanups(), 1);
    assert!(!bench.path("late").exists());
}

#[test]
fn signals_do_not_end_the_guard() {
    let bench = Bench::new();
    let up = bench.start_well();
    let guard = guard(&bench);
    let pid = rustix::process::Pid::from_raw(guard.pid).expect("a pid");
    for signal in [Signal::INT, Signal::TERM, Signal::HUP] {
        rustix::process::kill_process(pid, signal).expect("it runs");
    }
    // The guard has its own process group, which Ctrl-C does not reach.
    assert_eq!(rustix::process::getpgid(Some(pid)).expect("it runs"), pid);
    up.kill();
    await_end(&[guard]);
    bench.assert_nothing_left();
}

#[test]
fn a_killed_guard_is_replaced() {
    let bench = Bench::new();
    let mut up = mixed(&bench);
    let first = guard(&bench);
    kill(first);
    up.await_event("guard-ended", None);
    let second = guard(&bench);
    assert_ne!(first, second);
    up.kill();
    await_end(&[second]);
    bench.assert_nothing_left();
}

#[test]
fn a_guard_that_cannot_start_is_given_up_and_the_network_continues() {
    let bench = Bench::new();
    let mut up = bench.start_well();
    for _ in 0..4 {
        kill(guard(&bench));
        up.await_event("guard-ended", None);
    }
    kill(guard(&bench));
    let message = up.await_event("guard-lost", None);
    assert!(message.contains("is not started any more"), "{message}");
    assert_eq!(bench.status().guard, None);
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

#[test]
fn the_next_up_recovers_when_supervisor_and_guard_are_killed() {
    let bench = Bench::new();
    let up = mixed(&bench);
    let (well, deaf) = (bench.processes("well start"), bench.processes("deaf start"));
    let children = bench.processes("parent child");
    let parent = bench.processes("parent start");
    let guard = guard(&bench);
    // A stopped guard can neither clean up nor be replaced.
    let pid = rustix::process::Pid::from_raw(guard.pid).expect("a pid");
    rustix::process::kill_process(pid, Signal::STOP).expect("it runs");
    up.kill();
    kill(guard);
    await_end(&[guard]);
    // The components stop because their link closes.
    await_end(&well);
    await_end(&parent);
    assert!(deaf[0].is_alive() && children[0].is_alive() && children[1].is_alive());
    assert!(bench.run_directory().exists() && bench.cleanups() == 0);
    let stale = bench.run_directory().join("stale");
    std::fs::create_dir(&stale).expect("a folder");
    std::fs::write(stale.join("file"), "").expect("a file");

    let mut up = bench.start(vec![self::well("new")]);
    let message = up.await_event("recovered", None);
    assert!(!stale.exists());
    assert!(message.contains("killed 3 orphaned processes"), "{message}");
    up.await_event("up", None);
    await_end(&deaf);
    await_end(&children);
    assert_eq!(bench.cleanups(), 1);
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

#[test]
fn recover_cleans_up_without_an_up() {
    let bench = Bench::new();
    let up = mixed(&bench);
    let guard = guard(&bench);
    let pid = rustix::process::Pid::from_raw(guard.pid).expect("a pid");
    rustix::process::kill_process(pid, Signal::STOP).expect("it runs");
    up.kill();
    kill(guard);
    await_end(&[guard]);
    let recovered = bench.command("recover", &[]);
    assert!(recovered.status.success(), "{recovered:?}");
    bench.assert_nothing_left();
    let nothing = bench.command("recover", &[]);
    assert_eq!(bench::text(&nothing.stdout), "Nothing\n");
}

#[test]
fn a_supervisor_can_be_killed_at_any_moment() {
    for milliseconds in 0..24 {
        let bench = Bench::new();
        let components = ["a", "b", "c", "d"].map(well);
        let up = bench.start(components.to_vec());
        std::thread::sleep(Duration::from_millis(milliseconds) / 2);
        up.kill();
        // `recover` waits for a guard if there is one. Otherwise it cleans up itself.
        let recovered = bench.command("recover", &[]);
        assert!(recovered.status.success(), "{recovered:?}");
        bench.assert_no_process_left();
        let left = std::fs::read_dir(bench.run_directory());
        let left: Vec<_> = left.into_iter().flatten().collect();
        assert!(
            !bench.run_directory().exists(),
            "{recovered:?} left {left:?} after {milliseconds} half milliseconds"
        );
    }
}

#[test]
fn a_supervisor_killed_at_its_start_leaves_no_directory() {
    for files in [
        &["rcdeploy.lock"][..],
        &["rcdeploy.lock", "components.json.new"],
        &["rcdeploy.lock", "components.json"],
    ] {
        let bench = Bench::new();
        std::fs::create_dir_all(bench.run_directory()).expect("a folder");
        for file in files {
            std::fs::write(bench.run_directory().join(file), "{").expect("written");
        }
        let recovered = bench.command("recover", &[]);
        assert!(recovered.status.success(), "{recovered:?}");
        assert!(!bench.run_directory().exists(), "{files:?}");
    }
    // The folder may also belong to a component that was started by hand.
    let bench = Bench::new();
    std::fs::create_dir_all(bench.run_directory()).expect("a folder");
    std::fs::write(bench.run_directory().join("lidar.sock"), "").expect("written");
    assert_eq!(
        bench::text(&bench.command("recover", &[]).stdout),
        "Nothing\n"
    );
    assert!(bench.run_directory().join("lidar.sock").exists());
}

#[test]
fn an_incomplete_clean_up_does_not_prevent_a_start() {
    let bench = Bench::new();
    std::fs::create_dir_all(bench.run_directory()).expect("a folder");
    // A folder that a killed process has partly emptied, in every order of removal.
    for name in ["rcdeploy.sock", "a.sock"] {
        let socket = std::os::unix::net::UnixListener::bind(bench.run_directory().join(name));
        drop(socket.expect("a socket"));
    }
    std::fs::write(bench.run_directory().join("a.lock"), "").expect("written");
    let up = bench.start_well();
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}
