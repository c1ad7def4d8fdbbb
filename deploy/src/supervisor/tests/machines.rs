//! What a supervisor makes of the events of its machines.

use super::net::{Net, on};
use super::{component, exit};
use crate::remote::{AgentReady, HostEvent, SupervisorMessage};
use crate::supervisor::supervise::StopReason;
use rc_management::agent::AgentMessage;
use std::path::PathBuf;
use std::time::Instant;

#[test]
fn orphans_are_reported_if_there_are_some() {
    let mut net = Net::up(vec![component("a")]);
    net.left_over("a", 0);
    net.left_over("a", 2);
    assert_eq!(net.events(), ["! a left-over: killed 2 orphaned processes"]);
    net.take_agent_message(0, AgentMessage::Finished { left: 0 });
    net.take_agent_message(0, AgentMessage::Finished { left: 3 });
    let text = "! - left-over: host h: killed 3 orphaned processes of components";
    assert_eq!(net.events(), [text]);
    let ended = AgentMessage::Ended {
        name: "a".to_owned(),
        exit: exit(0),
        left: 1,
    };
    net.take_agent_message(0, ended);
    assert_eq!(
        net.events()[0],
        "! a left-over: killed 1 orphaned processes"
    );
}

#[test]
fn machines_that_are_connected_are_reported() {
    let mut net = Net::new(vec![on("g", component("a")), on("h", component("b"))]);
    net.announce_hosts();
    let events = [
        "- host-connecting: host g: connecting to g.local",
        "- host-connecting: host h: connecting to h.local",
    ];
    assert_eq!(net.events(), events);
    let connected = |files, again, recovered| {
        HostEvent::Connected(AgentReady {
            root: PathBuf::from("/copies"),
            copied: (files, 2_500_000),
            again,
            recovered,
        })
    };
    net.take_host_event(1, connected(0, false, None));
    assert!(net.units[0].remote_component.is_none());
    assert!(net.units[1].remote_component.is_some());
    net.take_host_event(0, connected(1, false, Some(3)));
    net.take_host_event(0, connected(2, true, None));
    let report = net.report;
    let texts: Vec<String> = (2..report.journal().kept().0 as u64)
        .filter_map(|at| Some(report.journal().get(at)?.ok()?.message.clone()))
        .collect();
    assert_eq!(
        texts,
        [
            "host h: connected; nothing had to be copied",
            "host g: an earlier run there lost its agent and its guard; its files were removed and 3 orphaned processes were killed",
            "host g: connected; 1 file was copied, 2.5 MB",
            "host g: connected again; 2 files were copied, 2.5 MB",
        ]
    );
}

#[test]
fn a_machine_that_cannot_be_reached_stops_the_start_only() {
    let unreachable = || HostEvent::Unreachable("no route".to_owned());
    let mut net = Net::new(vec![on("h", component("a"))]);
    net.take_host_event(0, unreachable());
    assert_eq!(net.failure(), Some("host h: no route"));
    assert_eq!(net.events()[0], "!! - host-unreachable: host h: no route");

    let mut net = Net::up(vec![component("a")]);
    net.take_host_event(0, unreachable());
    assert!(net.failure().is_none());
    let events = net.events();
    assert!(
        events[0].starts_with("! - host-unreachable: host h: no route"),
        "{events:?}"
    );
    net.stop(StopReason::Asked, "a test");
    net.events();
    net.take_host_event(0, unreachable());
    assert_eq!(net.events(), [""; 0]);
}

#[test]
fn a_lost_machine_ends_its_components() {
    let components = vec![on("g", component("a")), on("h", component("b"))];
    let mut net = Net::up(components);
    net.take_host_event(1, HostEvent::Lost("silence".to_owned()));
    assert_eq!(net.alive(), ["a"]);
    let events = [
        "!! - host-lost: host h: silence",
        "!! b exited: ended: its host was lost",
    ];
    assert_eq!(net.events(), events);
    net.stop(StopReason::Asked, "a test");
    net.events();
    net.take_host_event(0, HostEvent::Lost("silence".to_owned()));
    assert_eq!(net.events()[0], "! - host-lost: host g: silence");
}

#[test]
fn machines_are_left_at_the_end() {
    let mut net = Net::new(vec![on("g", component("a")), on("h", component("b"))]);
    net.hosts[0].pretend();
    net.stop(StopReason::Asked, "a test");
    net.check_hosts(Instant::now());
    assert!(!net.hosts[0].is_over() && net.hosts[1].is_over());
    net.hosts[0].outbox.take();
    assert!(!net.leave_hosts());
    assert_eq!(net.hosts[0].outbox.take(), [SupervisorMessage::Farewell]);
    let mut net = Net::new(vec![on("g", component("a"))]);
    assert!(net.leave_hosts());
}

#[test]
fn agents_tell_about_their_processes() {
    let mut net = Net::up(vec![component("a"), component("b")]);
    let started = AgentMessage::Started {
        name: "b".to_owned(),
        pid: 4711,
    };
    net.take_agent_message(0, started);
    assert_eq!(net.units[1].status().pid, Some(4711));
    assert_eq!(net.units[0].status().pid, None);
    let socket = net.custody.directory().socket("b");
    assert!(socket.exists(), "its socket is here, too");
    net.take_agent_message(0, AgentMessage::LinkClosed("b".to_owned()));
    assert!(
        net.units[1]
            .remote_process()
            .is_some_and(|process| !process.linked)
    );
    assert!(
        net.units[0]
            .remote_process()
            .is_some_and(|process| process.linked)
    );
    let printed = AgentMessage::Printed {
        name: "a".to_owned(),
        text: "hello\n".to_owned(),
    };
    net.take_agent_message(0, printed);
    let log = std::fs::read_to_string(&net.units[0].log).expect("a log");
    assert_eq!(log, "hello\n");
    net.take_agent_message(0, AgentMessage::Note("a note".to_owned()));
    assert_eq!(net.events(), ["! - host-note: host h: a note"]);
    let garbage = AgentMessage::LinkLine {
        name: "a".to_owned(),
        line: None,
    };
    net.take_agent_message(0, garbage);
    assert!(net.events()[0].starts_with("! a garbage"));
    net.end(1, exit(0));
    assert!(!socket.exists());
}
