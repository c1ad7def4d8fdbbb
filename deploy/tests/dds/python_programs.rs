//! Programs of the tests in Python: slot arrays with a peer in Rust, a source of time, and exact
//! recordings.

use rc_test_site::racks::{self, RACK, Racks, json};
use rc_test_site::site::{CommandOutput, Running, Site};
use rc_test_support::python;
use rustix::process::{Signal, kill_process};
use serde_json::Value;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// The requirements of the Python runtime, as in the tests of `rc-python`.
const NUMPY: &str = "numpy==2.3.4";

macro_rules! cdsl {
    ($name:literal) => {
        concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/tests/programs/",
            $name,
            "/",
            $name,
            ".cdsl"
        )
    };
}

const RACK_PYTHON: &str = cdsl!("rack_python");
const CLOCK_PYTHON: &str = cdsl!("clock_python");
pub(crate) const CLOCK: &str = "../clock/clock.cdsl";
const WANDERER: &str = cdsl!("wanderer");
pub(crate) const AVOIDER: &str = "../avoider/avoider.cdsl";
const AVOIDER_PYTHON: &str = "../avoider_python/avoider_python.cdsl";

/// A place for a network, with an interpreter for its components.
struct Python {
    site: Site,
    environment: &'static Path,
}

impl Python {
    /// `None` without Python 3.11 or `NumPy`: `test` is listed as skipped.
    fn new(name: &str, test: &str) -> Option<Self> {
        let python = python::packages("python-numpy", NUMPY, test)?;
        let environment = python.ancestors().nth(2)?;
        let site = Site::new(name);
        Some(Self { site, environment })
    }

    fn rcdeploy(&self, args: &[&str]) -> CommandOutput {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
        command.args(args);
        command.env("CARGO_NET_OFFLINE", "true");
        command.env("VIRTUAL_ENV", self.environment);
        self.site.run(command)
    }

    /// Builds what the network needs, and starts it.
    fn up(&self) -> CommandOutput {
        let file = self.site.ddsl().display().to_string();
        self.rcdeploy(&["up", "--build", "--detach", "--profile", "dev", &file])
    }

    /// Starts the network with this text.
    fn start(&self, text: &str) {
        self.site.write_ddsl(text);
        let up = self.up();
        assert_eq!(up.code, 0, "{up:?}");
    }

    fn down(&self) {
        assert_eq!(self.rcdeploy(&["down", &self.site.network]).code, 0);
        self.site.assert_nothing_left();
    }

    fn recording(&self, component: &str) -> String {
        recording(&self.site, component)
    }

    /// Repeats a component by its recording. Returns the exit code and the report.
    fn replay(&self, component: &str, more: &[&str]) -> (i32, Value) {
        replay(&self.site, &|args| self.rcdeploy(args), component, more)
    }

    /// Asserts that a component does again what it did.
    fn assert_repeats(&self, component: &str) {
        assert_repeats(&self.site, &|args| self.rcdeploy(args), component);
    }
}

/// `rcdeploy` with these arguments.
pub(crate) type Tool<'t> = dyn Fn(&[&str]) -> CommandOutput + 't;

/// The exact recording of a component.
fn recording(site: &Site, component: &str) -> String {
    let logs = site.path("state/robocomp").join(&site.network);
    let file = logs.join(format!("{component}.exact.mcap"));
    file.display().to_string()
}

fn replay(site: &Site, rcdeploy: &Tool<'_>, component: &str, more: &[&str]) -> (i32, Value) {
    let file = recording(site, component);
    let mut args = vec!["replay", "--check", &file, "--format", "json"];
    args.extend(more);
    let mut ran = rcdeploy(&args);
    let code = std::mem::take(&mut ran.code);
    assert!(code < 2, "{code}: {ran:?}");
    (code, json(&ran))
}

fn assert_repeats(site: &Site, rcdeploy: &Tool<'_>, component: &str) {
    let (code, report) = replay(site, rcdeploy, component, &[]);
    assert_eq!(code, 0, "{component}: {report}");
    assert_eq!(report["equal"], true, "{component}: {report}");
    let compared = report["compared"].as_u64();
    assert!(compared > Some(10), "{component}: {report}");
}

#[test]
fn members_in_python_are_slots_to_every_tool_and_over_every_middleware() {
    let test = "members_in_python_are_slots_to_every_tool_and_over_every_middleware";
    for (name, head, reader) in [
        ("python_reads", RACK, RACK_PYTHON),
        ("python_serves", RACK_PYTHON, RACK),
    ] {
        let Some(python) = Python::new(name, test) else {
            return;
        };
        crate::built();
        let both = Racks {
            head,
            reader,
            domains: (226, 227),
        };
        python.start(&both.network(&python.site));
        racks::check(&python.site, &|args| python.rcdeploy(args));
    }
}

#[test]
fn other_members_than_the_network_lists_end_a_component_in_python() {
    let test = "other_members_than_the_network_lists_end_a_component_in_python";
    let Some(python) = Python::new("python_lists", test) else {
        return;
    };
    crate::built();
    let text = format!(
        "Deployment {}\n{{\nComponent rack {{ cdsl \"{RACK_PYTHON}\"; parameters {{ members [\"front\", \"up\"]; }}; \
         slots {{ lasers \"front\", \"back\"; poses \"front\", \"up\"; }}; }};\n}};\n",
        python.site.network
    );
    python.site.write_ddsl(&text);
    let up = python.up();
    assert_ne!(up.code, 0, "{up:?}");
    let reason = "the members of `lasers` are not those of the network; it lists `back`, which the worker does not open; \
                  the worker opens `up`, which it does not list; the .ddsl needs `slots { lasers \"front\", \"up\"; }`";
    let log = python.site.log("rack");
    assert!(log.contains(reason), "{log}\n{up:?}");
    python.site.assert_nothing_left();
}

/// The trace of the patrol after ten seconds of simulated time, whose clock and avoider have these
/// descriptions. Both are repeated by their exact recordings.
pub(crate) fn patrol(site: &Site, rcdeploy: &Tool<'_>, clock: &str, avoider: &str) -> String {
    const POSES: u32 = 200;
    site.monitor("trace", POSES);
    let clock_values = "[parameters]\nstep = \"50ms\"\nrate = 0.0\n";
    site.write("clock.toml", clock_values);
    site.write_ddsl(&format!(
        "Deployment patrol\n{{\n    time simulated by clock;\n    \
         Component simulator {{ cdsl \"../simulator/simulator.cdsl\"; }};\n    \
         Component monitor {{ cdsl \"../pose_monitor/pose_monitor.cdsl\"; config \"monitor.toml\"; }};\n    \
         Component avoider {{ cdsl \"{avoider}\"; record {{ exact; }}; }};\n    \
         Component clock {{ cdsl \"{clock}\"; config \"clock.toml\"; record {{ exact; }}; }};\n}};\n"
    ));
    let file = site.ddsl().display().to_string();
    let up = rcdeploy(&["up", "--build", "--detach", "--profile", "dev", &file]);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_end_of("monitor");
    let clock = &site.ask("avoider", "status")["clock"];
    assert_eq!(clock["kind"], "simulated", "{clock}");
    assert!(clock["tick"].as_u64() > Some(100), "{clock}");
    assert_eq!(rcdeploy(&["down", &site.network]).code, 0);
    site.assert_nothing_left();
    for component in ["avoider", "clock"] {
        assert_repeats(site, rcdeploy, component);
    }
    std::fs::read_to_string(site.path("trace")).expect("the trace")
}

/// A source of time in Python drives followers in Rust and in Python in lockstep: the run is the
/// same as with the source in Rust.
#[test]
fn a_source_of_time_in_python_drives_a_network_in_lockstep() {
    let test = "a_source_of_time_in_python_drives_a_network_in_lockstep";
    let mut traces = Vec::new();
    for (name, clock, avoider) in [
        ("time_of_rust", CLOCK, AVOIDER),
        ("time_of_python", CLOCK_PYTHON, AVOIDER),
        ("time_in_python", CLOCK_PYTHON, AVOIDER_PYTHON),
    ] {
        let Some(python) = Python::new(name, test) else {
            return;
        };
        crate::built();
        let rcdeploy = |args: &[&str]| python.rcdeploy(args);
        traces.push(patrol(&python.site, &rcdeploy, clock, avoider));
    }
    assert_equal(&traces);
}

/// The network moved, and the traces are equal.
pub(crate) fn assert_equal(traces: &[String]) {
    assert!(traces[0].lines().count() >= 200, "{}", traces[0]);
    let first = traces[0].lines().next();
    assert_ne!(first, traces[0].lines().last(), "it never moved");
    for trace in &traces[1..] {
        let parted = traces[0].lines().zip(trace.lines()).find(|(a, b)| a != b);
        assert_eq!(parted, None, "the first pose that differs");
    }
}

/// Random numbers, the clock and changes of parameters are in the recording of a worker in Python,
/// and a worker that does something else is found.
#[test]
fn an_exact_recording_repeats_a_worker_in_python_and_finds_another_one() {
    let test = "an_exact_recording_repeats_a_worker_in_python_and_finds_another_one";
    let Some(python) = Python::new("python_exact", test) else {
        return;
    };
    crate::built();
    let site = &python.site;
    python.start(&format!(
        "Deployment patrol\n{{\n    Component wanderer {{ cdsl \"{WANDERER}\"; record {{ exact; }}; }};\n}};\n"
    ));
    let runs = || site.ask("wanderer", "status")["compute"]["count"].as_u64();
    let run_on = || {
        let before = runs();
        Site::until("it computes", || runs() > before.map(|runs| runs + 20));
    };
    run_on();
    let set = ["params", "set", &site.network, "wanderer", "step=7.5"];
    let set = python.rcdeploy(&set);
    assert_eq!(set.code, 0, "{set:?}");
    run_on();
    python.down();
    python.assert_repeats("wanderer");

    // A worker of this component that walks in one direction only.
    let folder = Path::new(WANDERER).parent().expect("its folder");
    let other = site.path("other");
    let copied = Command::new("cp")
        .arg("-r")
        .arg(folder)
        .arg(&other)
        .status();
    assert!(copied.expect("to copy").success());
    let worker = other.join("src/specific_worker.py");
    let text = std::fs::read_to_string(&worker).expect("the worker");
    let changed = text.replace("uniform(-ctx.params.step,", "uniform(0.0,");
    assert_ne!(text, changed);
    std::fs::write(&worker, changed).expect("to write");
    let launcher = std::fs::read_to_string(Site::executable("wanderer")).expect("a launcher");
    let canonical = folder.canonicalize().expect("its folder");
    let launcher = launcher.replace(&*canonical.to_string_lossy(), &other.to_string_lossy());
    let program = site.path("launcher");
    std::fs::copy(Site::executable("wanderer"), &program).expect("a mode");
    std::fs::write(&program, launcher).expect("to write");
    let program = program.display().to_string();
    let (code, report) = python.replay("wanderer", &["--program", &program]);
    assert_eq!(code, 1, "{report}");
    assert_eq!(report["equal"], false, "{report}");
    let recorded = report.to_string();
    assert!(recorded.contains("newFullPose"), "{report}");
}

/// Started by a service manager, as the unit of an export does it, a launcher is its component: it
/// reports itself, and is what its recording names. Without a launcher, the recording names none.
#[test]
fn a_launcher_started_by_hand_is_a_component_that_its_recording_names() {
    let test = "a_launcher_started_by_hand_is_a_component_that_its_recording_names";
    let Some(python) = Python::new("python_hand", test) else {
        return;
    };
    crate::built();
    let site = &python.site;
    python.start(&format!(
        "Deployment patrol\n{{\n    Component wanderer {{ cdsl \"{WANDERER}\"; }};\n}};\n"
    ));
    python.down();
    let recording = python.recording("wanderer");
    let end_in_order = |running: Running| {
        let runs = || site.ask("wanderer", "status")["compute"]["count"].as_u64();
        Site::until("it computes", || runs() > Some(20));
        kill_process(running.pid(), Signal::TERM).expect("it is ours");
        running.end()
    };
    let socket = site.path("manager");
    let manager = UnixDatagram::bind(&socket).expect("a socket");
    manager
        .set_read_timeout(Some(Duration::from_secs(20)))
        .expect("a limit");
    let hear = || {
        let mut bytes = [0; 64];
        let count = manager.recv(&mut bytes).expect("a message");
        String::from_utf8_lossy(&bytes[..count]).into_owned()
    };
    let socket = socket.display().to_string();
    let environment = python.environment.display().to_string();
    let variables = [
        ("NOTIFY_SOCKET", socket.as_str()),
        ("VIRTUAL_ENV", environment.as_str()),
    ];
    let running = site.start_with("wanderer", &["--record", &recording], &variables);
    assert_eq!(hear(), "READY=1");
    assert_eq!(end_in_order(running), Some(0));
    assert_eq!(hear(), "STOPPING=1");
    python.assert_repeats("wanderer");

    let launcher = Site::executable("wanderer").display().to_string();
    let text = std::fs::read_to_string(&launcher).expect("a launcher");
    let without = text.replace(" ROBOCOMP_LAUNCHER=\"$0\"", "");
    assert_ne!(text, without);
    let program = site.path("without");
    std::fs::copy(&launcher, &program).expect("its mode");
    std::fs::write(&program, without).expect("to write");
    let program = program.display().to_string();
    let running = site.start_program(
        &program,
        "wanderer",
        &["--record", &recording],
        &variables[1..],
    );
    assert_eq!(end_in_order(running), Some(0));
    let ran = python.rcdeploy(&["replay", "--check", &recording]);
    assert_eq!(ran.code, 2, "{ran:?}");
    assert!(
        ran.stderr.contains("the recording names no program"),
        "{ran:?}"
    );
    let (code, report) = python.replay("wanderer", &["--program", &launcher]);
    assert_eq!(code, 0, "{report}");
}
