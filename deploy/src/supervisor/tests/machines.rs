//! The supervisor's handling of events of its machines.

use super::net::{Net, after, on};
use super::{component, exit};
use crate::remote::{AgentReady, HostEvent, SupervisorMessage};
use crate::supervisor::supervise::StopReason;
use rc_files::Disk;
use rc_management::agent::AgentMessage;
use rc_management::link::ComponentMessage;
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
    net.hosts.pretend(0);
    net.stop(StopReason::Asked, "a test");
    net.check_hosts(Instant::now());
    assert_eq!(net.hosts.over(), [false, true]);
    net.hosts.take_messages(0);
    assert!(!net.leave_hosts());
    assert_eq!(net.hosts.take_messages(0), [SupervisorMessage::Farewell]);
    let mut net = Net::new(vec![on("g", component("a"))]);
    assert!(net.leave_hosts());
}

#[test]
fn conditions_of_machines_hold_until_they_end() {
    let mut net = Net::up(vec![on("g", component("a")), on("h", component("b"))]);
    let full = |text: &str| AgentMessage::Trouble {
        code: "disk-full".to_owned(),
        text: text.to_owned(),
    };
    let free = || AgentMessage::TroubleOver {
        code: "disk-full".to_owned(),
        text: "free".to_owned(),
    };
    let held = |net: &Net| -> Vec<(String, String)> {
        let troubles = net.troubles.list().into_iter();
        troubles.map(|one| (one.code, one.message)).collect()
    };
    let holds = |host: &str, text: &str| {
        let text = format!("host {host}: {text}");
        ("disk-full".to_owned(), text)
    };
    net.take_agent_message(1, free());
    assert_eq!(net.events(), [""; 0], "nothing has begun");
    net.take_agent_message(0, full("one"));
    net.take_agent_message(1, full("two"));
    net.take_agent_message(1, full("three"));
    let begun = ["!! - disk-full: host g: one", "!! - disk-full: host h: two"];
    assert_eq!(net.events(), begun);
    assert_eq!(held(&net), [holds("g", "one"), holds("h", "three")]);
    net.take_agent_message(0, free());
    assert_eq!(net.events(), ["- disk-free: host g: free"]);
    assert_eq!(held(&net), [holds("h", "three")]);
    // An agent of another kind chooses no codes.
    let strange = AgentMessage::Trouble {
        code: "dance".to_owned(),
        text: "x".to_owned(),
    };
    net.take_agent_message(0, strange);
    assert_eq!(net.events(), [""; 0]);
    // The state of a lost machine is unknown.
    net.take_host_event(1, HostEvent::Lost("silence".to_owned()));
    let lost = ("host-lost".to_owned(), "host h: silence".to_owned());
    assert_eq!(held(&net), [lost]);
}

#[test]
fn the_components_of_a_machine_restart_when_its_shared_memory_was_removed() {
    let a = on("g", component("a"));
    let mut net = Net::up(vec![a, after("a", component("b")), component("c")]);
    let of = [0, 1, 2].map(|i| net.hosts.of(i));
    assert_eq!(of, [Some(0), Some(1), Some(1)]);
    net.take_agent_message(1, AgentMessage::MemoryLost("x".to_owned()));
    net.note_renewed();
    let events = net.events();
    let text = "!! - memory-lost: host h: shared memory of the network was removed (x, …";
    assert_eq!(events, [text]);
    net.turn();
    net.note_renewed();
    // Only those of the machine.
    assert_eq!(net.asked(), ["b", "c"]);
    net.end(1, exit(0));
    net.turn();
    assert_eq!(net.alive(), ["a", "c"], "one starts when all have ended");
    net.end(2, exit(0));
    net.turn();
    net.note_renewed();
    assert_eq!(net.alive(), ["a", "b", "c"]);
    assert_eq!(net.troubles.list().len(), 1);
    net.say(1, &ComponentMessage::Ready);
    net.turn();
    net.note_renewed();
    assert_eq!(net.troubles.list().len(), 1);
    net.events();
    net.say(2, &ComponentMessage::Ready);
    net.turn();
    net.note_renewed();
    let text = "- memory-back: host h: all components have restarted with new shared memory";
    assert_eq!(net.events().last().map(String::as_str), Some(text));
    assert_eq!(net.troubles.list(), []);
}

#[test]
fn the_memory_of_a_component_elsewhere_is_judged_here() {
    let mut net = Net::up(vec![component("a")]);
    let codes = |net: &mut Net, mib: &mut dyn Iterator<Item = u64>| -> Vec<String> {
        for mib in mib {
            let name = "a".to_owned();
            let bytes = mib << 20;
            net.take_agent_message(0, AgentMessage::Memory { name, bytes });
        }
        let events = net.events().into_iter();
        let codes = events.map(|event| event.split(':').next().unwrap_or_default().to_owned());
        codes.collect()
    };
    let grown = codes(&mut net, &mut (100..200));
    assert_eq!(grown, ["! a memory-growth"]);
    assert_eq!(net.units[0].status().troubles[0].code, "memory-growth");
    let steady = codes(&mut net, &mut std::iter::repeat_n(200, 1000));
    assert_eq!(steady, ["a memory-steady"]);
    assert_eq!(net.units[0].status().troubles, []);
}

#[test]
fn a_disk_without_room_for_recordings_is_a_condition() {
    let mut net = Net::up(vec![component("a")]);
    net.look_at_recordings();
    assert_eq!(net.events(), [""; 0], "nothing is recorded");
    net.logs.recordings = Some(Disk::new(u64::MAX));
    net.look_at_recordings();
    net.look_at_recordings();
    let events = net.events();
    assert_eq!(events.len(), 1, "{events:?}");
    let begin = "! - recordings-stopped: the disk of ";
    assert!(events[0].starts_with(begin), "{events:?}");
    assert_eq!(net.troubles.list()[0].code, "recordings-stopped");
    let mut disk = Disk::new(1);
    disk.look(0);
    net.logs.recordings = Some(disk);
    net.look_at_recordings();
    let events = net.events();
    assert!(events[0].starts_with("- recordings-free: "), "{events:?}");
    assert_eq!(net.troubles.list(), []);
}

#[test]
fn a_log_that_cannot_be_written_is_reported_until_it_can() {
    let mut net = Net::up(vec![component("a")]);
    let printed = || AgentMessage::Printed {
        name: "a".to_owned(),
        text: "hello\n".to_owned(),
    };
    let log = net.units[0].log.clone();
    std::fs::remove_file(&log).expect("a log");
    std::fs::create_dir(&log).expect("a folder");
    net.take_agent_message(0, printed());
    net.take_agent_message(0, printed());
    let events = net.events();
    assert_eq!(events.len(), 1, "{events:?}");
    assert!(
        events[0].starts_with("! - not-written: cannot write to "),
        "{events:?}"
    );
    assert_eq!(net.troubles.list().len(), 1);
    std::fs::remove_dir(&log).expect("a folder");
    net.take_agent_message(0, printed());
    assert_eq!(
        net.events(),
        [format!("- written: wrote to {}", log.display())]
    );
    assert_eq!(net.troubles.list(), []);
}

#[test]
fn a_folder_of_logs_that_comes_back_ends_its_trouble() {
    let mut net = Net::up(vec![component("a")]);
    let logs = net.logs.directory().to_owned();
    let away = logs.with_extension("away");
    std::fs::rename(&logs, &away).expect("a folder");
    std::fs::write(&logs, "").expect("a file in its place");
    net.restore_logs();
    net.restore_logs();
    let events = net.events();
    assert_eq!(events.len(), 1, "{events:?}");
    assert!(
        events[0].starts_with("! - not-written: cannot make the folder of the logs, "),
        "{events:?}"
    );
    std::fs::remove_file(&logs).expect("a file");
    std::fs::rename(&away, &logs).expect("a folder");
    net.restore_logs();
    assert_eq!(
        net.events(),
        [format!(
            "- written: the folder of the logs, {}, is there again",
            logs.display()
        )]
    );
    assert_eq!(net.troubles.list(), []);
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
    let socket = net.network_guard.directory().socket("b");
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
