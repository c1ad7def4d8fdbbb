//! The JSON of every message. Any change of a key, code or word is a difference to `messages.txt`.

use super::components::{changes, clock, machine, of_components, world};
use super::golden::{Golden, text};
use expect_test::expect_file;
use rc_lifecycle::{LifecycleState, Transition};
use rc_management::{agent, component, link, supervisor};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, UNIX_EPOCH};

fn of_links(golden: &mut Golden) {
    use component::State;
    use link::{
        ComponentMessage, Heartbeat, LifecycleReport, Overruns, SupervisorMessage,
        UnsavedParameters,
    };
    golden.title("messages of a component to its supervisor");
    let states = [
        State::Starting,
        State::Running,
        State::Emergency,
        State::Stopping,
    ];
    golden.message(states.map(|state| ComponentMessage::State { state }));
    golden.message([
        ComponentMessage::Ready,
        ComponentMessage::Parameters(UnsavedParameters {
            changed: changes(),
            unkept: vec![text("token")],
        }),
        ComponentMessage::Restored { refused: None },
        ComponentMessage::Proposed {
            number: 3,
            changes: crate::components::changed(),
            refused: None,
        },
        ComponentMessage::Proposed {
            number: 3,
            changes: component::Changed::default(),
            refused: Some(text("too fast")),
        },
        ComponentMessage::Settled { number: 3 },
        ComponentMessage::Restored {
            refused: Some(text("too much")),
        },
        ComponentMessage::Lifecycle(LifecycleReport {
            state: LifecycleState::Activating,
            done: 0,
            error: None,
        }),
        ComponentMessage::Lifecycle(LifecycleReport {
            state: LifecycleState::Inactive,
            done: 2,
            error: Some(text("activate: no motor answers")),
        }),
        ComponentMessage::Heartbeat(Heartbeat::default()),
        ComponentMessage::Heartbeat(Heartbeat {
            age_ms: 7,
            lost: BTreeMap::from([(text("pose"), 3)]),
            forwarded: BTreeMap::new(),
            converted: BTreeMap::from([(
                text("height"),
                component::ConvertedStatus {
                    messages: 9,
                    bad_values: 1,
                    unplaced: 0,
                    locked: 0,
                    bad_value: None,
                },
            )]),
            peers: BTreeMap::from([(text("laser"), 1)]),
            overruns: Some(Overruns {
                count: 2,
                what: text("compute()"),
                ms: 7.5,
                period_ms: 5.0,
            }),
            silent: BTreeMap::from([(text("pose"), 80)]),
            mismatches: vec![text("another type")],
            ..Heartbeat::default()
        }),
        ComponentMessage::Heartbeat(Heartbeat {
            clock: Some(Box::new(clock(component::ClockKind::Source))),
            machine: Some(Box::new(machine())),
            world: Some(Box::new(world())),
            jumps: vec![link::TimeJump {
                from_s: 2.5,
                to_s: 0.0,
            }],
            ..Heartbeat::default()
        }),
    ]);
    golden.title("messages of a supervisor to a component");
    golden.message([
        SupervisorMessage::Restore {
            changes: changes(),
            ruled: vec![text("period")],
        },
        SupervisorMessage::Propose {
            number: 3,
            changes: changes(),
        },
        SupervisorMessage::Settle {
            number: 3,
            keep: true,
        },
        SupervisorMessage::Lifecycle {
            number: 2,
            goal: LifecycleState::Active,
        },
    ]);
}

fn of_supervisors(golden: &mut Golden) {
    use supervisor::{ComponentState, Event, Notification, Request, Severity};
    golden.title("requests to a supervisor");
    let names = || vec![text("left.arm")];
    golden.message([
        Request::Status,
        Request::Events,
        Request::Down,
        Request::Ring,
        Request::Chains { known: None },
        Request::Chains {
            known: Some(vec![120]),
        },
        Request::ParametersSet {
            changes: BTreeMap::from([(text("left.arm"), changes())]),
        },
        Request::Start { names: names() },
        Request::Stop { names: names() },
        Request::Restart { names: names() },
        Request::Lifecycle {
            transition: Transition::Activate,
            names: names(),
        },
    ]);
    golden.title("answers of a supervisor");
    let component = |state| supervisor::ComponentStatus {
        by_hand: false,
        process: None,
        behind: Vec::new(),
        name: text("lidar"),
        host: Some(text("base")),
        state,
        lifecycle: Some(LifecycleState::Active),
        pid: Some(43),
        uptime_s: Some(2.5),
        ready: true,
        middleware: text("dds"),
        transports: [(text("Laser"), text("iceoryx2, local"))].into(),
        cpu: vec![2],
        priority: Some(50),
        executable: PathBuf::from("/robot/lidar"),
        log: PathBuf::from("/logs/lidar.log"),
        restarts: 1,
        ready_ms: 10_000,
        stop_ms: 3000,
        lost: BTreeMap::from([(text("pose"), 3)]),
        messages: BTreeMap::new(),
        forwarded: BTreeMap::new(),
        converted: BTreeMap::from([(
            text("height"),
            component::ConvertedStatus {
                messages: 9,
                bad_values: 1,
                unplaced: 2,
                locked: 1,
                bad_value: Some(text("the value at byte 8 of `lidar.Laser`")),
            },
        )]),
        troubles: vec![supervisor::Trouble {
            code: text("hung"),
            message: text("its loop does not turn"),
            since: text("2026-11-21T13:56:04.123Z"),
        }],
        clock: Some(clock(component::ClockKind::Simulated)),
        machine: Some(machine()),
        exit: None,
    };
    golden.result(&supervisor::NetworkStatus {
        network: text("patrol"),
        pid: 41,
        guard: Some(40),
        directory: PathBuf::from("/run/user/1000/robocomp/patrol"),
        troubles: vec![supervisor::Trouble {
            code: text("guard-lost"),
            message: text("the guard process ended again"),
            since: text("2026-11-21T13:56:04.123Z"),
        }],
        ddsl: PathBuf::from("/robot/patrol.ddsl"),
        digest: Some(text("00000000000000ff")),
        changed: false,
        components: vec![component(ComponentState::Running)],
    });
    let times = Some(rc_management::chains::Times {
        p50_ms: 1.0,
        p99_ms: 2.0,
        worst_ms: 3.5,
    });
    golden.result(&rc_management::chains::Chains {
        chains: vec![rc_management::chains::ChainStatus {
            name: text("brake"),
            from: text("lidar.LaserPub.newScan"),
            to: text("base.Base.stop"),
            within_ms: Some(80.0),
            age_ms: Some(120.0),
            missing: vec![text("base does not run")],
            begun: 9,
            complete: 8,
            late: 1,
            old: 2,
            coverage: 1.0,
            times,
            oldest_ms: Some(4.0),
            uncertainty_ms: 0.25,
            hops: vec![rc_management::chains::HopStatus {
                component: text("base"),
                receives: text("Base.stop"),
                times,
                way: times,
                period: times,
                work: times,
                worst_case_ms: Some(5.5),
                lost: 1,
                replaced: 2,
                ended: 3,
                swapped: 4,
                restarts: 5,
                restamped: 6,
            }],
            conditions: vec![text("chain-late")],
            traces: vec![rc_management::chains::Trace {
                began_us: 1_780_000_000_000_000,
                hops: vec![[0.25, 20.0, 1.5]],
                late: true,
            }],
        }],
    });
    for state in [
        ComponentState::Waiting,
        ComponentState::Starting,
        ComponentState::Running,
        ComponentState::Emergency,
        ComponentState::Stopping,
        ComponentState::Done,
        ComponentState::Failed,
        ComponentState::Hung,
        ComponentState::Stopped,
    ] {
        assert_eq!(json!(state), state.to_string());
    }
    golden.result(&supervisor::KeptEvents { kept: 12 });
    golden.result(&supervisor::Stopping { stopping: true });
    golden.result(&supervisor::CommandResult {
        done: vec![text("lidar")],
        failed: vec![supervisor::FailedCommand {
            name: text("arm"),
            reason: text("was not ready in time"),
        }],
    });
    golden.title("notifications of a supervisor");
    let time = UNIX_EPOCH + Duration::from_millis(951_827_696_005);
    let event = |severity, component: Option<&str>| Event {
        time,
        component: component.map(str::to_owned),
        code: "hung".into(),
        message: text("its loop does not turn"),
        severity,
    };
    golden.message([
        Notification::Event(event(Severity::Info, None)),
        Notification::Event(event(Severity::Warning, Some("lidar"))),
        Notification::Event(event(Severity::Error, Some("lidar"))),
        Notification::Missed { events: 5 },
    ]);
}

fn of_agents(golden: &mut Golden) {
    use agent::{AgentMessage, Exit, File, SupervisorMessage};
    golden.title("messages of a supervisor to an agent");
    let name = || text("lidar");
    golden.object([
        SupervisorMessage::Network {
            name: text("patrol"),
            files: vec![File {
                path: PathBuf::from("/robot/lidar"),
                hash: text("00ff"),
                size: 5,
                executable: true,
            }],
            environments: vec![json!({"folder": "/robot/.venv"})],
            services: text("[]"),
            memory_pause_ms: 30_000,
        },
        SupervisorMessage::Start {
            component: Box::new(json!({"name": "lidar"})),
            run: text("eyes/1"),
            greeting: None,
            after: vec![text("camera")],
            more: true,
        },
        SupervisorMessage::Stop(name()),
        SupervisorMessage::Kill(name()),
        SupervisorMessage::Connect {
            wire: 1,
            name: name(),
        },
        SupervisorMessage::Data {
            wire: 1,
            text: text("{}\n"),
        },
        SupervisorMessage::Close(1),
        SupervisorMessage::Heartbeat,
        SupervisorMessage::Farewell,
    ]);
    golden.title("messages of an agent to its supervisor");
    golden.object([
        AgentMessage::Missing(vec![0, 2]),
        AgentMessage::Ready {
            root: PathBuf::from("/cache"),
            recovered: Some(3),
        },
        AgentMessage::Refused(text("no room")),
        AgentMessage::Started {
            name: name(),
            pid: 44,
        },
        AgentMessage::NotStarted {
            name: name(),
            reason: text("there is no such file"),
        },
        AgentMessage::LinkLine {
            name: name(),
            line: None,
        },
        AgentMessage::LinkClosed(name()),
        AgentMessage::Printed {
            name: name(),
            text: text("hello\n"),
        },
        AgentMessage::Data {
            wire: 1,
            text: text("{}\n"),
        },
        AgentMessage::Close(1),
        AgentMessage::Ended {
            name: name(),
            exit: Exit {
                success: false,
                signal: Some(11),
                text: text("signal 11 (SIGSEGV)"),
            },
            left: 0,
        },
        AgentMessage::Memory {
            name: name(),
            bytes: 5 << 20,
        },
        AgentMessage::Trouble {
            code: text("disk-full"),
            text: text("it is full"),
        },
        AgentMessage::TroubleOver {
            code: text("disk-full"),
            text: text("it has room"),
        },
        AgentMessage::MemoryLost(text("/dev/shm/a")),
        AgentMessage::Note(text("the clock jumped")),
        AgentMessage::Heartbeat,
        AgentMessage::Finished { left: 1 },
    ]);
}

#[test]
fn messages_equal_the_golden_file() {
    let mut golden = Golden::default();
    of_components(&mut golden);
    of_links(&mut golden);
    of_supervisors(&mut golden);
    of_agents(&mut golden);
    expect_file!["messages.txt"].assert_eq(&golden.0);
}
