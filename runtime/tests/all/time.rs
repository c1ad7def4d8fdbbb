//! Simulated time: a source and its followers, on threads of this process.

use rc_middleware::typed::{HandlerError, Operation, TypedPublisher};
use rc_middleware::{Qos, RunDirectory};
use rc_runtime::{
    Component, Core, Description, Embedded, Member, Order, Ports, Role, Sample, Slot, StartError,
    Time, TimeError, TimeSource, Values, WorkerError, embed,
};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::sync::{Condvar, LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(20);
const STEP: Duration = Duration::from_millis(10);

pub(super) static VALUE: [Operation; 1] = [Operation {
    name: "value",
    id: 1,
    type_hash: 7,
    two_way: false,
    replies: &[],
}];

pub(super) const fn slot(name: &'static str, role: Role, qos: Qos) -> Slot {
    Slot {
        name,
        role,
        interface: "Values",
        type_name: "Test::Values",
        type_hash: 7,
        backend: "local",
        qos,
        operations: &VALUE,
        is_array: false,
        external_types: &[],
    }
}

static SOURCE: Description = Description {
    name: "source",
    model_hash: 1,
    middleware: "local",
    period: Duration::from_millis(1),
    parameters: None,
    folder: "/nowhere",
    slots: &[],
    backends: &[rc_local::LINKED],
    types: &[],
    simulates_time: true,
    managed: false,
    converter: None,
    note: b"",
};

/// Publishes a number in each `compute()`, and hears the numbers of all.
pub(super) const FOLLOWER: Description = Description {
    name: "follower",
    period: Duration::from_millis(20),
    slots: &[
        slot("Out", Role::Publishes, Qos::PUBLISHER),
        slot(
            "In",
            Role::SubscribesTo,
            Qos {
                depth: 100,
                deadline: Some(Duration::from_millis(500)),
                ..Qos::SUBSCRIBER
            },
        ),
    ],
    types: &[],
    simulates_time: false,
    managed: false,
    converter: None,
    model_hash: 2,
    middleware: "local",
    parameters: None,
    folder: "/nowhere",
    backends: &[rc_local::LINKED],
    note: b"",
};

/// State shared by a test and its components, by network.
#[derive(Debug, Default)]
pub(super) struct Script {
    /// Steps of followers, in order: time in ms, name, step.
    pub(super) trace: Vec<(u64, String, String)>,
    pub(super) ticks: u64,
    pub(super) last_tick: u64,
    /// How often a loop has asked for the awaited end of a client.
    pub(super) looks: usize,
    /// Replies that the servers have sent.
    pub(super) replies: [usize; 2],
    /// The test lets the waiting part go on.
    pub(super) goes_on: bool,
    paused: bool,
    /// The source has seen that it is paused.
    stands: bool,
    jump_at: Option<u64>,
    hangs: Option<String>,
    missing: Vec<Vec<String>>,
    refused: Option<TimeError>,
}

static SCRIPTS: LazyLock<(Mutex<HashMap<String, Script>>, Condvar)> =
    LazyLock::new(Default::default);

pub(super) fn script<T>(network: &str, change: impl FnOnce(&mut Script) -> T) -> T {
    let mut scripts = SCRIPTS.0.lock().unwrap_or_else(PoisonError::into_inner);
    let result = change(scripts.entry(network.to_owned()).or_default());
    SCRIPTS.1.notify_all();
    result
}

/// Waits until the script is `so`.
pub(super) fn until(network: &str, so: impl Fn(&Script) -> bool) {
    let scripts = SCRIPTS.0.lock().unwrap_or_else(PoisonError::into_inner);
    let waited = SCRIPTS.1.wait_timeout_while(scripts, LIMIT, |scripts| {
        !so(scripts.entry(network.to_owned()).or_default())
    });
    let (scripts, waited) = waited.unwrap_or_else(PoisonError::into_inner);
    let found = format!("{:?}", scripts.get(network));
    drop(scripts);
    assert!(!waited.timed_out(), "{found}");
}

struct Source {
    core: Core,
    time: TimeSource,
}

impl Source {
    #[expect(clippy::unnecessary_wraps, reason = "the runtime expects a `Result`")]
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        let mut time = ports.time_source();
        match core.name() {
            "free" => {}
            "brief" => time.wait_for_all(Duration::from_millis(100)),
            _ => time.wait_for_all(LIMIT),
        }
        if core.name() == "at-once" {
            time.set_order(Order::AtOnce);
        }
        time.set_paced(matches!(core.name(), "free" | "brief"));
        Ok(Self { core, time })
    }
}

impl Component for Source {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        let network = self.core.network().to_owned();
        let (tick, missing) = (self.time.tick(), self.time.missing());
        let (may, jump) = script(&network, |script| {
            script.last_tick = tick;
            if !missing.is_empty() && script.missing.last() != Some(&missing) {
                script.missing.push(missing.clone());
            }
            let jump = script.jump_at.take_if(|at| *at == tick).is_some();
            script.stands = script.paused;
            (!script.paused && tick < script.ticks, jump)
        });
        if !may || !missing.is_empty() {
            return Ok(());
        }
        if jump {
            self.time.set(Time::ZERO)?;
            return Ok(());
        }
        let before = self.core.now();
        self.time.advance(STEP)?;
        assert_eq!(self.core.now(), before + STEP);
        // A second tick has to wait for the first one, if there is a follower.
        if self.core.name() == "brief"
            && let Err(error) = self.time.advance(STEP)
        {
            script(&network, |script| script.refused = Some(error));
        }
        Ok(())
    }
}

struct Follower {
    core: Core,
    out: TypedPublisher,
    runs: u32,
}

impl Follower {
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        Ok(Self {
            core,
            out: ports.publisher(0, 0)?,
            runs: 0,
        })
    }

    fn note(&self, what: String) {
        note(&self.core, what);
    }
}

/// Writes down what a component did.
pub(super) fn note(core: &Core, what: String) {
    let ms = core.now().as_nanos() / 1_000_000;
    let name = core.name().to_owned();
    script(core.network(), |script| {
        script.trace.push((ms, name, what));
    });
}

impl Component for Follower {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.runs += 1;
        self.note(format!("compute {}", self.runs));
        until(self.core.network(), |script| {
            script.hangs.as_deref() != Some(self.core.name())
        });
        let runs = self.runs;
        self.out.publish_with(|writer| writer.put(&runs))?;
        Ok(())
    }

    fn receive(
        &mut self,
        _: usize,
        _: Option<&Member>,
        _: usize,
        sample: Sample<'_>,
    ) -> Result<(), HandlerError> {
        let reader = &mut sample.reader();
        let number: u32 = reader.get()?;
        self.note(format!("sample {number}"));
        Ok(())
    }
}

pub(super) fn network(test: &str) -> String {
    format!("time_{test}_{}", std::process::id())
}

pub(super) fn source(network: &str, name: &str, more: &[&str]) -> Embedded {
    let mut args = vec!["--network", network, "--name", name];
    args.extend(more);
    embed(&SOURCE, Source::start, &args).expect("a source")
}

pub(super) fn follower(network: &str, name: &str) -> Embedded {
    follower_of(&FOLLOWER, network, name)
}

/// A follower over the middleware of a description.
pub(super) fn follower_of(of: &'static Description, network: &str, name: &str) -> Embedded {
    let args = ["--network", network, "--name", name, "--clock", "simulated"];
    embed(of, Follower::start, &args).expect("a follower")
}

pub(super) fn end(components: impl IntoIterator<Item = Embedded>) {
    let components: Vec<Embedded> = components.into_iter().collect();
    components.iter().for_each(Embedded::stop);
    for component in components {
        component.join().expect("a good end");
    }
}

fn status(network: &str, name: &str) -> Value {
    ask(network, name, "status", &json!({}))["result"].clone()
}

/// The answer of a component to a request of management.
pub(super) fn ask(network: &str, name: &str, method: &str, params: &Value) -> Value {
    let socket = RunDirectory::of(network).socket(name);
    let mut stream = UnixStream::connect(socket).expect("its socket");
    stream.set_read_timeout(Some(LIMIT)).expect("a limit");
    let request = json!({ "jsonrpc": "2.0", "id": 7, "method": method, "params": params });
    stream
        .write_all(format!("{request}\n").as_bytes())
        .expect("to ask");
    let mut line = String::new();
    BufReader::new(stream)
        .read_line(&mut line)
        .expect("an answer");
    serde_json::from_str(&line).expect("JSON")
}

pub(super) fn until_status(network: &str, name: &str, so: impl Fn(&Value) -> bool) -> Value {
    let start = Instant::now();
    loop {
        let status = status(network, name);
        if so(&status) {
            return status;
        }
        assert!(start.elapsed() < LIMIT, "{status}");
        std::thread::yield_now();
    }
}

/// Runs three seconds of simulated time with two followers.
fn run(test: &str) -> Vec<(u64, String, String)> {
    let network = network(test);
    script(&network, |script| script.ticks = 300);
    let source = source(&network, "source", &["--followers", "b,a"]);
    // The order of the starts does not matter.
    let names = if test.ends_with('1') {
        ["a", "b"]
    } else {
        ["b", "a"]
    };
    let followers = names.map(|name| follower(&network, name));
    until(&network, |script| script.last_tick == 300);
    // The status names the followers at the next sweep.
    let of_source = until_status(&network, "source", |status| {
        status["clock"]["followers"] == json!(["b", "a"])
    });
    let clock = &of_source["clock"];
    assert_eq!(clock["kind"], "source");
    assert_eq!(
        (&clock["time_s"], &clock["tick"]),
        (&json!(3.0), &json!(300))
    );
    let of_follower = until_status(&network, "a", |status| status["clock"]["time_s"] == 3.0);
    assert_eq!(of_follower["clock"]["kind"], "simulated");
    end(followers.into_iter().chain([source]));
    script(&network, |script| std::mem::take(&mut script.trace))
}

#[test]
fn in_lockstep_a_run_repeats_exactly() {
    let first = run("repeat1");
    // The period is twenty milliseconds, from the first tick on.
    let of = |name: &str, what: &str| {
        let mut of = first
            .iter()
            .filter(|(_, n, w)| n == name && w.starts_with(what));
        let times: Vec<u64> = of.by_ref().map(|(ms, ..)| *ms).collect();
        times
    };
    let period: Vec<u64> = (0..150).map(|n| 10 + 20 * n).collect();
    assert_eq!(of("a", "compute"), period);
    assert_eq!(of("b", "compute"), period);
    // `b` has its turn first: `a` hears it in the same tick, and `b` hears `a` in the next one.
    let expected = [
        (10, "b", "compute 1"),
        (10, "a", "sample 1"),
        (10, "a", "compute 1"),
        (20, "b", "sample 1"),
        (20, "b", "sample 1"),
        (20, "a", "sample 1"),
        (30, "b", "compute 2"),
    ];
    let expected = expected.map(|(ms, name, what)| (ms, name.to_owned(), what.to_owned()));
    assert_eq!(first[..7], expected);
    assert_eq!(run("repeat2"), first);
}

#[test]
fn all_may_do_a_tick_at_the_same_time() {
    let network = network("at_once");
    script(&network, |script| script.ticks = 100);
    let source = source(&network, "at-once", &["--followers", "a,b"]);
    let followers = ["a", "b"].map(|name| follower(&network, name));
    until(&network, |script| script.last_tick == 100);
    end(followers.into_iter().chain([source]));
    let trace = script(&network, |script| std::mem::take(&mut script.trace));
    for name in ["a", "b"] {
        let computed = trace
            .iter()
            .filter(|(_, n, what)| n == name && what.starts_with("compute"));
        assert_eq!(computed.count(), 50, "{trace:?}");
    }
}

#[test]
fn a_follower_that_hangs_is_named_and_time_goes_on_when_it_is_back() {
    let network = network("hang");
    script(&network, |script| {
        script.ticks = 200;
        script.hangs = Some("b".to_owned());
    });
    let source = source(&network, "brief", &["--followers", "a,b"]);
    let followers = ["a", "b"].map(|name| follower(&network, name));
    until(&network, |script| {
        script.missing.last() == Some(&vec!["b".to_owned()])
    });
    let status = until_status(&network, "brief", |s| {
        s["clock"]["waiting_for"] == json!(["b"])
    });
    assert_eq!(status["clock"]["tick"], 1);
    // Time stands for all, and every living component stays alive.
    assert_eq!(self::status(&network, "a")["clock"]["time_s"], 0.01);
    let refused = script(&network, |script| script.refused.take());
    let waiting = TimeError::Waiting {
        tick: 1,
        waiting_for: vec!["a".to_owned()],
    };
    assert_eq!(refused, Some(waiting));
    script(&network, |script| script.hangs = None);
    until(&network, |script| script.last_tick == 200);
    let status = until_status(&network, "brief", |s| {
        s["clock"].get("waiting_for").is_none()
    });
    assert_eq!(status["clock"]["time_s"], 2.0);
    end(followers.into_iter().chain([source]));
}

#[test]
fn who_leaves_in_order_is_not_waited_for_and_may_join_again() {
    let network = network("leave");
    script(&network, |script| script.ticks = u64::MAX);
    let source = source(&network, "source", &["--followers", "a,b"]);
    let [a, b] = ["a", "b"].map(|name| follower(&network, name));
    until(&network, |script| script.last_tick > 10);
    end([b]);
    let tick = script(&network, |script| script.last_tick);
    until(&network, |script| script.last_tick > tick + 10);
    let b = follower(&network, "b");
    let joined = until_status(&network, "b", |s| s["compute"]["count"].as_u64() > Some(3));
    assert!(joined["clock"]["time_s"].as_f64() > Some(0.1), "{joined}");
    end([a, b, source]);
}

#[test]
fn while_time_stands_nothing_is_due_and_nobody_hangs() {
    let network = network("pause");
    script(&network, |script| script.ticks = u64::MAX);
    let source = source(&network, "free", &[]);
    let follower = follower(&network, "a");
    until_status(&network, "a", |s| s["compute"]["count"].as_u64() > Some(5));
    script(&network, |script| script.paused = true);
    until(&network, |script| script.stands);
    let tick = script(&network, |script| script.last_tick);
    until_status(&network, "a", |s| s["clock"]["tick"] == tick);
    let before = status(&network, "a");
    // The loop turns, half a second long at least, and repeated ticks change nothing.
    let later = until_status(&network, "a", |s| {
        s["uptime_s"].as_f64() > before["uptime_s"].as_f64().map(|t| t + 0.6)
    });
    assert_eq!(later["compute"]["count"], before["compute"]["count"]);
    assert_eq!(later["clock"], before["clock"]);
    assert!(later["age_ms"].as_u64() < Some(1000), "{later}");
    script(&network, |script| script.paused = false);
    until_status(&network, "a", |s| {
        s["compute"]["count"].as_u64() > before["compute"]["count"].as_u64()
    });
    end([follower, source]);
}

#[test]
fn time_may_jump_back_and_periods_begin_anew() {
    let network = network("jump");
    script(&network, |script| {
        script.ticks = 21;
        script.jump_at = Some(15);
    });
    let source = source(&network, "source", &["--followers", "a"]);
    let follower = follower(&network, "a");
    until(&network, |script| script.last_tick == 21);
    end([follower, source]);
    let trace = script(&network, |script| std::mem::take(&mut script.trace));
    let computed = trace
        .iter()
        .filter(|(_, _, what)| what.starts_with("compute"));
    let times: Vec<u64> = computed.map(|(ms, ..)| *ms).collect();
    assert_eq!(times, [10, 30, 50, 70, 90, 110, 130, 150, 0, 20, 40]);
}

#[test]
fn a_source_that_is_started_anew_is_followed() {
    let network = network("anew");
    script(&network, |script| script.ticks = u64::MAX);
    let first = source(&network, "free", &[]);
    let follower = follower(&network, "a");
    until_status(&network, "a", |s| s["clock"]["tick"].as_u64() > Some(50));
    end([first]);
    script(&network, |script| script.ticks = 40);
    let second = source(&network, "source", &["--followers", "a"]);
    let status = until_status(&network, "a", |s| s["clock"]["tick"] == 40);
    assert_eq!(status["clock"]["time_s"], 0.4);
    end([follower, second]);
}

#[test]
fn a_source_that_is_gone_is_told_of() {
    let network = network("gone");
    script(&network, |script| script.ticks = u64::MAX);
    let first = source(&network, "free", &[]);
    let follower = follower(&network, "a");
    until_status(&network, "a", |s| s["clock"]["tick"].as_u64() > Some(5));
    end([first]);
    let lost = until_status(&network, "a", |s| s["clock"].get("lost_ms").is_some());
    assert!(lost["age_ms"].as_u64() < Some(1000), "{lost}");
    let second = source(&network, "free", &[]);
    until_status(&network, "a", |s| s["clock"].get("lost_ms").is_none());
    end([follower, second]);
}

#[test]
fn a_second_source_is_refused() {
    let network = network("two");
    script(&network, |script| script.ticks = u64::MAX);
    let first = source(&network, "free", &[]);
    let args = ["--network", &network, "--name", "other"];
    let error = embed(&SOURCE, Source::start, &args).expect_err("a second source");
    assert!(
        error.to_string().contains("already has a server"),
        "{error}"
    );
    let args = [
        "--network",
        &network,
        "--name",
        "other",
        "--clock",
        "system",
    ];
    let other = embed(&SOURCE, Source::start, &args).expect("no source");
    let until_failed = until_status(&network, "other", |s| s["compute"]["errors"] != 0);
    assert_eq!(until_failed["clock"]["kind"], "system");
    let inactive = TimeError::Inactive.to_string();
    assert_eq!(until_failed["last_error"], inactive.as_str());
    end([other, first]);
}

#[test]
fn a_wrong_clock_is_refused() {
    let refused = |description, more: &[&str]| {
        let network = network("usage");
        let mut args = vec!["--network", &network];
        args.extend(more);
        let error = embed(description, Follower::start, &args).expect_err("wrong usage");
        assert!(matches!(error, StartError::Usage(_)), "{error}");
        error.to_string()
    };
    for (args, expected) in [
        (
            &["--clock", "sun"][..],
            "--clock takes system, simulated, simulated:MIDDLEWARE or source, not `sun`",
        ),
        (&["--clock", "simulated:ice"], "--clock takes system"),
        (
            &["--clock", "source"],
            "write `simulates time;` in its .cdsl",
        ),
        (
            &["--followers", "a"],
            "--followers goes with --clock source",
        ),
        (
            &["--clock", "source", "--followers", "a b"],
            "`a b` is not a name",
        ),
    ] {
        let found = refused(&FOLLOWER, args);
        assert!(found.contains(expected), "{found}");
    }
    let args = ["--network", "time_over_dds", "--clock", "simulated:dds"];
    let error = embed(&FOLLOWER, Follower::start, &args).expect_err("no such middleware");
    assert!(
        error
            .to_string()
            .contains("cannot hear time over dds; its middlewares are: local"),
        "{error}"
    );
}
