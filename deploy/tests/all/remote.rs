//! Components on another host, without a second machine or a network.

use crate::bench::{Bench, Up, await_end, codes, component, kill, well};
use crate::orphans::{forsaken, forsaking};
use rc_deploy::process::Identity;
use rc_deploy::{Component, ComponentState, ComponentStatus, Host, Policy, Restart};
use rc_test_site::other_host;
use rustix::process::{Pid, Signal, kill_process, kill_process_group};
use std::fs;
use std::io::{Read, Write};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

fn robot() -> Host {
    Host {
        name: "robot".to_owned(),
        address: "robot".to_owned(),
        user: Some("pi".to_owned()),
        workspace: None,
        elsewhere: None,
    }
}

pub(crate) fn on_robot(component: Component) -> Component {
    Component {
        host: Some(robot()),
        ..component
    }
}

fn again(component: Component) -> Component {
    Component {
        restart: Restart {
            policy: Policy::OnFailure,
            hung: None,
            limit: None,
            backoff: Duration::from_millis(50),
        },
        ..component
    }
}

pub(crate) struct Away {
    pub(crate) bench: Bench,
}

impl Away {
    pub(crate) fn new() -> Self {
        let bench = Bench::new();
        other_host::ssh(&bench.path(""));
        Self { bench }
    }

    pub(crate) fn start(&self, components: Vec<Component>) -> Up {
        let ssh = self.bench.path("ssh").display().to_string();
        self.bench
            .start_in(components, &["--relay"], &[("RC_SSH", &ssh)])
    }

    fn run_directory(&self) -> PathBuf {
        let run = self.bench.path("away/run/robocomp");
        run.join(&self.bench.network)
    }

    /// The ssh and the agent of the last connection.
    fn connection(&self) -> [Identity; 2] {
        ["ssh.pid", "agent.pid"].map(|name| {
            let pid = fs::read_to_string(self.bench.path(name)).expect("a pid");
            Identity::of(pid.trim().parse().expect("a pid")).expect("it runs")
        })
    }

    /// Kills the ssh of the last connection.
    pub(crate) fn cut(&self) {
        let [ssh, _] = self.connection();
        let group = Pid::from_raw(ssh.pid).expect("a pid");
        kill_process_group(group, Signal::KILL).expect("it runs");
    }

    pub(crate) fn assert_nothing_left(&self) {
        self.bench.assert_nothing_left();
        assert!(!self.run_directory().exists(), "something is left there");
    }
}

fn component_status(bench: &Bench, name: &str) -> ComponentStatus {
    let status = bench.status();
    let mut components = status.components.into_iter();
    components.find(|c| c.name == name).expect("it")
}

#[test]
fn both_hosts_are_one_network() {
    let away = Away::new();
    let bench = &away.bench;
    let mut up = away.start(vec![
        on_robot(component("far", "chatter 30", &[])),
        component("near", "well", &["far"]),
        on_robot(component("last", "well", &["near"])),
    ]);
    let connected = up.await_event("host-connected", None);
    assert!(connected.contains("2 files were copied"), "{connected}");
    up.await_event("up", None);
    let status = bench.status();
    let hosts: Vec<_> = status.components.iter().map(|c| c.host.clone()).collect();
    assert_eq!(
        hosts,
        [Some("robot".to_owned()), None, Some("robot".to_owned())]
    );
    assert!(status.components.iter().all(|c| c.pid.is_some() && c.ready));
    assert!(away.run_directory().is_dir());
    // The program that runs is a copy.
    let copies = bench
        .path("away/home/.cache/robocomp/networks")
        .join(&bench.network);
    assert!(
        copies
            .join(env!("CARGO_BIN_EXE_rc-test-misbehave").trim_start_matches('/'))
            .exists()
    );
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    let order = [
        "far ready",
        "near start",
        "near ready",
        "last start",
        "last end",
        "near end",
        "far end",
    ];
    let order = order.map(|entry| bench.position(entry));
    assert!(order.is_sorted(), "{:?}", bench.journal());
    let codes = codes(&events, "far");
    assert_eq!(codes.first().map(String::as_str), Some("starting"));
    assert!(codes.iter().any(|code| code == "log"), "{codes:?}");
    let log = fs::read_to_string(bench.log("far")).expect("its log");
    assert!(
        log.lines().skip(1).all(|line| line == "blah ".repeat(20)),
        "{log}"
    );
    away.assert_nothing_left();
}

#[test]
fn a_second_agent_leaves_the_copies_of_a_running_network() {
    let away = Away::new();
    let bench = &away.bench;
    let mut up = away.start(vec![on_robot(component("far", "well", &[]))]);
    up.await_event("up", None);
    let cache = bench.path("away/home/.cache/robocomp");
    let program = env!("CARGO_BIN_EXE_rc-test-misbehave").trim_start_matches('/');
    let copied = cache.join("networks").join(&bench.network).join(program);
    assert!(copied.exists());
    let mut programs = fs::read_dir(&cache).expect("a folder").flatten();
    let rcdeploy =
        programs.find(|file| file.file_name().to_string_lossy().starts_with("rcdeploy-"));
    // A supervisor of another user's machine, whose network of this name has no files.
    let mut second = Command::new(rcdeploy.expect("a copy").path())
        .arg("agent")
        .env("HOME", bench.path("away/home"))
        .env("XDG_RUNTIME_DIR", bench.path("away/run"))
        .env("XDG_STATE_HOME", bench.path("away/state"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut input = second.stdin.take().expect("a pipe");
    writeln!(
        input,
        r#"{{"network":{{"name":"{}","files":[],"environments":[],"services":"[]","memory_pause_ms":1000}}}}"#,
        bench.network
    )
    .expect("it reads");
    let mut said = String::new();
    let mut out = second.stdout.take().expect("a pipe");
    out.read_to_string(&mut said).expect("it ends");
    assert!(!second.wait().expect("a child").success());
    let last = said.lines().last().unwrap_or_default();
    assert!(
        last.contains("refused") && last.contains("already up"),
        "{said}"
    );
    assert!(!said.contains("missing"), "{said}");
    assert!(copied.exists(), "the copy of a component that runs");
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    away.assert_nothing_left();
}

#[test]
fn remote_children_are_killed_before_their_component_restarts() {
    let away = Away::new();
    let bench = &away.bench;
    let parent = component("parent", "turns 8 0", &[]);
    let mut up = away.start(vec![again(on_robot(parent)), on_robot(well("other"))]);
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
    assert_eq!(component_status(bench, "other").restarts, 0);
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    away.assert_nothing_left();
}

#[test]
fn a_forsaken_process_of_another_host_ends_with_its_component() {
    let away = Away::new();
    let bench = &away.bench;
    let mut up = away.start(vec![on_robot(forsaking("far"))]);
    up.await_event("up", None);
    let child = forsaken(bench, "far");
    kill(bench.processes("far start")[0]);
    let told = up.await_event("left-over", Some("far"));
    assert_eq!(told, "killed 1 orphaned processes");
    up.await_event("ready", Some("far"));
    assert!(!child.is_alive());
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    away.assert_nothing_left();
}

/// Components of a lost host restart as their policies say. All others continue.
#[test]
fn a_lost_host_is_reconnected() {
    let away = Away::new();
    let bench = &away.bench;
    let mut up = away.start(vec![
        again(on_robot(well("far"))),
        on_robot(well("once")),
        well("near"),
    ]);
    up.await_event("up", None);
    let there: Vec<Identity> = ["far ready", "once ready"]
        .into_iter()
        .flat_map(|entry| bench.processes(entry))
        .collect();
    let [_, agent] = away.connection();
    fs::write(bench.path("unplugged"), "").expect("written");
    away.cut();
    let lost = up.await_event("host-lost", None);
    assert!(
        lost.contains("host robot: the connection has ended"),
        "{lost}"
    );
    await_end(&there);
    await_end(&[agent]);
    let why = up.await_event("host-unreachable", None);
    assert!(why.contains("does its sshd run"), "{why}");
    assert_eq!(
        component_status(bench, "far").state,
        ComponentState::Waiting
    );
    assert_eq!(
        component_status(bench, "once").state,
        ComponentState::Failed
    );
    assert_eq!(
        component_status(bench, "near").state,
        ComponentState::Running
    );
    fs::remove_file(bench.path("unplugged")).expect("removed");
    up.await_event("host-back", None);
    up.await_event("ready", Some("far"));
    let far = component_status(bench, "far");
    assert_eq!((far.state, far.restarts), (ComponentState::Running, 1));
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    // One component has failed, because its policy does not restart it.
    assert_eq!(code, Some(3), "{events:#?}");
    assert_eq!(
        bench
            .journal()
            .iter()
            .filter(|e| *e == "near start")
            .count(),
        1
    );
    away.assert_nothing_left();
}

#[test]
fn a_killed_agent_leaves_nothing_and_is_replaced() {
    let away = Away::new();
    let bench = &away.bench;
    let mut up = away.start(vec![again(on_robot(component("far", "children", &[])))]);
    up.await_event("up", None);
    let there: Vec<Identity> = ["far start", "far child"]
        .into_iter()
        .flat_map(|entry| bench.processes(entry))
        .collect();
    assert_eq!(there.len(), 3);
    let [_, agent] = away.connection();
    kill(agent);
    up.await_event("host-lost", None);
    await_end(&there);
    up.await_event("host-back", None);
    up.await_event("ready", Some("far"));
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    away.assert_nothing_left();
}

/// The components of the host end in order, the services are created again, and they start.
#[test]
fn a_host_heals_whose_shared_memory_was_removed() {
    let away = Away::new();
    let bench = &away.bench;
    let mut up = away.start(vec![
        on_robot(well("far")),
        on_robot(component("farther", "well", &["far"])),
        well("near"),
    ]);
    up.await_event("up", None);
    let cleanups = bench.cleanups();
    fs::write(bench.path("away/run/missing"), "").expect("written");
    let lost = up.await_event("memory-lost", None);
    assert!(lost.starts_with("host robot: shared memory"), "{lost}");
    let back = up.await_event("memory-back", None);
    assert!(back.starts_with("host robot: all components"), "{back}");
    assert_eq!(bench.status().troubles, []);
    assert_eq!(bench.cleanups(), cleanups + 1);
    let journal = bench.journal();
    let starts = |name: &str| {
        let wanted = format!("{name} start");
        journal.iter().filter(|entry| **entry == wanted).count()
    };
    let counts = ["far", "farther", "near"].map(starts);
    assert_eq!(counts, [2, 2, 1], "{journal:?}");
    let last = |entry: &str| journal.iter().rposition(|one| one == entry);
    let order = [
        "farther end",
        "far end",
        "far start",
        "far ready",
        "farther start",
    ]
    .map(last);
    assert!(order.is_sorted(), "{journal:?}");
    up.signal(Signal::INT);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    away.assert_nothing_left();
}

#[test]
fn a_silent_host_is_lost() {
    let away = Away::new();
    let mut up = away.start(vec![again(on_robot(well("far")))]);
    up.await_event("up", None);
    let [_, agent] = away.connection();
    let signal = |signal| {
        let pid = Pid::from_raw(agent.pid).expect("a pid");
        kill_process(pid, signal).expect("it runs");
    };
    signal(Signal::STOP);
    let lost = up.await_event("host-lost", None);
    assert!(lost.contains("no message came from it"), "{lost}");
    // The next connection waits until the old agent has left the network.
    signal(Signal::CONT);
    up.await_event("host-back", None);
    up.await_event("ready", Some("far"));
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    away.assert_nothing_left();
}

#[test]
fn nothing_starts_if_a_host_is_unreachable() {
    let away = Away::new();
    fs::write(away.bench.path("unplugged"), "").expect("written");
    let up = away.start(vec![well("near"), on_robot(well("far"))]);
    let (code, events) = up.end();
    assert_eq!(code, Some(3));
    let error = events.iter().find(|e| e["code"] == "host-unreachable");
    let message = error.expect("an error")["message"].to_string();
    assert!(message.contains("`ssh pi@robot true`"), "{message}");
    assert!(message.contains("No route to host"), "{message}");
    assert!(!message.contains("\\r"), "{message}");
    assert_eq!(away.bench.journal(), Vec::<String>::new());
    away.assert_nothing_left();
}

#[test]
fn a_failed_remote_component_is_reported_with_its_last_output() {
    let away = Away::new();
    let up = away.start(vec![
        well("near"),
        on_robot(component("far", "exit 7", &["near"])),
    ]);
    let (code, events) = up.end();
    assert_eq!(code, Some(3));
    let failed = events.iter().find(|e| e["code"] == "start-failed");
    let message = failed.expect("an error")["message"].to_string();
    for word in ["exit status 7", "far is about to fail"] {
        assert!(message.contains(word), "{message}");
    }
    away.assert_nothing_left();
}

#[test]
fn killing_the_supervisor_stops_the_remote_components() {
    let away = Away::new();
    let bench = &away.bench;
    let mut up = away.start(vec![on_robot(component("far", "deaf", &[]))]);
    up.await_event("up", None);
    let [ssh, agent] = away.connection();
    let far = bench.processes("far start");
    up.kill();
    await_end(&[ssh, agent]);
    await_end(&far);
    assert!(!away.run_directory().exists(), "something is left there");
    // The network can be started again.
    let mut up = away.start(vec![on_robot(well("far"))]);
    let connected = up.await_event("host-connected", None);
    assert!(
        connected.contains("nothing had to be copied"),
        "{connected}"
    );
    up.await_event("up", None);
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    away.assert_nothing_left();
}

#[test]
fn a_missing_remote_workspace_is_reported() {
    let away = Away::new();
    let bench = &away.bench;
    let workspace = bench.path("workspace");
    let mut far = on_robot(well("far"));
    far.host.as_mut().expect("a host").workspace = Some(workspace.clone());
    let (code, events) = away.start(vec![far.clone()]).end();
    assert_eq!(code, Some(3));
    let failed = events.iter().find(|e| e["code"] == "start-failed");
    let message = failed.expect("an error")["message"].to_string();
    assert!(message.contains("workspace does not exist"), "{message}");
    fs::create_dir(&workspace).expect("a folder");
    let mut up = away.start(vec![far]);
    up.await_event("up", None);
    let [there] = bench.processes("far start")[..] else {
        panic!("{:?}", bench.journal())
    };
    let directory = fs::read_link(format!("/proc/{}/cwd", there.pid)).expect("a link");
    assert_eq!(directory, workspace.canonicalize().expect("a folder"));
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    away.assert_nothing_left();
}

/// A stop during the connection attempt does not wait for the attempt.
#[test]
fn an_unresponsive_host_does_not_delay_a_stop() {
    let away = Away::new();
    let ssh = "#!/bin/sh\necho waiting > FOLDER/ssh.pid\nexec sleep 600\n";
    let ssh = ssh.replace("FOLDER", &away.bench.path("").display().to_string());
    fs::write(away.bench.path("ssh"), ssh).expect("written");
    let mut up = away.start(vec![well("near"), on_robot(well("far"))]);
    up.await_event("host-connecting", None);
    assert_eq!(
        component_status(&away.bench, "near").state,
        ComponentState::Waiting
    );
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    assert_eq!(away.bench.journal(), Vec::<String>::new());
    away.assert_nothing_left();
}

/// Lines with many escapes, overlong lines, and invalid lines.
#[test]
fn invalid_messages_of_a_remote_component_are_tolerated() {
    let away = Away::new();
    let mut up = away.start(vec![
        on_robot(component("far", "garbage", &[])),
        on_robot(well("well")),
    ]);
    up.await_event("up", None);
    up.signal(Signal::INT);
    let (code, events) = up.end();
    let far = codes(&events, "far");
    let garbage = far.iter().filter(|code| *code == "garbage").count();
    assert_eq!((code, garbage), (Some(0), 1), "{events:#?}");
    assert!(events.iter().all(|e| e["code"] != "host-lost"));
    let mut up = away.start(vec![on_robot(component("shut", "shut", &[]))]);
    up.await_event("link-closed", Some("shut"));
    up.signal(Signal::INT);
    assert_eq!(up.end().0, Some(0));
    away.assert_nothing_left();
}
