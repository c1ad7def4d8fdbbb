//! The life cycle of a component: its states, its management and its end.

use rc_middleware::RunDirectory;
use rc_runtime::{
    Component, Core, Description, Embedded, Ports, StartError, Values, WorkerError, embed,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::sync::Mutex;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(10);

static DESCRIPTION: Description = Description {
    name: "life",
    model_hash: 1,
    middleware: "none",
    period: Duration::from_millis(2),
    parameters: None,
    folder: "/nowhere",
    slots: &[],
    backends: &[],
    types: &[],
    simulates_time: false,
    managed: false,
    converter: None,
    note: b"",
};

/// Counts the calls of the runtime, and fails as its name says.
struct Worker {
    core: Core,
    computed: u32,
    emergencies: bool,
}

/// The numbers of calls of `emergency`, `restore` and `finalize`, by component name.
static SEEN: Mutex<BTreeMap<String, [u32; 3]>> = Mutex::new(BTreeMap::new());

fn seen(name: &str) -> [u32; 3] {
    *SEEN
        .lock()
        .expect("the counts")
        .entry(name.to_owned())
        .or_default()
}

fn count(name: &str, what: usize) {
    SEEN.lock()
        .expect("the counts")
        .entry(name.to_owned())
        .or_default()[what] += 1;
}

impl Worker {
    fn start(core: Core, _: &Ports, _: &Values) -> Result<Self, StartError> {
        if core.name() == "unwilling" {
            return Err(StartError::Worker("there is no robot".to_owned()));
        }
        Ok(Self {
            core,
            computed: 0,
            emergencies: false,
        })
    }
}

impl Component for Worker {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.computed += 1;
        match self.core.name() {
            "fatal" if self.computed == 3 => Err(WorkerError::Fatal("the arm fell off".to_owned())),
            "failing" => Err(std::io::Error::other("again").into()),
            "afraid" if self.computed == 3 => Err(WorkerError::Emergency("too hot".to_owned())),
            "brief" if self.computed == 3 => {
                self.core.stop("done");
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn emergency(&mut self) {
        self.emergencies = true;
        count(self.core.name(), 0);
    }

    fn restore(&mut self) {
        assert!(self.emergencies);
        count(self.core.name(), 1);
    }

    fn finalize(&mut self) {
        count(self.core.name(), 2);
    }
}

fn network(name: &str) -> String {
    format!("life_{name}_{}", std::process::id())
}

fn run(name: &str) -> Result<Embedded, StartError> {
    embed(
        &DESCRIPTION,
        Worker::start,
        &["--network", &network(name), "--name", name],
    )
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
    let reply: Value = serde_json::from_str(&line).expect("JSON");
    assert_eq!(reply["id"], 7);
    reply
}

/// Requests the status until `condition` holds.
fn until(name: &str, condition: impl Fn(&Value) -> bool) -> Value {
    let start = Instant::now();
    loop {
        let status = ask(name, "status", &Value::Null)["result"].clone();
        if condition(&status) {
            return status;
        }
        assert!(start.elapsed() < LIMIT, "{status}");
    }
}

#[test]
fn management_sets_period_and_emergency_and_stops_the_component() {
    let component = run("managed").expect("to run");
    let status = until("managed", |s| s["compute"]["count"].as_u64() > Some(2));
    assert_eq!(
        (&status["state"], &status["period_ms"]),
        (&json!("running"), &json!(2.0))
    );
    ask("managed", "period", &json!({ "ms": 1 }));
    until("managed", |s| s["period_ms"] == json!(1.0));
    let wrong = ask("managed", "period", &json!({ "ms": -1 }));
    assert!(
        wrong["error"]["message"]
            .as_str()
            .is_some_and(|m| m.contains("ms")),
        "{wrong}"
    );
    ask("managed", "emergency", &json!({ "active": true }));
    let calm = until("managed", |s| {
        s["state"] == "emergency" && seen("managed")[0] > 10
    })["compute"]["count"]
        .clone();
    ask("managed", "emergency", &json!({ "active": false }));
    until("managed", |s| {
        s["state"] == "running" && s["compute"]["count"].as_u64() > calm.as_u64()
    });
    assert_eq!(
        ask("managed", "dance", &Value::Null)["error"]["code"],
        -32601
    );
    ask("managed", "stop", &Value::Null);
    component.join().expect("an orderly end");
    assert!(!RunDirectory::of(&network("managed")).path().exists());
}

#[test]
fn errors_of_compute_are_counted_and_the_loop_continues() {
    let component = run("failing").expect("to run");
    let status = until("failing", |s| s["compute"]["errors"].as_u64() > Some(5));
    assert_eq!(status["state"], "running");
    assert_eq!(status["last_error"], "again");
    component.stop();
    component.join().expect("an orderly end");
}

#[test]
fn management_ends_an_emergency_of_the_worker() {
    let component = run("afraid").expect("to run");
    until("afraid", |s| s["state"] == "emergency");
    // The loop keeps its period and calls `emergency` instead of `compute`.
    until("afraid", |s| {
        s["state"] == "emergency" && seen("afraid")[0] > 10
    });
    ask("afraid", "emergency", &json!({ "active": false }));
    until("afraid", |s| s["state"] == "running");
    assert_eq!(seen("afraid")[1], 1);
    component.stop();
    component.join().expect("an orderly end");
}

#[test]
fn a_fatal_error_ends_the_component_after_finalize() {
    let component = run("fatal").expect("to run");
    let error = component.join().expect_err("a failure");
    assert_eq!(error.to_string(), "the arm fell off");
    assert_eq!(seen("fatal")[2], 1);
}

#[test]
fn a_component_can_stop_itself() {
    run("brief")
        .expect("to run")
        .join()
        .expect("an orderly end");
}

#[test]
fn a_failed_start_gives_the_reason() {
    let error = run("unwilling").expect_err("a failure");
    assert_eq!(error.to_string(), "initialize(): there is no robot");
    assert!(!RunDirectory::of(&network("unwilling")).path().exists());
    let first = run("twin").expect("to run");
    let second = run("twin").expect_err("a second of that name");
    assert!(second.to_string().contains("runs in network"), "{second}");
    first.stop();
    first.join().expect("an orderly end");
    let usage = embed(&DESCRIPTION, Worker::start, &["--nmae", "x"]).expect_err("no such option");
    assert!(matches!(usage, StartError::Usage(_)));
}

/// A late tick does not delay the following ones. Other processes may cause lost ticks, condition
/// one tenth of a second without loss is enough.
#[test]
fn a_period_loses_no_tick() {
    let component = run("steady").expect("to start");
    ask("steady", "period", &json!({ "ms": 1 }));
    until("steady", |status| status["period_ms"] == 1.0);
    let start = Instant::now();
    loop {
        let [before, after] = [0, 100].map(|ms| {
            std::thread::sleep(Duration::from_millis(ms));
            ask("steady", "status", &Value::Null)["result"].clone()
        });
        let passed = |what: &dyn Fn(&Value) -> f64| what(&after) - what(&before);
        let time_ms = passed(&|status| status["uptime_s"].as_f64().expect("a time") * 1e3);
        let ticks = passed(&|status| status["compute"]["count"].as_f64().expect("a count"));
        assert!(ticks <= time_ms + 2.0, "{ticks} ticks in {time_ms} ms");
        if ticks >= time_ms - 2.0 {
            break;
        }
        assert!(start.elapsed() < LIMIT, "{ticks} ticks in {time_ms} ms");
    }
    component.stop();
    component.join().expect("a good end");
}
