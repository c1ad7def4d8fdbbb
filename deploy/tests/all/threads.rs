//! Components as threads of one process: they start, hang, fail, restart and stop with it.

use crate::bench::{Bench, await_end, codes, text};
use crate::remote::{Away, on_robot};
use rc_deploy::process::Identity;
use rc_deploy::{Component, ComponentState};
use rc_deploy_network::plan::{Policy, Restart, Thread};
use rustix::process::Signal;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

/// A component `neighbour` in the process `eyes` that does what `does` says.
fn thread(bench: &Bench, name: &str, does: &str, after: &[&str]) -> Component {
    let programs = Path::new(env!("CARGO_BIN_EXE_rc-test-misbehave"));
    let set = format!("does={does}");
    let bind = format!("BatteryStatus={name}/BatteryStatus");
    let words = ["--network", &bench.network, "--name", name];
    let more = ["--set", &set, "--bind", &bind];
    Component {
        thread: Some(Thread {
            process: "eyes".to_owned(),
            component: "neighbour".to_owned(),
        }),
        args: words.into_iter().chain(more).map(str::to_owned).collect(),
        after: after.iter().map(|&name| name.to_owned()).collect(),
        middleware: "iceoryx2".to_owned(),
        optional: vec!["other".to_owned()],
        restart: Restart {
            policy: Policy::OnFailure,
            limit: Some((1, Duration::from_mins(1))),
            backoff: Duration::from_millis(10),
            ..Restart::default()
        },
        ..Component::new(name, programs.with_file_name("rc-test-together"), "/")
    }
}

#[test]
fn threads_share_a_process_and_are_seen_one_by_one() {
    let bench = Bench::new();
    let outside = crate::bench::component("outside", "well", &["right"]);
    let mut up = bench.start(vec![
        thread(&bench, "left", "", &[]),
        thread(&bench, "right", "", &["left"]),
        outside,
    ]);
    up.await_event("up", None);
    let status = bench.status();
    let [left, right, outside] = &status.components[..] else {
        panic!("{status:#?}");
    };
    assert!(left.pid.is_some() && left.pid == right.pid && left.pid != outside.pid);
    for thread in [left, right] {
        assert_eq!(thread.state, ComponentState::Running);
        assert_eq!(thread.process.as_deref(), Some("eyes"));
        assert_eq!(thread.log, bench.log(&thread.name));
        let log = std::fs::read_to_string(&thread.log).expect("a log");
        assert!(log.contains(&format!("{} begins", thread.name)), "{log}");
    }
    assert_eq!(outside.process, None);
    // One thread has no life of its own.
    let refused = bench.command("stop", &["left"]);
    assert!(!refused.status.success(), "{refused:?}");
    let message = text(&refused.stderr);
    assert!(
        message.contains("`stop eyes` means right as well"),
        "{message}"
    );
    let pid = left.pid;
    assert!(bench.command("restart", &["eyes"]).status.success());
    let again = bench.status();
    assert!(again.components[0].ready && again.components[0].pid != pid);
    assert_eq!(again.components[0].pid, again.components[1].pid);
    assert!(bench.command("stop", &["left", "right"]).status.success());
    for stopped in &bench.status().components[..2] {
        assert_eq!(
            (stopped.state, stopped.pid),
            (ComponentState::Stopped, None)
        );
    }
    assert!(bench.command("start", &["eyes"]).status.success());
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    for name in ["left", "right"] {
        assert_eq!(
            codes(&events, name)[..3],
            ["starting", "state", "ready"],
            "{events:#?}"
        );
        let log = std::fs::read_to_string(bench.log(name)).expect("a log");
        assert!(log.contains(&format!("{name} ends")), "{log}");
    }
    bench.assert_nothing_left();
}

#[test]
fn a_panic_ends_the_process_which_restarts_as_a_whole() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        thread(&bench, "calm", "", &[]),
        thread(&bench, "wild", "panic", &["calm"]),
    ]);
    let message = up.await_event("exited", Some("eyes"));
    for part in ["exit status 3", "wild: error:", "the cable burns"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    up.await_event("starting", Some("calm"));
    up.await_event("gave-up", Some("eyes"));
    let (code, events) = up.end();
    assert_eq!(code, Some(3), "{events:#?}");
    let starts = codes(&events, "calm");
    let starts = starts.iter().filter(|code| *code == "starting").count();
    assert_eq!(starts, 2, "{events:#?}");
    bench.assert_nothing_left();
}

#[test]
fn a_thread_that_fails_at_its_start_stops_the_start() {
    let bench = Bench::new();
    let up = bench.start(vec![
        thread(&bench, "calm", "", &[]),
        thread(&bench, "loose", "fail at start", &["calm"]),
    ]);
    let (code, events) = up.end();
    assert_eq!(code, Some(3), "{events:#?}");
    let failed = events.iter().find(|event| event["code"] == "start-failed");
    let message = failed.expect("an event")["message"].to_string();
    assert!(message.contains("the cable is loose"), "{message}");
    bench.assert_nothing_left();
}

#[test]
fn a_thread_that_hangs_is_named_and_the_others_run_on() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        thread(&bench, "stuck", "hang", &[]),
        thread(&bench, "calm", "", &[]),
    ]);
    up.await_event("hung", Some("stuck"));
    let states = bench.status().components;
    let states = states.iter().map(|component| component.state);
    assert!(
        [ComponentState::Hung, ComponentState::Running]
            .into_iter()
            .eq(states)
    );
    up.signal(Signal::TERM);
    let message = up.await_event("killed", Some("eyes"));
    assert!(message.contains("is killed"), "{message}");
    up.end();
    bench.assert_nothing_left();
}

#[test]
fn a_thread_that_ends_in_order_ends_alone() {
    let bench = Bench::new();
    let mut up = bench.start(vec![
        thread(&bench, "short", "stop", &[]),
        thread(&bench, "calm", "", &[]),
    ]);
    up.await_event("exited", Some("short"));
    let status = bench.status();
    let states = status.components.iter().map(|component| component.state);
    assert!(
        [ComponentState::Done, ComponentState::Running]
            .into_iter()
            .eq(states),
        "{status:#?}"
    );
    let refused = bench.command("start", &["eyes"]);
    let message = text(&refused.stdout);
    assert!(message.contains("restart `eyes`"), "{message}");
    assert!(bench.command("stop", &["eyes"]).status.success());
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

#[test]
fn threads_share_a_process_on_another_host() {
    let away = Away::new();
    let bench = &away.bench;
    let mut up = away.start(vec![
        on_robot(thread(bench, "left", "", &[])),
        on_robot(thread(bench, "right", "", &["left"])),
        crate::bench::component("near", "well", &["right"]),
    ]);
    up.await_event("up", None);
    let status = bench.status();
    let [left, right, near] = &status.components[..] else {
        panic!("{status:#?}");
    };
    assert!(left.pid.is_some() && left.pid == right.pid && left.pid != near.pid);
    for thread in [left, right] {
        assert_eq!(thread.host.as_deref(), Some("robot"));
        assert_eq!(thread.process.as_deref(), Some("eyes"));
        // Each has its own management, which is reached from here.
        let socket = bench.run_directory().join(format!("{}.sock", thread.name));
        let mut stream = UnixStream::connect(socket).expect("its socket");
        let limit = Some(crate::bench::LIMIT);
        stream.set_read_timeout(limit).expect("a limit");
        let asked = stream.write_all(b"{\"id\":1,\"method\":\"status\"}\n");
        asked.expect("it is asked");
        let mut answer = String::new();
        let read = BufReader::new(stream).read_line(&mut answer);
        read.expect("an answer");
        assert!(answer.contains(&format!("\"{}\"", thread.name)), "{answer}");
    }
    let refused = bench.command("stop", &["left"]);
    let message = text(&refused.stderr);
    assert!(message.contains("`stop eyes`"), "{message}");
    let pid = left.pid;
    assert!(bench.command("restart", &["eyes"]).status.success());
    let again = bench.status().components;
    assert!(again[0].ready && again[0].pid != pid && again[0].pid == again[1].pid);
    assert!(bench.command("stop", &["eyes"]).status.success());
    let stopped = bench.status().components;
    let states = stopped.iter().map(|one| one.state);
    let wanted = [
        ComponentState::Stopped,
        ComponentState::Stopped,
        ComponentState::Running,
    ];
    assert!(wanted.into_iter().eq(states), "{stopped:#?}");
    assert!(bench.command("start", &["eyes"]).status.success());
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    for name in ["left", "right"] {
        let log = std::fs::read_to_string(bench.log(name)).expect("a log");
        for part in ["begins", "ends"] {
            assert!(log.contains(&format!("{name} {part}")), "{log}");
        }
    }
    away.assert_nothing_left();
}

#[test]
fn a_process_on_another_host_fails_and_comes_back_as_a_whole() {
    let away = Away::new();
    let bench = &away.bench;
    let mut up = away.start(vec![
        on_robot(thread(bench, "calm", "", &[])),
        on_robot(thread(bench, "wild", "panic", &["calm"])),
    ]);
    let message = up.await_event("exited", Some("eyes"));
    for part in ["exit status 3", "wild: error:", "the cable burns"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    up.await_event("gave-up", Some("eyes"));
    let (code, events) = up.end();
    assert_eq!(code, Some(3), "{events:#?}");
    let starts = codes(&events, "calm");
    let starts = starts.iter().filter(|code| *code == "starting").count();
    assert_eq!(starts, 2, "{events:#?}");
    away.assert_nothing_left();
}

#[test]
fn a_lost_host_ends_its_process_and_starts_it_again() {
    let away = Away::new();
    let bench = &away.bench;
    let mut up = away.start(vec![
        on_robot(thread(bench, "short", "stop", &[])),
        on_robot(thread(bench, "calm", "", &[])),
    ]);
    // One that ends in order ends alone there, too.
    up.await_event("exited", Some("short"));
    let status = bench.status().components;
    assert_eq!(
        [status[0].state, status[1].state],
        [ComponentState::Done, ComponentState::Running]
    );
    let process = Identity::of(status[1].pid.expect("a process")).expect("it runs");
    away.cut();
    up.await_event("host-lost", None);
    await_end(&[process]);
    up.await_event("host-back", None);
    up.await_event("ready", Some("calm"));
    let again = bench.status().components;
    assert!(again[1].pid.is_some() && again[1].pid != status[1].pid);
    up.signal(Signal::TERM);
    up.end();
    away.assert_nothing_left();
}
