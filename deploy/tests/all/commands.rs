//! Stopping, starting and restarting components and groups while the rest of the network runs.

use crate::bench::{self, Bench, codes, component, text, well};
use rc_deploy::ComponentState::{self, Running, Stopped};
use rc_deploy::{CommandResult, Component, Policy, Restart};
use rc_deploy_client::status::table;
use rustix::process::Signal;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::time::Duration;

/// Nested groups whose components depend on each other in a chain, and two components outside.
fn grouped() -> Vec<Component> {
    vec![
        well("a.base"),
        component("a.arm.joint", "well", &["a.base"]),
        component("a.arm.grip", "well", &["a.arm.joint"]),
        component("user", "well", &["a.arm.grip"]),
        well("ab"),
    ]
}

fn result(bench: &Bench, verb: &str, names: &[&str]) -> CommandResult {
    let output = bench.command(verb, names);
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).expect("the result of the command")
}

/// The journal entries from index `start` on.
fn since(bench: &Bench, start: usize) -> Vec<String> {
    bench.journal().split_off(start)
}

fn states(bench: &Bench) -> Vec<ComponentState> {
    let status = bench.status();
    status.components.iter().map(|c| c.state).collect()
}

#[test]
fn a_group_stops_in_reverse_and_starts_in_order() {
    let bench = Bench::new();
    let mut up = bench.start(grouped());
    up.await_event("up", None);
    let before = bench.journal().len();
    let said = result(&bench, "restart", &["a"]);
    assert_eq!(said.done, ["a.base", "a.arm.joint", "a.arm.grip"]);
    assert!(said.failed.is_empty(), "{said:?}");
    let happened = since(&bench, before);
    let expected = ["a.arm.grip", "a.arm.joint", "a.base"]
        .map(|name| [format!("{name} stop"), format!("{name} end")]);
    let started = ["a.base", "a.arm.joint", "a.arm.grip"]
        .map(|name| [format!("{name} start"), format!("{name} ready")]);
    assert_eq!(happened, [expected.concat(), started.concat()].concat());

    // A stopped component stays stopped; components that need it keep running.
    let said = result(&bench, "stop", &["a.arm"]);
    assert_eq!(said.done, ["a.arm.joint", "a.arm.grip"]);
    assert_eq!(
        states(&bench),
        [Running, Stopped, Stopped, Running, Running]
    );
    assert!(table(&bench.status()).contains("a.arm.grip   stopped"));
    let said = result(&bench, "start", &["a.arm.grip", "user"]);
    assert_eq!(said.done, ["a.arm.grip", "user"]);
    assert_eq!(
        states(&bench),
        [Running, Stopped, Running, Running, Running]
    );

    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    assert_eq!(
        codes(&events, "user")
            .iter()
            .filter(|c| *c == "starting")
            .count(),
        1
    );
    let stopped = codes(&events, "a.arm.joint");
    assert_eq!(
        stopped.last().map(String::as_str),
        Some("stopped"),
        "{stopped:?}"
    );
    bench.assert_nothing_left();
}

#[test]
fn a_network_of_stopped_components_is_still_up() {
    let bench = Bench::new();
    let always = Component {
        restart: Restart {
            policy: Policy::Always,
            hung: None,
            limit: None,
            backoff: Duration::from_millis(1),
        },
        ..well("a")
    };
    let mut up = bench.start(vec![always, component("b", "well", &["a"])]);
    up.await_event("up", None);
    result(&bench, "stop", &["b", "a"]);
    assert_eq!(
        states(&bench),
        [ComponentState::Stopped, ComponentState::Stopped]
    );
    assert_eq!(result(&bench, "stop", &["a"]).done, ["a"]);
    assert_eq!(result(&bench, "start", &["b"]).done, ["b"]);
    assert_eq!(
        states(&bench),
        [ComponentState::Stopped, ComponentState::Running]
    );
    // None of these starts was by the policy.
    assert!(bench.status().components.iter().all(|c| c.restarts == 0));
    assert!(bench.command("down", &[]).status.success());
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

#[test]
fn a_failed_start_is_reported_and_affects_no_other_component() {
    let bench = Bench::new();
    let short = Component {
        ready: Duration::from_millis(300),
        ..component("late", "turns 0 3 0", &[])
    };
    let mut up = bench.start(vec![
        component("a", "turns 0 4 0", &[]),
        component("b", "well", &["a"]),
        short,
    ]);
    up.await_event("up", None);
    let said = result(&bench, "restart", &["a", "b", "late"]);
    assert_eq!(said.done, ["b"]);
    let failed: Vec<&str> = said.failed.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(failed, ["a", "late"]);
    assert!(said.failed[0].reason.contains("exit status 4"), "{said:?}");
    assert!(said.failed[0].reason.contains("a says hello"), "{said:?}");
    assert!(
        said.failed[1].reason.contains("not ready within 300ms"),
        "{said:?}"
    );
    up.await_event("exited", Some("late"));
    assert_eq!(
        states(&bench),
        [
            ComponentState::Failed,
            ComponentState::Running,
            ComponentState::Failed
        ]
    );
    let said = result(&bench, "start", &["a", "late"]);
    assert_eq!(said.done, ["a", "late"]);
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    // The failed components run again.
    assert_eq!(code, Some(0), "{events:#?}");
    bench.assert_nothing_left();
}

#[test]
fn a_component_that_waits_for_a_failed_one_is_reported() {
    let bench = Bench::new();
    let tried = Component {
        restart: Restart {
            policy: Policy::OnFailure,
            hung: None,
            limit: None,
            backoff: Duration::from_mins(10),
        },
        ..component("a", "turns 0 4 0", &[])
    };
    let mut up = bench.start(vec![tried, component("b", "well", &["a"])]);
    up.await_event("up", None);
    let said = result(&bench, "restart", &["a", "b"]);
    assert_eq!(said.done, [""; 0]);
    assert_eq!(said.failed[1].reason, "waits for a");
    assert_eq!(
        states(&bench),
        [ComponentState::Waiting, ComponentState::Waiting]
    );
    // A command does not wait for the pause of the policy.
    assert_eq!(result(&bench, "start", &["a", "b"]).done, ["a", "b"]);
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// Sends a request without waiting for the reply.
fn ask(bench: &Bench, request: &str) -> BufReader<UnixStream> {
    let socket = bench.run_directory().join("rcdeploy.sock");
    let mut stream = UnixStream::connect(socket).expect("its socket");
    stream
        .set_read_timeout(Some(bench::LIMIT))
        .expect("a limit");
    stream.write_all(request.as_bytes()).expect("asked");
    BufReader::new(stream)
}

fn answer(stream: &mut BufReader<UnixStream>) -> Value {
    let mut line = String::new();
    stream.read_line(&mut line).expect("an answer");
    serde_json::from_str(&line).expect("JSON")
}

#[test]
fn a_later_command_or_stop_replaces_a_pending_one() {
    let bench = Bench::new();
    // It is ready at once at its first start, and never at its second.
    let mut up = bench.start(vec![component("a", "turns 0 3", &[]), well("b")]);
    up.await_event("up", None);
    let restart = r#"{"id":1,"method":"restart","params":{"names":["a"]}}"#.to_owned() + "\n";
    let mut first = ask(&bench, &restart);
    up.await_event("stopped", Some("a"));
    up.await_event("starting", Some("a"));
    assert_eq!(result(&bench, "stop", &["a", "b"]).done, ["a", "b"]);
    let said = answer(&mut first);
    assert_eq!(
        said["result"]["failed"][0]["reason"], "`stop` was asked for meanwhile",
        "{said}"
    );
    let mut second = ask(&bench, &restart);
    up.await_event("starting", Some("a"));
    assert!(bench.command("down", &[]).status.success());
    let said = answer(&mut second);
    assert_eq!(
        said["result"]["failed"][0]["reason"], "the network stops",
        "{said}"
    );
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

#[test]
fn invalid_requests_are_rejected() {
    let bench = Bench::new();
    let mut up = bench.start(grouped());
    up.await_event("up", None);
    let output = bench.command("stop", &["ab", "a.amr"]);
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert!(
        said.contains("no component and no group `a.amr`; did you mean `a.arm`?"),
        "{said}"
    );
    // No part of the requests was executed.
    assert!(
        states(&bench)
            .iter()
            .all(|state| *state == ComponentState::Running)
    );
    for params in [
        "{}",
        r#"{"names":[]}"#,
        r#"{"names":"a"}"#,
        r#"{"names":["ab",7]}"#,
    ] {
        let request = format!("{{\"id\":1,\"method\":\"stop\",\"params\":{params}}}\n");
        let said = answer(&mut ask(&bench, &request));
        assert_eq!(said["error"]["code"], -32602, "{said}");
    }
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// Connects without a request, and keeps the connection.
fn idle(bench: &Bench) -> UnixStream {
    let socket = bench.run_directory().join("rcdeploy.sock");
    UnixStream::connect(socket).expect("its socket")
}

/// No client waits for the others: one asks without end and hardly reads, and others fill all
/// places.
#[test]
fn slow_and_idle_clients_delay_no_other_one() {
    let bench = Bench::new();
    let mut up = bench.start(grouped());
    up.await_event("up", None);
    let mut slow = idle(&bench);
    let wait = Some(Duration::from_millis(1));
    slow.set_write_timeout(wait).expect("a limit");
    // Until its answers, which it does not read, leave no room for requests.
    let status = b"{\"id\":1,\"method\":\"status\"}\n".repeat(100);
    while slow.write_all(&status).is_ok() {}
    let idle: Vec<UnixStream> = (0..rc_management::server::MAX_CLIENTS)
        .map(|_| idle(&bench))
        .collect();
    assert_eq!(result(&bench, "restart", &["ab"]).done, ["ab"]);
    assert_eq!(states(&bench), [Running; 5]);
    // Those that were idle the longest gave way.
    let mut byte = [0];
    let mut first = &idle[0];
    first.set_read_timeout(Some(bench::LIMIT)).expect("a limit");
    assert_eq!(first.read(&mut byte).expect("its end"), 0);
    drop(idle);
    assert!(bench.command("down", &[]).status.success());
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}
