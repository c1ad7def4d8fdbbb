//! Misbehaving programs, full disks and wrong use: the network tolerates them, or reports a remedy.

use crate::bench::{self, Bench, await_end, codes, component, kill, text, well};
use rc_deploy::process::Identity;
use rc_deploy::{Component, ComponentState, Policy, Restart};
use rc_test_support::python;
use rustix::process::Signal;
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// The maximum memory of a supervisor in kB, whatever components print. This build is not
/// optimised.
const MEMORY: u64 = 64 * 1024;

/// The error of `up` about a program that cannot be executed.
fn refusal(name: &str, content: &[u8], mode: u32) -> String {
    let bench = Bench::new();
    let program = bench.path(name);
    std::fs::write(&program, content).expect("written");
    std::fs::set_permissions(&program, PermissionsExt::from_mode(mode)).expect("it is ours");
    let bad = Component {
        executable: program,
        ..well("bad")
    };
    let mut up = bench.start(vec![bad]);
    let message = up.await_event("start-failed", Some("bad"));
    assert_eq!(up.end().0, Some(3));
    bench.assert_nothing_left();
    message
}

#[test]
fn a_program_that_cannot_be_executed_is_reported_with_a_remedy() {
    let message = refusal("plain", b"#!/bin/sh\n", 0o644);
    assert!(message.contains("Permission denied"), "{message}");
    assert!(
        message.contains("`chmod +x ") && message.contains("plain`"),
        "{message}"
    );
    let message = refusal("noise", b"\x7fELF and what is none", 0o755);
    assert!(
        message.contains("not a program for this machine"),
        "{message}"
    );
    let message = refusal("script", b"#!/nowhere/interpreter\n", 0o755);
    assert!(message.contains("No such file"), "{message}");
}

#[test]
fn children_are_killed_before_their_component_restarts() {
    let bench = Bench::new();
    let parent = Component {
        restart: Restart {
            policy: Policy::OnFailure,
            hung: None,
            limit: None,
            backoff: Duration::from_millis(1),
        },
        ..component("parent", "turns 8 0", &[])
    };
    let mut up = bench.start(vec![parent, well("other")]);
    let message = up.await_event("left-over", Some("parent"));
    assert!(
        message.starts_with("killed 1 orphaned processes"),
        "{message}"
    );
    up.await_event("ready", Some("parent"));
    let children: Vec<i32> = bench
        .entries()
        .iter()
        .filter_map(|line| line.strip_prefix("parent child ")?.parse().ok())
        .collect();
    assert_eq!(children.len(), 1);
    assert!(Identity::of(children[0]).is_none());
    assert_eq!(bench.status().components[1].restarts, 0);
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    assert_eq!(codes(&events, "other").len(), 4);
    bench.assert_nothing_left();
}

#[test]
fn a_component_survives_the_loss_of_its_output() {
    let bench = Bench::new();
    let program = env!("CARGO_BIN_EXE_rc-test-misbehave");
    let mute = Component {
        executable: "/bin/sh".into(),
        args: ["-c", &format!("exec >&- 2>&-; exec {program} mute well")]
            .map(str::to_owned)
            .to_vec(),
        ..well("mute")
    };
    let mut up = bench.start(vec![mute]);
    up.await_event("up", None);
    assert_eq!(bench.status().components[0].state, ComponentState::Running);
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// The peak memory of a process, in kB.
fn peak(process: Identity) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", process.pid));
    let status = status.expect("it runs");
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let number = line.and_then(|line| line.split_whitespace().next());
    number.expect("a number").parse().expect("a number")
}

#[test]
fn a_gigabyte_of_log_neither_blocks_nor_grows_the_supervisor() {
    // In the foreground too, in a terminal that nothing reads.
    for flags in [&[][..], &["--relay"]] {
        let bench = Bench::new();
        let plan = bench.write(vec![component("loud", "flood 1024", &[]), well("still")]);
        let mut driver = bench.driver(&["up", &plan, "--json"]);
        driver.args(flags).stdout(Stdio::piped());
        let mut up = driver.spawn().expect("it starts");
        let pid = up.id().try_into().expect("a pid");
        let supervisor = Identity::of(pid).expect("it runs");
        let end = Instant::now() + 4 * bench::LIMIT;
        let mut answers = 0;
        while !bench.journal().contains(&"loud flooded".to_owned()) {
            assert!(Instant::now() < end, "the component still prints");
            // A request waits at most three seconds. On a busy machine some take longer, but never all.
            if bench.journal().contains(&"loud ready".to_owned()) {
                let status = bench.command("status", &[]);
                answers += usize::from(status.status.success());
            }
        }
        assert!(answers > 0, "no request was served meanwhile");
        assert_eq!(bench.status().components[1].state, ComponentState::Running);
        assert!(peak(supervisor) < MEMORY, "{} kB", peak(supervisor));
        let down = bench.command("down", &[]);
        assert!(down.status.success(), "{down:?}");
        drop(up.stdout.take());
        assert_eq!(up.wait().expect("it ended").code(), Some(0));
        bench.assert_nothing_left();
        let last = bench.command("logs", &["loud"]);
        assert!(last.status.success() && text(&last.stdout).starts_with("blah"));
    }
}

#[test]
fn only_one_of_several_concurrent_starts_succeeds() {
    let bench = Bench::new();
    let plan = bench.write(vec![well("a")]);
    let mut ups: Vec<_> = (0..6).map(|_| bench.start_plan(&plan, &[], &[])).collect();
    // Each process decides at once whether it starts the network. None waits for another one's end.
    let mut first = Vec::new();
    for up in ups.drain(..) {
        let mut up = up;
        match up.await_either(["up", "refused"]) {
            (code, _) if code == "up" => first.push(up),
            (_, message) => {
                assert!(message.contains("is already up"), "{message}");
                assert_eq!(up.end().0, Some(3));
            }
        }
    }
    assert_eq!(first.len(), 1);
    assert_eq!(bench.journal(), ["a start", "a ready"]);
    let up = first.remove(0);
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// How to run a program in a mount namespace of its own. `None` if this user may not.
fn unshare() -> Option<&'static [&'static str]> {
    static FOUND: OnceLock<Option<&[&str]>> = OnceLock::new();
    *FOUND.get_or_init(|| {
        let ways: [&[&str]; 2] = [&["-m"], &["-r", "-m"]];
        ways.into_iter().find(|way| {
            let mut command = Command::new("unshare");
            command
                .args(*way)
                .args(["mount", "-t", "tmpfs", "tmpfs", "/mnt"]);
            command
                .stderr(Stdio::null())
                .status()
                .is_ok_and(|s| s.success())
        })
    })
}

/// An `up` for which the folder `name` of the bench is a disk of `size` kB. `None` if the system
/// does not allow that.
fn up_on_a_small_disk(
    bench: &Bench,
    test: &str,
    name: &str,
    kilobytes: u32,
    components: Vec<Component>,
) -> Option<bench::Up> {
    let Some(way) = unshare() else {
        python::skipped(test, "this user may not mount (`unshare -m`)");
        return None;
    };
    let place = bench.path(name);
    std::fs::create_dir_all(&place).expect("a folder");
    let place = place.display();
    let script =
        format!("mount -t tmpfs -o size={kilobytes}k,mode=700 tmpfs {place} && exec \"$@\"");
    let way: Vec<&str> = [&["unshare"], way, &["sh", "-c", &script, "sh"]].concat();
    Some(bench.start_plan(&bench.write(components), &way, &[]))
}

#[test]
fn a_full_disk_loses_logs_only() {
    let bench = Bench::new();
    let test = "a_full_disk_loses_logs_only";
    let components = vec![
        component("loud", "flood 1", &[]),
        component("next", "well", &["loud"]),
    ];
    let Some(mut up) = up_on_a_small_disk(&bench, test, "state", 16, components) else {
        return;
    };
    up.await_event("up", None);
    assert_eq!(bench.status().components[0].state, ComponentState::Running);
    // The guard also logs to this disk, and works all the same.
    let guard = Identity::of(bench.status().guard.expect("a guard")).expect("it runs");
    await_journal(&bench, "loud flooded");
    up.kill();
    await_end(&[guard]);
    bench.assert_nothing_left();
    assert_eq!(bench.cleanups(), 1);
}

#[test]
fn a_program_that_fails_at_a_full_disk_is_reported_as_such() {
    let bench = Bench::new();
    let test = "a_program_that_fails_at_a_full_disk_is_reported_as_such";
    // It panics if it cannot print, as `println!` does.
    let components = vec![
        filler(&bench, "state/rest"),
        component("bad", "exit 7", &["filler"]),
    ];
    let Some(mut up) = up_on_a_small_disk(&bench, test, "state", 16, components) else {
        return;
    };
    let message = up.await_event("start-failed", Some("bad"));
    assert!(
        message.contains("exit status 101") && message.contains("its disk is full"),
        "{message}"
    );
    assert_eq!(up.end().0, Some(3));
    bench.assert_nothing_left();
}

#[test]
fn a_process_killed_by_full_shared_memory_is_reported_as_such() {
    let bench = Bench::new();
    let mut up = bench.start(vec![component("bad", "bus", &[])]);
    let message = up.await_event("start-failed", Some("bad"));
    assert!(
        message.contains("(SIGBUS), which is what happens where the shared memory is full")
            && message.contains("--shm-size"),
        "{message}"
    );
    assert_eq!(up.end().0, Some(3));
    bench.assert_nothing_left();
}

#[test]
fn a_network_survives_a_full_run_directory() {
    let bench = Bench::new();
    let test = "a_network_survives_a_full_run_directory";
    let filler = filler(&bench, "run/rest");
    let components = vec![filler, component("next", "well", &["filler"])];
    let Some(mut up) = up_on_a_small_disk(&bench, test, "run", 64, components) else {
        return;
    };
    let message = up.await_event("not-written", None);
    assert!(
        message.contains("No space left") && message.contains("XDG_RUNTIME_DIR"),
        "{message}"
    );
    up.await_event("up", None);
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    bench.assert_no_process_left();
}

#[test]
fn a_disk_that_is_full_before_the_start_is_reported() {
    let bench = Bench::new();
    let test = "a_disk_that_is_full_before_the_start_is_reported";
    // One page: enough for the lock file only.
    let Some(mut up) = up_on_a_small_disk(&bench, test, "run", 4, vec![well("a")]) else {
        return;
    };
    let message = up.await_event("refused", None);
    assert!(
        message.contains("No space left") && message.contains("XDG_RUNTIME_DIR"),
        "{message}"
    );
    assert_eq!(up.end().0, Some(3));
    assert!(bench.journal().is_empty());
}

/// A component that fills the disk of this file.
fn filler(bench: &Bench, file: &str) -> Component {
    let path = bench.path(file).display().to_string();
    Component {
        env: [("RC_TEST_FILL".to_owned(), path)].into(),
        ..component("filler", "fill", &[])
    }
}

fn await_journal(bench: &Bench, entry: &str) {
    let end = Instant::now() + bench::LIMIT;
    while !bench.journal().iter().any(|line| line == entry) {
        assert!(Instant::now() < end, "no `{entry}`");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_supervisor_killed_at_a_full_disk_leaves_nothing() {
    let bench = Bench::new();
    let test = "a_supervisor_killed_at_a_full_disk_leaves_nothing";
    let filler = filler(&bench, "run/rest");
    let deaf = Component {
        stop: Duration::from_millis(100),
        ..component("deaf", "deaf", &["filler"])
    };
    let Some(mut up) = up_on_a_small_disk(&bench, test, "run", 64, vec![filler, deaf]) else {
        return;
    };
    up.await_event("up", None);
    let processes = [
        bench.processes("filler start"),
        bench.processes("deaf start"),
    ]
    .concat();
    assert_eq!(processes.len(), 2);
    kill(up.identity());
    await_end(&processes);
    bench.assert_no_process_left();
}
