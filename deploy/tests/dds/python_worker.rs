//! The patrol with the avoider in Python, built and started as a user does it: it does what the one
//! in Rust does, over every middleware.

use crate::python;
use crate::site::{PATROL, Site};
use rustix::process::{Pid, Signal, kill_process};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// What the runtime of Python needs, in the environment of the tests of `rc-python`.
const NUMPY: &str = "numpy==2.3.4";
const RUST: &str = "cdsl \"../avoider/avoider.cdsl\";";
const PYTHON: &str = "cdsl \"../avoider_python/avoider_python.cdsl\";";

/// The virtual environment of the components. `None` without Python 3.11 or `NumPy`: `test` is
/// listed as skipped.
fn environment(test: &str) -> Option<&'static Path> {
    let python = python::packages("python-numpy", NUMPY, test)?;
    python.ancestors().nth(2)
}

/// `rcdeploy ARGS… FILE` in a virtual environment.
fn rcdeploy(site: &Site, environment: &Path, args: &[&str]) -> Command {
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    command.args(args).args(["--profile", "dev"]);
    command.arg(site.ddsl());
    command.env("CARGO_NET_OFFLINE", "true");
    command.env("VIRTUAL_ENV", environment);
    command.env("ROS_LOCALHOST_ONLY", "1");
    command
}

/// The trace of the monitor after so many poses in lockstep: the same on every machine. `avoider`
/// names its component.
fn trace(name: &str, environment: &Path, avoider: &str, poses: usize, middleware: &str) -> String {
    let site = Site::new(name);
    let map = Site::components().join("maps/house.map");
    let map = map.display();
    let trace = site.path("trace.csv");
    let configurations = [
        (
            "simulator",
            format!(
                "[component]\nperiod = \"5ms\"\n[parameters]\nmap = \"{map}\"\nlockstep = true\nseed = 7\n"
            ),
        ),
        (
            "pose_monitor",
            format!(
                "[parameters]\nmap = \"{map}\"\nsvg = \"\"\ntrace = \"{}\"\nsamples = {poses}\n",
                trace.display()
            ),
        ),
        (
            "avoider",
            "[component]\nperiod = \"5ms\"\n[parameters]\nlockstep = true\n".to_owned(),
        ),
    ];
    let mut text = PATROL.to_owned();
    for (component, configuration) in &configurations {
        let file = site.write(&format!("{component}.toml"), configuration);
        let cdsl = format!("cdsl \"../{component}/{component}.cdsl\";");
        let own = if cdsl == RUST { avoider } else { &*cdsl };
        assert!(text.contains(&cdsl));
        text = text.replace(&cdsl, &format!("{own} config \"{}\";", file.display()));
    }
    text = text.replace("middleware iceoryx2;", middleware);
    site.write_ddsl(&text);
    let up = site.run(rcdeploy(&site, environment, &["up", "--build", "--detach"]));
    assert_eq!(up.code, 0, "{up:?}");
    site.await_end_of("monitor");
    let errors = &site.ask("avoider", "status")["compute"]["errors"];
    assert_eq!(errors, 0, "{}", site.log("avoider"));
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    let trace = std::fs::read_to_string(trace).expect("a trace");
    assert_eq!(trace.lines().count(), poses);
    assert_ne!(trace.lines().next(), trace.lines().last(), "it never moved");
    trace
}

/// Both avoiders compute with 32 bits in the same order, so their traces have no tolerance.
#[test]
fn the_avoider_in_python_does_what_that_in_rust_does() {
    let Some(environment) = environment("the_avoider_in_python_does_what_that_in_rust_does") else {
        return;
    };
    crate::built();
    let iceoryx2 = "middleware iceoryx2;";
    let rust = trace("trace_rust", environment, RUST, 1000, iceoryx2);
    let python = trace("trace_python", environment, PYTHON, 1000, iceoryx2);
    let parted = rust.lines().zip(python.lines()).find(|(a, b)| a != b);
    assert_eq!(parted, None, "the first pose that differs");
    for middleware in ["dds", "ros2"] {
        let in_domain = format!("middleware {middleware} {{ domain 176; }};");
        let name = format!("trace_{middleware}");
        let over = trace(&name, environment, PYTHON, 200, &in_domain);
        let parted = rust.lines().zip(over.lines()).find(|(a, b)| a != b);
        assert_eq!(
            parted, None,
            "the first pose that differs over {middleware}"
        );
    }
}

/// An rcdeploy in the foreground. Dropping it ends it.
struct Up(Child);

impl Drop for Up {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_killed_worker_in_python_is_restarted_and_ctrl_c_ends_it() {
    let Some(environment) =
        environment("a_killed_worker_in_python_is_restarted_and_ctrl_c_ends_it")
    else {
        return;
    };
    crate::built();
    let site = Site::new("python_killed");
    let policy = format!("{PYTHON} restart on_failure backoff 100ms;");
    site.write_ddsl(&PATROL.replace(RUST, &policy));
    let mut command = rcdeploy(&site, environment, &["up", "--build"]);
    let log = std::fs::File::create(site.path("up.log")).expect("a log");
    command.stdout(Stdio::null()).stderr(log);
    let mut up = Up(command.spawn().expect("rcdeploy"));
    let pid = || {
        let args = ["status", "--format", "json", &site.network];
        let ran = site.rcdeploy(&args, false);
        let status: serde_json::Value = serde_json::from_str(&ran.stdout).ok()?;
        let components = status["components"].as_array()?.clone();
        let mut of = components.iter().filter(|c| c["name"] == "avoider");
        let avoider = of.next().filter(|c| c["state"] == "running")?;
        Pid::from_raw(avoider["pid"].as_i64()? as i32)
    };
    Site::until("the network is up", || pid().is_some());
    crate::await_well(&site, "avoider");
    let process = pid().expect("a process").as_raw_pid();
    let program = std::fs::read_link(format!("/proc/{process}/exe")).expect("its program");
    assert!(program.to_string_lossy().contains("python"), "{program:?}");
    for _ in 0..2 {
        let first = pid().expect("a process");
        kill_process(first, Signal::KILL).expect("to kill it");
        Site::until("it is back", || pid().is_some_and(|pid| pid != first));
        crate::await_well(&site, "avoider");
    }
    kill_process(Pid::from_child(&up.0), Signal::INT).expect("to stop it");
    let ended = up.0.wait().expect("a child");
    let said = std::fs::read_to_string(site.path("up.log")).expect("its log");
    assert_eq!(ended.code(), Some(0), "{said}");
    assert!(!site.log("avoider").contains("KeyboardInterrupt"), "{said}");
    site.assert_nothing_left();
}
