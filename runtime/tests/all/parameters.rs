//! Changes of parameters at run time: management socket, worker, saving.

use rc_middleware::RunDirectory;
use rc_runtime::{
    Component, Core, Description, Embedded, ParamChange, Ports, StartError, Values, WorkerError,
    embed,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::sync::{Condvar, Mutex};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(15);

pub(crate) static DESCRIPTION: Description = Description {
    name: "tuned",
    model_hash: 1,
    middleware: "none",
    period: Duration::from_millis(2),
    parameters: Some(
        r#"{"name":"tuned","parameters":[
        {"name":"speed","doc":["How fast."],"kind":{"scalar":{"type":"float"}},"default":{"float":1.0},
         "range":{"min":{"float":0.0},"max":{"float":10.0}},"unit":"m/s","editable":true},
        {"name":"limit","kind":{"scalar":{"type":"float"}},"default":{"float":5.0},"editable":true},
        {"name":"device","kind":{"scalar":{"type":"path"}},"default":{"text":"/dev/a"},"restart":true},
        {"name":"token","kind":{"scalar":{"type":"string"}},"default":{"text":"s3cret"},"editable":true,"secret":true},
        {"name":"fixed","kind":{"scalar":{"type":"int"}},"default":{"int":1}}],
        "rules":[{"condition":[{"parameter":{"path":["speed"]}},{"parameter":{"path":["limit"]}},{"compare":"<="}],
         "text":"speed <= limit","message":"it moves too fast"}]}"#,
    ),
    folder: "/nowhere",
    slots: &[],
    backends: &[],
    types: &[],
    simulates_time: false,
    managed: false,
    converter: None,
    note: b"",
};

/// Observations of a worker.
#[derive(Clone, Debug, Default)]
struct Seen {
    /// The speed in the last compute, and the number of computes.
    speed: f64,
    computes: u32,
    /// The arguments of `params_changed`, with the speed in the context at that time.
    notified: Vec<(String, f64)>,
    /// Whether the worker blocks, and whether it may continue.
    hangs: bool,
    free: bool,
    /// Changes that the worker requests itself.
    wanted: Vec<(&'static str, rc_runtime::Value)>,
}

static SEEN: Mutex<BTreeMap<String, Seen>> = Mutex::new(BTreeMap::new());
static CHANGED: Condvar = Condvar::new();

/// Records an observation and wakes waiting threads.
fn note(name: &str, what: impl FnOnce(&mut Seen)) {
    what(
        SEEN.lock()
            .expect("notes")
            .entry(name.to_owned())
            .or_default(),
    );
    CHANGED.notify_all();
}

/// Waits until `condition` holds.
fn until(name: &str, condition: impl Fn(&Seen) -> bool) -> Seen {
    let seen = SEEN.lock().expect("notes");
    let (seen, waited) = CHANGED
        .wait_timeout_while(seen, LIMIT, |seen| !seen.get(name).is_some_and(&condition))
        .expect("notes");
    assert!(!waited.timed_out(), "{name}: {:?}", seen.get(name));
    seen[name].clone()
}

fn hang(name: &str) {
    note(name, |seen| seen.hangs = true);
    until(name, |seen| seen.free);
    note(name, |seen| seen.hangs = false);
}

pub(crate) struct Worker {
    core: Core,
    speed: f64,
    hung: bool,
}

impl Worker {
    #[expect(clippy::unnecessary_wraps, reason = "the runtime expects a `Result`")]
    pub(crate) fn start(core: Core, _: &Ports, values: &Values) -> Result<Self, StartError> {
        if core.name() == "begins" {
            hang("begins");
        }
        Ok(Self {
            core,
            speed: values.float("speed"),
            hung: false,
        })
    }
}

impl Component for Worker {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        let name = self.core.name().to_owned();
        if name == "hangs" && !self.hung {
            self.hung = true;
            hang(&name);
        }
        let mut wanted = Vec::new();
        note(&name, |seen| {
            seen.speed = self.speed;
            seen.computes += 1;
            wanted = std::mem::take(&mut seen.wanted);
        });
        for (path, value) in wanted {
            self.core.set_parameter(path, value);
        }
        Ok(())
    }

    fn set_parameters(&mut self, values: &Values) {
        self.speed = values.float("speed");
    }

    fn parameters_changed(&mut self, changes: &[ParamChange]) -> Result<(), WorkerError> {
        let name = self.core.name().to_owned();
        for change in changes {
            note(&name, |seen| {
                seen.notified.push((change.to_string(), self.speed));
            });
        }
        if name.starts_with("slow") && !self.hung {
            self.hung = true;
            hang(&name);
        } else if name == "slow_stuck" {
            return Err(WorkerError::Fatal("there is no way back".to_owned()));
        }
        match changes.iter().find_map(|change| change.new.as_float()) {
            Some(4.0) => Err(WorkerError::Failed("the gear is stuck".to_owned())),
            Some(4.5) => Err(WorkerError::Emergency("it burns".to_owned())),
            _ => Ok(()),
        }
    }
}

fn network(name: &str) -> String {
    format!("parameters_{name}_{}", std::process::id())
}

pub(crate) fn run(name: &str, config: &[&str]) -> Embedded {
    let network = network(name);
    let mut args = vec!["--network", &network, "--name", name];
    args.extend(config);
    embed(&DESCRIPTION, Worker::start, &args).expect("to run")
}

pub(crate) fn connect(name: &str) -> BufReader<UnixStream> {
    let socket = RunDirectory::of(&network(name)).socket(name);
    let stream = UnixStream::connect(socket).expect("its socket");
    stream.set_read_timeout(Some(LIMIT)).expect("a limit");
    BufReader::new(stream)
}

pub(crate) fn send(stream: &mut BufReader<UnixStream>, id: u32, method: &str, params: &Value) {
    let request = json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params });
    let line = format!("{request}\n");
    stream
        .get_mut()
        .write_all(line.as_bytes())
        .expect("a request");
}

pub(crate) fn receive_reply(stream: &mut BufReader<UnixStream>) -> Value {
    let mut line = String::new();
    stream.read_line(&mut line).expect("a reply");
    serde_json::from_str(&line).expect("JSON")
}

pub(crate) fn ask(name: &str, method: &str, params: &Value) -> Value {
    let mut stream = connect(name);
    send(&mut stream, 7, method, params);
    let reply = receive_reply(&mut stream);
    assert_eq!(reply["id"], 7);
    reply
}

pub(crate) fn set(name: &str, changes: &Value) -> Value {
    ask(name, "parameters_set", &json!({ "changes": changes }))
}

pub(crate) fn get(name: &str, path: &str) -> Value {
    let reply = ask(name, "parameters", &json!({ "paths": [path] }));
    reply["result"]["parameters"][0].clone()
}

pub(crate) fn end(component: Embedded) {
    component.stop();
    component.join().expect("an orderly end");
}

#[test]
fn valid_changes_reach_the_worker_and_invalid_ones_do_not() {
    let component = run("accepts", &[]);
    let reply = set("accepts", &json!({ "speed": 2 }));
    let expected =
        json!({ "changed": [{ "path": "speed", "old": 1.0, "new": 2.0 }], "pending": [] });
    assert_eq!(reply["result"], expected, "{reply}");
    // `params_changed` ran before the reply, with the new value in the context.
    let seen = until("accepts", |seen| seen.speed == 2.0);
    assert_eq!(seen.notified, [("speed: 1.0 -> 2.0".to_owned(), 2.0)]);
    assert_eq!(get("accepts", "speed")["value"], json!(2.0));

    // One of the changes is invalid: none is applied, and all errors are reported.
    let reply = set(
        "accepts",
        &json!({ "speed": 3, "limt": 9, "fixed": 2, "token": 5 }),
    );
    assert_eq!(reply["error"]["code"], -32602, "{reply}");
    let findings = reply["error"]["data"]["findings"]
        .as_array()
        .expect("a list");
    let codes: Vec<&Value> = findings.iter().map(|f| &f["code"]).collect();
    assert_eq!(
        codes,
        ["fixed-parameter", "unknown-parameter", "wrong-type"]
    );
    let message = reply["error"]["message"].as_str().expect("a text");
    assert!(message.contains("did you mean `limit`?"), "{message}");
    let broken = set("accepts", &json!({ "speed": 6 }));
    assert_eq!(
        broken["error"]["data"]["findings"][0]["code"],
        "rule-broken"
    );
    // Both changes together satisfy the rule, and the worker gets them in one call.
    let reply = set("accepts", &json!({ "speed": 6, "limit": 7 }));
    assert_eq!(reply["result"]["changed"].as_array().map(Vec::len), Some(2));
    // Setting the current value is not a change.
    let reply = set("accepts", &json!({ "speed": 6 }));
    assert_eq!(reply["result"], json!({ "changed": [], "pending": [] }));
    let notified = until("accepts", |seen| seen.speed == 6.0).notified;
    let notified: Vec<&str> = notified.iter().map(|(change, _)| change.as_str()).collect();
    assert_eq!(
        notified,
        [
            "speed: 1.0 -> 2.0",
            "limit: 5.0 -> 7.0",
            "speed: 2.0 -> 6.0"
        ]
    );
    for wrong in [
        json!({}),
        json!({ "changes": [] }),
        json!({ "changes": {} }),
    ] {
        let reply = ask("accepts", "parameters_set", &wrong);
        assert_eq!(reply["error"]["code"], -32602, "{reply}");
    }
    end(component);
}

#[test]
fn a_worker_changes_its_own_parameters_as_a_tool_does() {
    const NAME: &str = "own";
    let component = run(NAME, &[]);
    let request = |path, value: rc_runtime::Value| {
        note(NAME, |seen| seen.wanted.push((path, value)));
    };
    let await_so = |what: &str, so: &dyn Fn() -> bool| {
        let start = Instant::now();
        while !so() {
            assert!(start.elapsed() < LIMIT, "{what}");
        }
    };
    let shows = |speed: f64| {
        await_so("a tool sees it", &|| {
            get(NAME, "speed")["value"] == json!(speed)
        });
    };
    request("speed", 2.0.into());
    let seen = until(NAME, |seen| seen.speed == 2.0);
    assert_eq!(seen.notified, [("speed: 1.0 -> 2.0".to_owned(), 2.0)]);
    shows(2.0);
    let fails = |path: &str, reason: &str| {
        await_so(reason, &|| {
            let error = ask(NAME, "status", &Value::Null)["result"]["last_error"].to_string();
            error.contains(&format!(
                "the worker cannot change its parameter `{path}`: "
            )) && error.contains(reason)
        });
    };
    for (path, value, reason) in [
        ("speed", 6.0.into(), "it moves too fast"),
        ("limt", 9.into(), "did you mean `limit`?"),
        ("fixed", 2.into(), "fixed"),
        ("speed", 4.0.into(), "the gear is stuck"),
    ] {
        request(path, value);
        fails(path, reason);
        assert_eq!(get(NAME, "speed")["value"], json!(2.0));
    }
    // A worker that requests without end has a limit. Those before it are made, in their order.
    note(NAME, |seen| {
        let speeds = (1..=100).map(|number| f64::from(number) / 64.0);
        seen.wanted = speeds.map(|speed| ("speed", speed.into())).collect();
    });
    fails("speed", "64 changes of this worker wait already");
    shows(1.0);
    until(NAME, |seen| seen.speed == 1.0);
    end(component);
}

#[test]
fn a_change_that_the_worker_rejects_is_reverted() {
    let component = run("refuses", &[]);
    let reply = set(
        "refuses",
        &json!({ "speed": 4, "token": "n3w", "device": "/dev/b" }),
    );
    assert_eq!(
        reply["error"],
        json!({ "code": -32001, "message": "the gear is stuck" })
    );
    let seen = until("refuses", |seen| !seen.notified.is_empty());
    // `params_changed` saw the new value. Now the old one is restored.
    assert!(
        seen.notified.iter().all(|(_, speed)| *speed == 4.0),
        "{seen:?}"
    );
    let computes = seen.computes;
    until("refuses", |seen| {
        seen.computes > computes + 1 && seen.speed == 1.0
    });
    assert_eq!(get("refuses", "speed")["value"], json!(1.0));
    assert_eq!(get("refuses", "device")["pending"], Value::Null);
    // The worker may also raise an emergency.
    let reply = set("refuses", &json!({ "speed": 4.5 }));
    assert_eq!(
        reply["error"]["message"],
        "it burns; the component is in emergency now"
    );
    let start = Instant::now();
    while ask("refuses", "status", &Value::Null)["result"]["state"] != "emergency" {
        assert!(start.elapsed() < LIMIT, "not in the state Emergency");
    }
    assert_eq!(get("refuses", "speed")["value"], json!(1.0));
    end(component);
}

#[test]
fn a_change_for_the_next_start_is_pending_and_not_passed_to_the_worker() {
    let component = run("later", &[]);
    let reply = set("later", &json!({ "device": "/dev/b" }));
    let expected = json!([{ "path": "device", "old": "/dev/a", "new": "/dev/b" }]);
    assert_eq!(reply["result"]["pending"], expected, "{reply}");
    let device = get("later", "device");
    assert_eq!(
        (&device["value"], &device["pending"]),
        (&json!("/dev/a"), &json!("/dev/b"))
    );
    let computes = until("later", |seen| seen.computes > 0).computes;
    assert!(
        until("later", |seen| seen.computes > computes + 1)
            .notified
            .is_empty()
    );
    // Without a configuration file, saving fails.
    let reply = ask("later", "parameters_save", &json!({}));
    assert_eq!(reply["error"]["code"], -32003, "{reply}");
    end(component);
}

#[test]
fn no_reply_contains_a_secret() {
    let component = run("hides", &[]);
    let replies = [
        set("hides", &json!({ "token": "n3w" })),
        set("hides", &json!({ "token": 770_019_283_746_i64 })),
        set("hides", &json!({ "token": ["770019283746"], "speed": 99 })),
        ask("hides", "parameters", &json!({})),
        ask("hides", "status", &json!({})),
    ];
    let notified = until("hides", |seen| !seen.notified.is_empty()).notified;
    assert_eq!(notified[0].0, "token: *** -> ***");
    for reply in replies.iter().map(ToString::to_string) {
        for secret in ["s3cret", "n3w", "7700192"] {
            assert!(!reply.contains(secret), "{reply}");
        }
    }
    end(component);
}

#[test]
fn a_blocked_worker_does_not_get_the_change() {
    let component = run("hangs", &[]);
    until("hangs", |seen| seen.hangs);
    // Two clients wait for replies. Management serves others meanwhile.
    let (mut first, mut second) = (connect("hangs"), connect("hangs"));
    send(
        &mut first,
        1,
        "parameters_set",
        &json!({ "changes": { "speed": 2 } }),
    );
    send(
        &mut second,
        2,
        "parameters_set",
        &json!({ "changes": { "speed": 3 } }),
    );
    assert_eq!(
        ask("hangs", "status", &Value::Null)["result"]["state"],
        "running"
    );
    for stream in [&mut first, &mut second] {
        let reply = receive_reply(stream);
        assert_eq!(reply["error"]["code"], -32002, "{reply}");
        let message = reply["error"]["message"].as_str().expect("a text");
        assert!(message.contains("nothing has changed"), "{message}");
    }
    note("hangs", |seen| seen.free = true);
    let seen = until("hangs", |seen| seen.computes > 3);
    assert_eq!((seen.speed, seen.notified), (1.0, Vec::new()));
    assert_eq!(get("hangs", "speed")["value"], json!(1.0));
    // The worker accepts changes again.
    assert!(set("hangs", &json!({ "speed": 3 }))["result"].is_object());
    until("hangs", |seen| seen.speed == 3.0);
    end(component);
}

#[test]
fn a_change_that_exceeds_its_time_limit_is_reverted() {
    let component = run("slow", &[]);
    let reply = set("slow", &json!({ "speed": 2 }));
    assert_eq!(reply["error"]["code"], -32002, "{reply}");
    let message = reply["error"]["message"].as_str().expect("a text");
    assert!(message.contains("params_changed()"), "{message}");
    note("slow", |seen| seen.free = true);
    let seen = until("slow", |seen| seen.notified.len() == 2);
    assert_eq!(seen.notified[1], ("speed: 2.0 -> 1.0".to_owned(), 1.0));
    until("slow", |seen| seen.computes > 1 && seen.speed == 1.0);
    assert_eq!(get("slow", "speed")["value"], json!(1.0));
    end(component);
}

#[test]
fn a_worker_that_cannot_revert_a_change_ends() {
    let component = run("slow_stuck", &[]);
    let reply = set("slow_stuck", &json!({ "speed": 2 }));
    assert_eq!(reply["error"]["code"], -32002, "{reply}");
    note("slow_stuck", |seen| seen.free = true);
    let ended = component.join().expect_err("a fatal error");
    assert!(ended.to_string().contains("no way back"), "{ended}");
}

#[test]
fn a_change_during_initialize_is_rejected_with_that_reason() {
    let starting = std::thread::spawn(|| run("begins", &[]));
    until("begins", |seen| seen.hangs);
    let reply = set("begins", &json!({ "speed": 2 }));
    assert_eq!(reply["error"]["code"], -32002, "{reply}");
    let message = reply["error"]["message"].as_str().expect("a text");
    assert!(message.contains("initialize() has not ended"), "{message}");
    note("begins", |seen| seen.free = true);
    end(starting.join().expect("to run"));
}
