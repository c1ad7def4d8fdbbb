//! The JSON of every message. Any change of a key, code or word is a difference to `messages.txt`.

use expect_test::expect_file;
use rc_lifecycle::{LifecycleState, Transition};
use rc_management::{agent, component, link, rpc, supervisor};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::PathBuf;
use std::time::{Duration, UNIX_EPOCH};

/// Collects messages as text, and checks that decoding restores each one.
#[derive(Default)]
struct Golden(String);

impl Golden {
    fn title(&mut self, title: &str) {
        self.0.push_str(&format!("{title}\n"));
    }

    fn line(&mut self, line: &[u8]) {
        self.0
            .push_str(&format!("  {}", String::from_utf8_lossy(line)));
    }

    fn message<T>(&mut self, messages: impl IntoIterator<Item = T>)
    where
        T: Serialize + DeserializeOwned + PartialEq + Debug,
    {
        for message in messages {
            let line = rpc::notification(&message);
            let rpc::Call { method, params, .. } = rpc::Call::parse(&line).expect("a message");
            let read: T = rpc::message(&method, params).expect("the message");
            assert_eq!(read, message);
            self.line(&line);
        }
    }

    fn result<T: Serialize + DeserializeOwned + PartialEq + Debug>(&mut self, result: &T) {
        let line = rpc::answer(&Value::from(1), rpc::result(result));
        let mut answer: Value = serde_json::from_slice(&line).expect("JSON");
        let read: T = serde_json::from_value(answer["result"].take()).expect("the result");
        assert_eq!(&read, result);
        self.line(&line);
    }

    fn object<T: Serialize + DeserializeOwned + PartialEq + Debug>(
        &mut self,
        objects: impl IntoIterator<Item = T>,
    ) {
        for object in objects {
            let line = rc_management::lines::encode(&object);
            let read: T = serde_json::from_slice(&line).expect("the object");
            assert_eq!(read, object);
            self.line(&line);
        }
    }
}

fn text(text: &str) -> String {
    text.to_owned()
}

fn changes() -> Map<String, Value> {
    Map::from_iter([(text("motors[2].max"), json!(1.5))])
}

fn timing() -> component::Timing {
    component::Timing {
        count: 7,
        errors: 1,
        p50_us: 20,
        p99_us: 30,
        max_us: 40,
    }
}

fn of_observation(golden: &mut Golden) {
    use rc_management::observation::{
        Called, Described, Notification, OperationDescription, QosDescription, SlotDescription,
        Tapped, TappedKind,
    };
    let settings = [(text("domain"), text("7"))];
    golden.result(&Described {
        component: text("simulator"),
        name: text("sim"),
        network: text("default"),
        pid: 42,
        middlewares: [(text("dds"), settings.into())].into(),
        slots: vec![SlotDescription {
            name: text("poses"),
            role: component::Role::Publishes,
            interface: text("RoboCompPosePub::PosePub"),
            middleware: text("dds"),
            address: Some(text("default/PosePub")),
            hash: text("00000000000000ff"),
            operations: vec![OperationDescription {
                name: text("newPose"),
                hash: text("00000000000000fe"),
                qos: QosDescription {
                    reliable: true,
                    transient_local: false,
                    depth: 10,
                    deadline_ms: Some(1.5),
                    lifespan_ms: None,
                    liveliness_ms: None,
                },
                external_type: Some(text("geometry_msgs/msg/Pose")),
            }],
        }],
        types: vec![json!({"module": "RoboCompPosePub"})],
    });
    golden.result(&Called {
        body: vec![1, 2, 3],
    });
    golden.title("copies of messages for tools");
    golden.message([Notification::Tapped(Box::new(Tapped {
        slot: text("laser"),
        kind: TappedKind::Request,
        operation: None,
        type_hash: 7,
        sequence: 8,
        sent: 9,
        image: false,
        ros: true,
        dropped: 10,
        body: vec![1, 2, 3],
    }))]);
}

fn of_components(golden: &mut Golden) {
    use component::{Request, Role, State};
    golden.title("requests to a component");
    golden.message([
        Request::Status,
        Request::Parameters { paths: None },
        Request::Parameters {
            paths: Some(vec![text("speed")]),
        },
        Request::ParametersSet { changes: changes() },
        Request::ParametersSave,
        Request::Period { ms: 0.5 },
        Request::Emergency { active: true },
        Request::Fire { event: text("go") },
        Request::Lifecycle {
            transition: Transition::Configure,
        },
        Request::Stop,
        Request::Describe,
        Request::Tap {
            slot: text("laser"),
            on: true,
        },
        Request::Call {
            slot: text("laser"),
            body: vec![1, 2, 3],
            timeout_ms: 1000,
        },
        Request::Sample {
            slot: text("poses"),
            operation: text("newPose"),
            body: vec![1, 2, 3],
        },
    ]);
    golden.title("a request with its number");
    golden.line(&rpc::request(3, &Request::Stop));
    golden.title("answers of a component");
    let slot = |role, address| component::SlotStatus {
        name: text("laser"),
        role,
        interface: text("RoboCompLaser::Laser"),
        middleware: text("iceoryx2"),
        address,
        peers: 2,
        handlers: timing(),
        refused: if role == Role::Implements { 3 } else { 0 },
        sent: 8,
        withheld: u64::from(role == Role::Publishes),
        lost: 9,
        queue: (role == Role::Implements).then_some(component::QueueStatus {
            bytes: 10,
            limit: 1 << 28,
            dropped: 11,
        }),
    };
    golden.result(&component::Fired {
        states: vec![text("driving.forward")],
    });
    golden.result(&component::Status {
        component: text("simulator"),
        name: text("sim"),
        network: text("default"),
        pid: 42,
        state: State::Running,
        lifecycle: Some(LifecycleState::Active),
        uptime_s: 1.5,
        age_ms: 3,
        model: text("00000000000000ff"),
        middleware: text("iceoryx2"),
        period_ms: 20.0,
        overruns: 4,
        compute: timing(),
        last_error: Some(text("no scan")),
        clock: component::ClockStatus::default(),
        machine: Some(machine()),
        slots: vec![
            slot(Role::Implements, Some(text("default/Laser"))),
            slot(Role::Requires, None),
            slot(Role::Publishes, None),
            slot(Role::SubscribesTo, None),
        ],
    });
    let parameter = |path: &str| component::ParameterStatus {
        path: text(path),
        value: json!(1),
        pending: None,
        unsaved: false,
        default: None,
        allowed: text("int"),
        unit: None,
        editable: true,
        restart: false,
        secret: false,
        doc: Vec::new(),
    };
    golden.result(&component::Parameters {
        file: Some(PathBuf::from("/robot/etc/config.toml")),
        parameters: vec![
            parameter("speed"),
            component::ParameterStatus {
                pending: Some(json!(2)),
                unsaved: true,
                default: Some(json!(0)),
                unit: Some(text("mm/s")),
                doc: vec![text("How fast.")],
                ..parameter("limit")
            },
        ],
    });
    let change = component::ParameterChange {
        path: text("speed"),
        old: json!(1),
        new: json!(2),
    };
    golden.result(&component::Changed {
        changed: vec![change.clone()],
        pending: Vec::new(),
    });
    golden.result(&component::Saved {
        file: PathBuf::from("/robot/etc/config.toml"),
        saved: vec![change],
    });
    golden.result(&component::Lifecycle {
        state: LifecycleState::Inactive,
    });
    golden.result(&component::Done {});
    of_observation(golden);
    golden.title("errors");
    for code in [
        rpc::Error::PARSE,
        rpc::Error::UNKNOWN_METHOD,
        rpc::Error::INVALID_PARAMS,
        rpc::Error::WORKER_REFUSES,
        rpc::Error::WORKER_TIMEOUT,
        rpc::Error::FILE,
        rpc::Error::SYSTEM,
    ] {
        let error = rpc::Error::new(code, "no");
        golden.line(&rpc::answer(&Value::Null, Err(error)));
    }
    let finding = |help| rpc::Finding {
        code: text("out-of-range"),
        help,
        message: text("too much"),
    };
    let error = rpc::Error {
        data: Some(rpc::ErrorData {
            findings: vec![finding(None), finding(Some(text("at most 1")))],
        }),
        ..rpc::Error::new(rpc::Error::INVALID_PARAMS, "too much")
    };
    golden.line(&rpc::answer(&Value::from("a"), Err(error)));
}

fn machine() -> component::MachineStatus {
    component::MachineStatus {
        states: vec![text("driving.forward")],
        external: vec![text("go"), text("stop")],
        transitions: vec![component::TransitionStatus {
            from: text("idle"),
            to: vec![text("driving")],
            event: Some(text("go")),
            took_us: 12,
            at_s: 0.5,
        }],
    }
}

fn clock(kind: component::ClockKind) -> component::ClockStatus {
    let names = |name: &str| vec![text(name)];
    component::ClockStatus {
        kind,
        time_s: 1.25,
        tick: 125,
        lost_ms: (kind == component::ClockKind::Simulated).then_some(3200),
        followers: names("lidar"),
        waiting_for: names("lidar"),
    }
}

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
            jumps: vec![link::TimeJump {
                from_s: 2.5,
                to_s: 0.0,
            }],
            ..Heartbeat::default()
        }),
    ]);
    golden.title("messages of a supervisor to a component");
    golden.message([
        SupervisorMessage::Restore { changes: changes() },
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
        name: text("lidar"),
        host: Some(text("base")),
        state,
        lifecycle: Some(LifecycleState::Active),
        pid: Some(43),
        uptime_s: Some(2.5),
        ready: true,
        middleware: text("dds"),
        cpu: vec![2],
        priority: Some(50),
        executable: PathBuf::from("/robot/lidar"),
        log: PathBuf::from("/logs/lidar.log"),
        restarts: 1,
        ready_ms: 10_000,
        stop_ms: 3000,
        lost: BTreeMap::from([(text("pose"), 3)]),
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
        ddsl: PathBuf::from("/robot/patrol.ddsl"),
        digest: Some(text("00000000000000ff")),
        changed: false,
        components: vec![component(ComponentState::Running)],
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
            services: text("[]"),
        },
        SupervisorMessage::Start {
            component: Box::new(json!({"name": "lidar"})),
            run: text("lidar/1"),
            greeting: None,
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

#[test]
fn an_invalid_request_is_rejected_with_the_allowed_form() {
    let error = |line: &str| {
        let call = rpc::Call::parse(line.as_bytes());
        let error = call.and_then(component::Request::decode).expect_err(line);
        (error.code, error.message)
    };
    assert_eq!(error("hello"), (-32700, text("this is not JSON")));
    let unknown = "unknown method `dance`; there are `status`, `parameters`, `parameters_set`, `parameters_save`, `period`, `emergency`, `fire`, `lifecycle`, `stop`, `describe`, `tap`, `call`, `sample`";
    assert_eq!(error(r#"{"method":"dance"}"#), (-32601, text(unknown)));
    assert_eq!(error("[]").0, -32601);
    for (line, message) in [
        (
            r#"{"method":"emergency"}"#,
            r#"`emergency` takes {"active": true|false}"#,
        ),
        (
            r#"{"method":"period","params":{"ms":0.01}}"#,
            r#"`period` takes {"ms": 0.1 … 3600000}"#,
        ),
        (
            r#"{"method":"parameters","params":{"paths":[7]}}"#,
            r#"`parameters` takes {} or {"paths": ["motors[0].max", …]}"#,
        ),
        (
            r#"{"method":"parameters_set","params":{"changes":{}}}"#,
            r#"`parameters_set` takes {"changes": {"motors[0].max": 1.5, …}}"#,
        ),
    ] {
        assert_eq!(error(line), (-32602, text(message)));
    }
}

#[test]
fn optional_and_unknown_parameters_are_accepted() {
    use component::Request;
    let request = |line: &str| {
        let call = rpc::Call::parse(line.as_bytes());
        call.and_then(Request::decode).expect(line)
    };
    assert_eq!(request(r#"{"method":"status"}"#), Request::Status);
    assert_eq!(
        request(r#"{"method":"status","params":{"x":1}}"#),
        Request::Status
    );
    let all = Request::Parameters { paths: None };
    assert_eq!(request(r#"{"method":"parameters"}"#), all);
    assert_eq!(
        request(r#"{"method":"parameters","params":{"paths":null}}"#),
        all
    );
}

/// What other processes say reaches messages, terminals and JSON of tools.
#[test]
fn foreign_texts_are_cleaned_where_they_enter() {
    let long = format!("a\nforged: \u{1b}[2J{}", "x".repeat(100_000));
    let clean = |text: &str| {
        assert!(text.starts_with("a\\nforged: \\u{1b}[2Jxxx"), "{text}");
        assert_eq!(text.chars().count(), 257);
    };
    let line = json!({"id": 1, "error": {"code": -32001, "message": long, "data": {"findings": [
        {"code": "x", "help": long, "message": long}]}}});
    let error: rc_management::rpc::Error =
        serde_json::from_value(line["error"].clone()).expect("an error");
    // A reason may have lines, but no more than a reader needs.
    assert!(error.message.starts_with("a\nforged: \\u{1b}[2J"));
    assert!(error.message.chars().count() < 10_000);
    let finding = &error.data.as_ref().expect("its data").findings[0];
    clean(&finding.message);
    clean(finding.help.as_deref().expect("a help"));
    let heartbeat = json!({"method": "heartbeat", "params": {"age_ms": 1, "mismatches": [long],
        "silent": {(long.clone()): 7}, "overruns": {"what": long, "ms": 1.0, "period_ms": 1.0}}});
    let message = link::ComponentMessage::decode(heartbeat.to_string().as_bytes());
    let Ok(link::ComponentMessage::Heartbeat(heartbeat)) = message else {
        panic!("{message:?}");
    };
    clean(&heartbeat.mismatches[0]);
    heartbeat.silent.keys().for_each(|key| clean(key));
    clean(&heartbeat.overruns.expect("an overrun").what);
    let note = json!({"note": long});
    let note: agent::AgentMessage = serde_json::from_value(note).expect("a note");
    assert!(matches!(note, agent::AgentMessage::Note(text) if !text.contains('\u{1b}')));
}

#[test]
fn a_process_ends_well_with_code_zero_or_when_it_was_asked() {
    let exit = |success, signal| agent::Exit {
        success,
        signal,
        text: String::new(),
    };
    assert!(exit(true, None).is_done(false) && exit(true, None).is_done(true));
    assert!(!exit(false, None).is_done(false) && !exit(false, None).is_done(true));
    // SIGTERM counts only if it was asked for, and SIGKILL never does.
    assert!(exit(false, Some(15)).is_done(true) && !exit(false, Some(15)).is_done(false));
    assert!(!exit(false, Some(9)).is_done(true));
}

#[test]
fn only_texts_are_given_without_quotes() {
    let is_text = |path: &str, allowed: &str| {
        let status = json!({ "path": path, "value": null, "allowed": allowed,
            "editable": true, "restart": false, "secret": false });
        serde_json::from_value::<component::ParameterStatus>(status)
            .expect("a parameter")
            .is_text()
    };
    assert!(is_text("mode", "string, one of slow, fast") && is_text("device", "path"));
    assert!(is_text("tags[2]", "string[] of any length") && !is_text("tags", "string[]"));
    assert!(!is_text("gain", "float, from 0 to 1") && !is_text("gains[0]", "float[3]"));
}
