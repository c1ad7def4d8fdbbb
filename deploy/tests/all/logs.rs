//! Logs are bounded whatever components print, and a full disk stops no component.

use crate::bench::{self, Bench, component, text, well};
use rc_deploy::ComponentState;
use rustix::process::Signal;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Instant;

/// The limit of `--small-logs`.
const LIMIT: u64 = 256 * 1024;

fn older(bench: &Bench, name: &str) -> PathBuf {
    bench.log(name).with_extension("log.1")
}

fn length(path: &PathBuf) -> u64 {
    std::fs::metadata(path).map_or(0, |file| file.len())
}

fn number(line: &str) -> Option<u64> {
    line.strip_prefix("line ")?.split(' ').next()?.parse().ok()
}

#[test]
fn a_log_is_followed_and_shown_across_its_rotation() {
    const LINES: u64 = 10_000;
    let bench = Bench::new();
    let plan = bench.write(vec![component("a", &format!("count {LINES}"), &[])]);
    let up = bench
        .driver(&["up", &plan, "--detach", "--small-logs"])
        .output();
    assert!(up.expect("it runs").status.success());
    let mut follow = bench.driver(&["logs", &bench.network, "a", "--follow"]);
    let mut follow = follow.stdout(Stdio::piped()).spawn().expect("it runs");
    let out = BufReader::new(follow.stdout.take().expect("a pipe"));
    let mut numbers: Vec<u64> = Vec::new();
    for line in out.lines().map_while(Result::ok) {
        numbers.extend(number(&line));
        if numbers.last() == Some(&(LINES - 1)) {
            break;
        }
    }
    follow.kill().expect("it runs");
    follow.wait().expect("it ended");
    assert!(
        numbers.is_sorted_by(|a, b| a < b),
        "printed twice, or in another order"
    );
    // Lines printed at the moment of a rotation may be lost. The output begins with the last ten
    // lines.
    assert!(
        numbers.len() as u64 > LINES * 9 / 10,
        "{} of {LINES}",
        numbers.len()
    );
    let (log, older) = (bench.log("a"), older(&bench, "a"));
    let part = std::fs::read_to_string(&older).expect("an older part");
    assert!(part.starts_with("[rcdeploy: part "), "{}", &part[..80]);
    assert!(length(&older) > LIMIT);
    let start = Instant::now();
    while length(&log) > LIMIT {
        assert!(start.elapsed() < bench::LIMIT, "the log stays too long");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert!(bench.command("down", &[]).status.success());
    bench.assert_nothing_left();
    // The next start begins with empty logs.
    let mut up = bench.start_with(vec![well("a")], &["--small-logs"]);
    up.await_event("up", None);
    assert!(!older.exists());
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
}

#[test]
fn endless_output_does_not_exceed_the_limit_of_a_log() {
    let bench = Bench::new();
    let mut up = bench.start_with(
        vec![component("loud", "chatter 1500", &[]), well("calm")],
        &["--small-logs"],
    );
    up.await_event("up", None);
    let (log, older) = (bench.log("loud"), older(&bench, "loud"));
    let start = Instant::now();
    while length(&older) == 0 || length(&log) > LIMIT || start.elapsed().as_millis() < 1500 {
        assert!(start.elapsed() < bench::LIMIT, "the log stays too long");
        // The supervisor serves other requests meanwhile.
        assert!(
            bench
                .status()
                .components
                .iter()
                .all(|c| c.state == ComponentState::Running)
        );
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert!(length(&older) < 4 * LIMIT, "{}", length(&older));
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// A command in a user namespace in which a script has run before. `None` if the system does not
/// allow that.
fn within(bench: &Bench, script: &str, arguments: &[&str]) -> Option<Command> {
    let state = bench.path("state");
    std::fs::create_dir_all(&state).expect("a folder");
    let script = format!("{script} && exec \"$@\"");
    let within = [
        "--user",
        "--map-root-user",
        "--mount",
        "sh",
        "-c",
        &script,
        "sh",
    ];
    let mut probe = Command::new("unshare");
    probe.args(within).arg("true").env("XDG_STATE_HOME", &state);
    let driver = bench.driver(arguments);
    let possible = probe.output().is_ok_and(|output| output.status.success());
    possible.then(|| {
        let mut command = Command::new("unshare");
        command
            .args(within)
            .arg(driver.get_program())
            .args(driver.get_args());
        for (name, value) in driver.get_envs() {
            command.env(name, value.unwrap_or_default());
        }
        command
    })
}

/// A user has a limited number of instances of inotify.
#[test]
fn logs_are_followed_without_inotify() {
    let bench = Bench::new();
    let mut up = bench.start(vec![component("a", "murmur", &[])]);
    up.await_event("up", None);
    let none = "echo 0 > /proc/sys/user/max_inotify_instances";
    let follow = ["logs", &bench.network, "a", "--follow"];
    let Some(mut follow) = within(&bench, none, &follow) else {
        return bench::skipped(
            "logs_are_followed_without_inotify",
            "unshare limits no instances of inotify",
        );
    };
    let mut follow = follow.stdout(Stdio::piped()).spawn().expect("it runs");
    let out = BufReader::new(follow.stdout.take().expect("a pipe"));
    // It begins with the last ten lines.
    let lines: Vec<String> = out.lines().map_while(Result::ok).take(30).collect();
    assert_eq!(lines.len(), 30, "{lines:?}");
    let numbers: Vec<u64> = lines.iter().filter_map(|line| number(line)).collect();
    assert!(numbers.is_sorted_by(|a, b| a + 1 == *b), "{numbers:?}");
    follow.kill().expect("it runs");
    follow.wait().expect("it ended");
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

#[test]
fn a_full_disk_is_reported_and_stops_no_component() {
    let bench = Bench::new();
    let plan = bench.write(vec![well("a"), component("filler", "ballast", &[])]);
    let flags = ["up", &plan, "--json", "--small-logs", "--hasty"];
    let disk = "mount -t tmpfs -o size=4m tmpfs \"$XDG_STATE_HOME\"";
    let Some(mut command) = within(&bench, disk, &flags) else {
        bench::skipped(
            "a_full_disk_is_reported_and_stops_no_component",
            "unshare gives no disk of one's own",
        );
        return;
    };
    let mut up = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it runs");
    let mut out = BufReader::new(up.stdout.take().expect("a pipe")).lines();
    let mut until = |code: &str| {
        for line in out.by_ref().map_while(Result::ok) {
            let event: Value = serde_json::from_str(&line).expect("JSON lines");
            if event["code"] == code {
                return event["message"].as_str().expect("a message").to_owned();
            }
        }
        panic!("no {code}");
    };
    let message = until("disk-full");
    assert!(message.contains("robocomp"), "{message}");
    let is_full = || {
        let troubles = bench.status().troubles;
        troubles.iter().any(|trouble| trouble.code == "disk-full")
    };
    assert!(is_full());
    let restart = bench.command("restart", &["a"]);
    let said = text(&restart.stdout);
    assert!(said.contains(r#""done":["a"]"#), "{restart:?}");
    assert!(
        bench
            .status()
            .components
            .iter()
            .all(|c| c.state == ComponentState::Running)
    );
    assert!(bench.command("stop", &["filler"]).status.success());
    until("disk-free");
    assert!(!is_full());
    assert!(bench.command("down", &[]).status.success());
    until("down");
    assert!(up.wait().expect("it ended").success());
    bench.assert_nothing_left();
}
