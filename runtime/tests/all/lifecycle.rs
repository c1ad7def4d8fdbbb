//! The life cycle of a managed component: its hooks, requests over its socket, and its end.

use rc_middleware::qos::Qos;
use rc_middleware::typed::{HandlerError, Operation, Request, TypedClient, TypedPublisher};
use rc_middleware::{
    Address, CallError, Endpoint, Environment, Reader, RunDirectory, Settings, TypeIdentity,
    WakeEvent,
};
use rc_runtime::lifecycle::{Hook, Transition};
use rc_runtime::{
    Component, Core, Description, Embedded, Member, Ports, Role, Sample, Slot, StartError, Values,
    WorkerError, embed,
};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::sync::Mutex;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(10);

static DESCRIPTION: Description = MANAGED;

const MANAGED: Description = Description {
    name: "managed",
    model_hash: 1,
    middleware: "none",
    period: Duration::from_millis(2),
    parameters: None,
    folder: "/nowhere",
    slots: &[],
    types: &[],
    backends: &[],
    simulates_time: false,
    managed: true,
    converter: None,
    note: b"",
};

/// Calls of the workers, each line with the name of its component.
static CALLS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Fails as the name of its component says.
struct Worker(Core);

impl Worker {
    #[expect(clippy::unnecessary_wraps, reason = "the runtime expects a `Result`")]
    fn start(core: Core, _: &Ports, _: &Values) -> Result<Self, StartError> {
        Ok(Self(core))
    }

    fn note(&self, call: &str) {
        let line = format!("{} {call}", self.0.name());
        let mut calls = CALLS.lock().expect("the calls");
        if calls.last() != Some(&line) {
            calls.push(line);
        }
    }
}

impl Component for Worker {
    fn core(&mut self) -> &mut Core {
        &mut self.0
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.note("compute");
        Ok(())
    }

    fn run_hook(&mut self, hook: Hook<'_>) -> Result<(), WorkerError> {
        match hook {
            Hook::Transition(transition) => self.note(transition.word()),
            Hook::Error(transition, reason) => self.note(&format!("error {transition} {reason}")),
        }
        match (self.0.name(), hook) {
            ("broken" | "unsteady", Hook::Transition(Transition::Activate)) => {
                Err(WorkerError::Failed("no motor".to_owned()))
            }
            ("burnt", Hook::Transition(Transition::Activate)) => {
                Err(WorkerError::Emergency("smoke".to_owned()))
            }
            _ => Ok(()),
        }
    }

    fn finalize(&mut self) {
        self.note("finalize");
    }
}

fn network(name: &str) -> String {
    format!("lifecycle_{name}_{}", std::process::id())
}

fn run(name: &str, args: &[&str]) -> Result<Embedded, StartError> {
    let network = network(name);
    let mut all = vec!["--network", &network, "--name", name];
    all.extend(args);
    embed(&DESCRIPTION, Worker::start, &all)
}

fn calls(name: &str) -> Vec<String> {
    let calls = CALLS.lock().expect("the calls");
    let of = calls.iter().filter_map(|line| line.strip_prefix(name));
    of.map(|call| call.trim_start().to_owned()).collect()
}

fn ask(name: &str, method: &str, params: &Value) -> Value {
    let socket = RunDirectory::of(&network(name)).socket(name);
    let mut stream = UnixStream::connect(socket).expect("its socket");
    stream.set_read_timeout(Some(LIMIT)).expect("a limit");
    let request = json!({ "jsonrpc": "2.0", "id": 7, "method": method, "params": params });
    stream
        .write_all(format!("{request}\n").as_bytes())
        .expect("a request");
    let mut line = String::new();
    BufReader::new(stream)
        .read_line(&mut line)
        .expect("a reply");
    serde_json::from_str(&line).expect("JSON")
}

/// The state after a transition, or the message of its error.
fn change(name: &str, transition: &str) -> Value {
    let reply = ask(name, "lifecycle", &json!({ "transition": transition }));
    match &reply["error"] {
        Value::Null => reply["result"]["state"].clone(),
        error => error["message"].clone(),
    }
}

fn wait_for_call(name: &str, call: &str) {
    let start = Instant::now();
    while !calls(name).iter().any(|line| line == call) {
        assert!(start.elapsed() < LIMIT, "{:?}", calls(name));
        std::thread::yield_now();
    }
}

#[test]
fn requests_take_a_component_through_its_life_and_its_end_backwards() {
    let component = run("whole", &[]).expect("to run");
    let status = ask("whole", "status", &Value::Null)["result"].clone();
    assert_eq!(
        (&status["state"], &status["lifecycle"]),
        (&json!("running"), &json!("unconfigured"))
    );
    assert_eq!(
        change("whole", "activate"),
        "activate: not possible for a component that is unconfigured; the component is unconfigured now"
    );
    assert_eq!(change("whole", "configure"), "inactive");
    assert_eq!(change("whole", "activate"), "active");
    wait_for_call("whole", "compute");
    assert_eq!(change("whole", "deactivate"), "inactive");
    let computed = |status: &Value| status["result"]["compute"]["count"].clone();
    let before = computed(&ask("whole", "status", &Value::Null));
    assert_eq!(change("whole", "cleanup"), "unconfigured");
    assert_eq!(change("whole", "configure"), "inactive");
    assert_eq!(computed(&ask("whole", "status", &Value::Null)), before);
    assert_eq!(change("whole", "activate"), "active");
    assert_eq!(
        change("whole", "dance").as_str().map(|text| &text[..11]),
        Some("`lifecycle`")
    );
    wait_for_call("whole", "compute");
    component.stop();
    component.join().expect("an orderly end");
    let calls: Vec<String> = calls("whole");
    let calls = calls.iter().filter(|call| *call != "compute");
    let calls: Vec<&str> = calls.map(String::as_str).collect();
    let wanted = [
        "configure",
        "activate",
        "deactivate",
        "cleanup",
        "configure",
        "activate",
        "deactivate",
        "cleanup",
        "shutdown",
        "finalize",
    ];
    assert_eq!(calls, wanted);
}

#[test]
fn a_hook_that_fails_leads_back_and_one_with_an_error_to_error_processing() {
    let broken = run("broken", &[]).expect("to run");
    assert_eq!(change("broken", "configure"), "inactive");
    assert_eq!(
        change("broken", "activate"),
        "activate: no motor; the component is inactive now"
    );
    assert_eq!(change("broken", "shutdown"), "finalized");
    assert_eq!(
        change("broken", "configure"),
        "configure: not possible for a component that is finalized; the component is finalized now"
    );
    broken.stop();
    broken.join().expect("an orderly end");
    assert_eq!(
        calls("broken"),
        ["configure", "activate", "shutdown", "finalize"]
    );

    let burnt = run("burnt", &[]).expect("to run");
    assert_eq!(change("burnt", "configure"), "inactive");
    assert_eq!(
        change("burnt", "activate"),
        "activate: smoke; the component is unconfigured now"
    );
    let last = ask("burnt", "status", &Value::Null)["result"]["last_error"].clone();
    assert_eq!(last, "activate: smoke");
    burnt.stop();
    burnt.join().expect("an orderly end");
    let wanted = [
        "configure",
        "activate",
        "error activate smoke",
        "shutdown",
        "finalize",
    ];
    assert_eq!(calls("burnt"), wanted);
}

#[test]
fn a_component_activates_itself_on_request_or_ends() {
    let component = run("alone", &["--active"]).expect("to run");
    wait_for_call("alone", "compute");
    component.stop();
    component.join().expect("an orderly end");
    let broken = embed(
        &DESCRIPTION,
        Worker::start,
        &[
            "--network",
            &network("unsteady"),
            "--name",
            "unsteady",
            "--active",
        ],
    );
    let error = broken.expect("to run").join().expect_err("a failure");
    assert_eq!(
        error.to_string(),
        "activate: no motor; the component is inactive now"
    );
}

const DOUBLE: Operation = Operation {
    name: "double",
    id: 5,
    type_hash: 6,
    two_way: true,
    replies: &[],
};

const TICK: Operation = Operation {
    name: "tick",
    id: 7,
    type_hash: 8,
    two_way: false,
    replies: &[],
};

const SLOT: Slot = Slot {
    name: "Numbers",
    role: Role::Implements,
    interface: "Numbers",
    type_name: "Test::Numbers",
    type_hash: 7,
    backend: "local",
    qos: Qos::CALL,
    operations: &[DOUBLE],
    is_array: false,
    external_types: &[],
};

static CONNECTED: Description = Description {
    middleware: "local",
    slots: &[
        SLOT,
        Slot {
            name: "Out",
            role: Role::Publishes,
            interface: "Out",
            type_name: "Test::Out",
            qos: Qos::PUBLISHER,
            operations: &[TICK],
            ..SLOT
        },
        Slot {
            name: "In",
            role: Role::SubscribesTo,
            interface: "In",
            type_name: "Test::In",
            qos: Qos::SUBSCRIBER,
            operations: &[TICK],
            ..SLOT
        },
    ],
    backends: &[rc_local::LINKED],
    ..MANAGED
};

/// Serves, publishes in each hook and each period, and notes what it receives.
struct Connected {
    core: Core,
    out: TypedPublisher,
}

impl Connected {
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        let out = ports.publisher(1, 0)?;
        Ok(Self { core, out })
    }

    fn publish(&mut self) -> Result<(), WorkerError> {
        Ok(self.out.publish_with(|writer| writer.put(&7_i32))?)
    }
}

impl Component for Connected {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.publish()
    }

    fn run_hook(&mut self, _: Hook<'_>) -> Result<(), WorkerError> {
        self.publish()
    }

    fn serve(
        &mut self,
        _: usize,
        _: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        let number = request.arguments(&DOUBLE, Reader::get::<i32>)?;
        request.reply_with(0, |writer| writer.put(&(2 * number)))
    }

    fn receive(
        &mut self,
        _: usize,
        _: Option<&Member>,
        _: usize,
        sample: Sample<'_>,
    ) -> Result<(), HandlerError> {
        let reader = &mut sample.reader();
        let number: i32 = reader.get()?;
        CALLS
            .lock()
            .expect("the calls")
            .push(format!("connected received {number}"));
        Ok(())
    }
}

#[test]
fn calls_are_refused_and_topics_silent_while_a_component_is_not_active() {
    let network = network("connected");
    let args = ["--network", &network, "--name", "connected"];
    let component = embed(&CONNECTED, Connected::start, &args).expect("to run");
    let backend = rc_local::connect(&Environment {
        network: network.clone(),
        instance: "peer".to_owned(),
        directory: RunDirectory::of(&network),
        wake_event: WakeEvent::new().expect("a wake event"),
        settings: Settings::default(),
    })
    .expect("the network");
    let endpoint = |address: &str, name: &str, hash, qos| Endpoint {
        address: Address::parse(&format!("{network}/{address}")).expect("an address"),
        types: TypeIdentity {
            name: format!("Test::{name}"),
            hash,
        },
        qos,
        external_types: Vec::new(),
    };
    let client = backend.client(&endpoint("Numbers", "Numbers", 7, Qos::CALL));
    let mut client = TypedClient::new(client.expect("a client"), LIMIT);
    let mut double = || {
        client.call_with(
            &DOUBLE,
            |writer| writer.put(&21_i32),
            |_, reader| Ok::<_, CallError>(reader.get::<i32>()?),
        )
    };
    let topic = backend.publisher(&endpoint("In/tick", "In/tick", 8, Qos::PUBLISHER));
    let mut topic = TypedPublisher::new(topic.expect("a publisher"), TICK);
    let mut send = |number: i32| topic.publish_with(|writer| writer.put(&number));
    let slot = |at: usize| ask("connected", "status", &Value::Null)["result"]["slots"][at].clone();
    let unavailable = |state: &str| {
        Err(CallError::Unavailable {
            state: state.to_owned(),
        })
    };
    assert_eq!(double(), unavailable("unconfigured"));
    send(1).expect("sent");
    assert_eq!(change("connected", "configure"), "inactive");
    assert_eq!(double(), unavailable("inactive"));
    let out = slot(1);
    assert_eq!((&out["sent"], &out["withheld"]), (&json!(0), &json!(1)));
    assert_eq!(slot(0)["refused"], 2);

    assert_eq!(change("connected", "activate"), "active");
    assert_eq!(double(), Ok(42));
    send(2).expect("sent");
    wait_for_call("connected", "received 2");
    assert!(!calls("connected").contains(&"received 1".to_owned()));
    assert!(slot(1)["sent"].as_u64() > Some(0));
    assert_eq!(slot(1)["withheld"], 1);

    assert_eq!(change("connected", "deactivate"), "inactive");
    let sent = slot(1)["sent"].clone();
    assert_eq!(double(), unavailable("inactive"));
    assert_eq!(slot(1)["sent"], sent);
    component.stop();
    component.join().expect("an orderly end");
}
