//! The messages between tools and a component.

use super::golden::{Golden, text};
use rc_lifecycle::{LifecycleState, Transition};
use rc_management::supervisor::ComponentState;
use rc_management::{component, rpc};
use rc_vocabulary::{Skip, Stamp, StampOf};
use serde_json::{Map, Value, json};
use std::path::PathBuf;

pub(crate) fn changes() -> Map<String, Value> {
    Map::from_iter([(text("motors[2].max"), json!(1.5))])
}

pub(crate) fn changed() -> component::Changed {
    component::Changed {
        changed: vec![component::ParameterChange {
            path: text("speed"),
            old: json!(1),
            new: json!(2),
        }],
        pending: Vec::new(),
    }
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
        Called, Clocks, Described, Notification, OperationDescription, SlotDescription, Tapped,
        TappedKind,
    };
    use rc_vocabulary::qos::Qos;
    use std::time::Duration;
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
            further: vec!["local".to_owned()],
            address: Some(text("default/PosePub")),
            hash: text("00000000000000ff"),
            operations: vec![OperationDescription {
                name: text("newPose"),
                hash: text("00000000000000fe"),
                qos: Qos {
                    deadline: Some(Duration::from_micros(1500)),
                    ..Qos::PUBLISHER
                },
                external_type: Some(text("geometry_msgs/msg/Pose")),
            }],
        }],
        world: vec![(text("home.gdsl"), text("Domain home { };"))],
        types: vec![json!({"module": "RoboCompPosePub"})],
    });
    golden.result(&Called {
        body: vec![1, 2, 3],
    });
    golden.result(&Clocks {
        system_ns: 1_700_000_000_000_000_001,
        monotonic_ns: 5,
    });
    golden.title("copies of messages for tools");
    golden.message([
        Notification::Tapped(Box::new(Tapped {
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
        })),
        Notification::Dropped {
            slot: text("laser"),
            dropped: 11,
        },
    ]);
}

pub(crate) fn of_components(golden: &mut Golden) {
    use component::{Request, Role, State};
    use rc_management::hops::{Following, Hop, HopReport, Kind, Message, Pair, Way};
    let message = || Message {
        slot: text("LaserPub"),
        operation: text("newScan"),
    };
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
        Request::Clocks,
        Request::Follow {
            pairs: vec![
                Pair {
                    input: Some(message()),
                    output: None,
                    way: Way::Handler,
                    stamp: None,
                },
                Pair {
                    input: None,
                    output: Some(message()),
                    way: Way::Any,
                    stamp: Some(Stamp {
                        before: vec![Skip {
                            size: 1,
                            count: 1,
                            counted: true,
                        }],
                        of: StampOf::Seconds,
                    }),
                },
            ],
        },
        Request::Hops,
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
        transports: Vec::from_iter(
            (role == Role::Publishes).then(|| component::TransportStatus {
                middleware: text("local"),
                messages: 7,
            }),
        ),
        address,
        peers: 2,
        handlers: timing(),
        refused: if role == Role::Implements { 3 } else { 0 },
        sent: 8,
        withheld: u64::from(role == Role::Publishes),
        converted: None,
        freshness: None,
        forwarded: None,
        lost: 9,
        queue: (role == Role::Implements).then_some(component::QueueStatus {
            bytes: 10,
            limit: 1 << 28,
            dropped: 11,
        }),
    };
    golden.result(&Following {
        senders: vec![vec![7, 8], Vec::new()],
    });
    golden.result(&HopReport {
        active: true,
        overwritten: 3,
        hops: vec![Hop {
            sender: 7,
            pair: 1,
            kind: Kind::Replaced,
            input: 4,
            output: 0,
            sent: 10,
            begun: 11,
            used: 11,
            left: 12,
        }],
    });
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
        world: Some(world()),
        slots: vec![
            slot(Role::Implements, Some(text("default/Laser"))),
            slot(Role::Requires, None),
            slot(Role::Publishes, None),
            slot(Role::SubscribesTo, None),
        ],
        done_beside: vec![text("brief")],
        group: Some(component::GroupStatus {
            state: ComponentState::Failed,
            ready: false,
            components: [(text("sim.left"), ComponentState::Failed)].into(),
        }),
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
    let changed = changed();
    golden.result(&changed);
    golden.result(&component::Saved {
        file: PathBuf::from("/robot/etc/config.toml"),
        saved: changed.changed,
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

pub(crate) fn world() -> component::WorldStatus {
    component::WorldStatus {
        behind: 3,
        behind_ms: 2500,
        conflicts: 1,
        first_conflicts: vec![text("RT from `hall` to `front`")],
        fault: Some(text("two parents")),
        refused: 2,
        last_refusal: text("another schema"),
        silent: vec![text("finder")],
        more_silent: 3,
    }
}

pub(crate) fn machine() -> component::MachineStatus {
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

pub(crate) fn clock(kind: component::ClockKind) -> component::ClockStatus {
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
