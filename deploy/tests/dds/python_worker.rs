//! Components in Python, built and started as a user does it. The avoider in Python does what the
//! one in Rust does, over every middleware. The detector finds what the camera draws.

use rc_test_site::site::{PATROL, Site};
use rc_test_support::python;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;

/// Package that the Python runtime needs, as in the tests of `rc-python`.
const NUMPY: &str = "numpy==2.3.4";
/// The packages of the detector. This `OpenCV` accepts the `NumPy` of the other tests.
const OPENCV: &str = include_str!("../../../components/line_camera_detector/tests/packages.txt");
pub(crate) const RUST: &str = "cdsl \"../avoider/avoider.cdsl\";";
const PYTHON: &str = "cdsl \"../avoider_python/avoider_python.cdsl\";";

/// The virtual environment of the components. `None` without Python 3.11 or `NumPy`: `test` is
/// listed as skipped.
fn environment(test: &str) -> Option<&'static Path> {
    let python = python::packages("python-numpy", NUMPY, test)?;
    python.ancestors().nth(2)
}

/// `rcdeploy` in a virtual environment.
fn tool(site: &Site, environment: &Path) -> Command {
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    command.env("CARGO_NET_OFFLINE", "true");
    command.env("VIRTUAL_ENV", environment);
    command.env("ROS_LOCALHOST_ONLY", "1");
    command
}

/// `rcdeploy ARGS… FILE` in a virtual environment.
fn rcdeploy(site: &Site, environment: &Path, args: &[&str]) -> Command {
    let mut command = tool(site, environment);
    command.args(args).args(["--profile", "dev"]);
    command.arg(site.ddsl());
    command
}

/// Builds the programs of the patrol, so that no wait of a test is for the compiler.
fn built(environment: &Path) {
    static BUILT: OnceLock<()> = OnceLock::new();
    BUILT.get_or_init(|| {
        crate::built();
        let site = Site::new("python_build");
        site.write_ddsl(&PATROL.replace(RUST, PYTHON));
        let up = site.run(rcdeploy(&site, environment, &["up", "--build", "--detach"]));
        assert_eq!(up.code, 0, "{up:?}");
        assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
        site.assert_nothing_left();
    });
}

/// The trace of the monitor after so many poses in lockstep: the same on every machine. `avoider`
/// names its component, and `rcdeploy` finds what builds it.
pub(crate) fn trace(
    name: &str,
    rcdeploy: &dyn Fn(&Site) -> Command,
    avoider: &str,
    poses: usize,
    middleware: &str,
) -> String {
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
    let mut up = rcdeploy(&site);
    up.args(["up", "--build", "--detach", "--profile", "dev"])
        .arg(site.ddsl());
    let up = site.run(up);
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
    built(environment);
    let iceoryx2 = "middleware iceoryx2;";
    let rcdeploy = |site: &Site| tool(site, environment);
    let rust = trace("trace_rust", &rcdeploy, RUST, 1000, iceoryx2);
    let python = trace("trace_python", &rcdeploy, PYTHON, 1000, iceoryx2);
    let parted = rust.lines().zip(python.lines()).find(|(a, b)| a != b);
    assert_eq!(parted, None, "the first pose that differs");
    for middleware in ["dds", "ros2"] {
        let in_domain = format!("middleware {middleware} {{ domain 176; }};");
        let name = format!("trace_{middleware}");
        let over = trace(&name, &rcdeploy, PYTHON, 200, &in_domain);
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
    built(environment);
    let site = Site::new("python_killed");
    let policy = format!("{PYTHON} restart on_failure backoff 100ms;");
    site.write_ddsl(&PATROL.replace(RUST, &policy));
    let mut command = rcdeploy(&site, environment, &["up"]);
    let log = std::fs::File::create(site.path("up.log")).expect("a log");
    command.stdout(Stdio::null()).stderr(log);
    let mut up = Up(command.spawn().expect("rcdeploy"));
    let pid = || {
        let args = ["status", "--format", "json", &site.network];
        let ran = site.rcdeploy(&args, false);
        let status: Value = serde_json::from_str(&ran.stdout).ok()?;
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

const DETECT: &str = include_str!("../../../components/networks/detect.ddsl");
const DETECT_CAMERA: &str = include_str!("../../../components/networks/detect_camera.toml");

/// Where the camera of `detect.ddsl` draws disc `disc` of a picture, in pixels.
fn drawn(picture: f64, disc: f64) -> [f64; 2] {
    let (sin, cos) = ((picture / 300.0 + disc / 4.0) * std::f64::consts::TAU).sin_cos();
    [640.0 * (0.5 + 0.25 * cos), 480.0 * (0.5 + 0.25 * sin)]
}

#[test]
fn a_detector_in_python_finds_what_the_camera_draws() {
    let test = "a_detector_in_python_finds_what_the_camera_draws";
    let Some(python) = python::packages("python-opencv", OPENCV, test) else {
        return;
    };
    let environment = python.ancestors().nth(2).expect("an environment");
    built(environment);
    let site = Site::new("python_detect");
    site.write("detect_camera.toml", DETECT_CAMERA);
    site.write_ddsl(&DETECT.replace("Deployment detect", "Deployment patrol"));
    let up = rcdeploy(&site, environment, &["up", "--build", "--detach"]);
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
    let topic = "detector.ColoredObjectsPub.newObjects";
    let options = ["--format", "json", "--count", "10", "--timeout", "30"];
    let echoed = site.rcdeploy(
        &[&["echo", &site.network, topic], &options[..]].concat(),
        false,
    );
    assert_eq!(echoed.code, 0, "{echoed:?}\n{}", site.log("detector"));
    let lines: Vec<Value> = echoed
        .stdout
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert_eq!(lines.len(), 10, "{echoed:?}");
    for line in &lines {
        let found = &line["value"]["found"];
        let objects = found["objects"].as_array();
        let objects = objects.unwrap_or_else(|| panic!("no list: {line}"));
        let place = |color: &str| {
            let mut of = objects.iter().filter(|object| object["color"] == color);
            let object = of.next().unwrap_or_else(|| panic!("no {color}: {line}"));
            ["x", "y"].map(|axis| object[axis].as_f64().expect("a number"))
        };
        assert_eq!(objects.len(), 4, "{line}");
        let number = found["number"].as_f64().expect("a number");
        for (disc, color) in ["Red", "Green", "Blue", "Yellow"].into_iter().enumerate() {
            let (place, drawn) = (place(color), drawn(number, disc as f64));
            let differs = place.iter().zip(drawn).any(|(a, b)| (a - b).abs() > 1.0);
            assert!(!differs, "{color}: {place:?} is not {drawn:?}");
        }
    }
    assert_eq!(site.ask("detector", "status")["slots"][0]["lost"], 0);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
