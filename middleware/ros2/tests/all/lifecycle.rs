//! A managed component is a managed node for rclpy of ROS 2 Jazzy.

use rc_runtime::lifecycle::{Hook, Transition};
use rc_runtime::{Component, Core, Description, Ports, StartError, Values, WorkerError, embed};
use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

static NODE: Description = Description {
    name: "managed",
    model_hash: 1,
    middleware: "ros2",
    period: Duration::from_millis(2),
    parameters: None,
    folder: "/nowhere",
    slots: &[],
    types: &[],
    backends: &[rc_ros2::LINKED],
    simulates_time: false,
    converter: None,
    managed: true,
    note: b"",
};

/// The first `configure` runs until this file exists.
static RELEASE: OnceLock<PathBuf> = OnceLock::new();

struct Worker(Core);

impl Worker {
    #[expect(clippy::unnecessary_wraps, reason = "the runtime expects a `Result`")]
    fn start(core: Core, _: &Ports, _: &Values) -> Result<Self, StartError> {
        Ok(Self(core))
    }
}

impl Component for Worker {
    fn core(&mut self) -> &mut Core {
        &mut self.0
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        Ok(())
    }

    fn run_hook(&mut self, hook: Hook<'_>) -> Result<(), WorkerError> {
        let start = Instant::now();
        while hook == Hook::Transition(Transition::Configure)
            && RELEASE.get().is_some_and(|file| !file.exists())
            && start.elapsed() < Duration::from_secs(50)
        {
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }
}

#[test]
fn rclpy_manages_a_component_as_a_node_of_its_own() {
    let Some(python) =
        rc_test_support::python::ros("rclpy_manages_a_component_as_a_node_of_its_own")
    else {
        return;
    };
    let network = format!("lifecycle_{}", std::process::id());
    let domain = (20 + (1 + std::process::id() * 3) % 80).to_string();
    let set = format!("ros2.domain={domain}");
    let mut args = vec!["--network", &network, "--name", "managed"];
    for setting in [&set, "ros2.interfaces=lo"] {
        args.extend(["--set-middleware", setting]);
    }
    let folder = tempfile::tempdir().expect("a folder");
    let release = folder.path().join("release");
    RELEASE.set(release.clone()).expect("once");
    let component = embed(&NODE, Worker::start, &args).expect("a component");
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rclpy/lifecycle.py");
    let said = std::process::Command::new(python)
        .args(["-B", program, &network])
        .arg(&release)
        .env("ROS_DOMAIN_ID", &domain)
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .env("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
        .output()
        .expect("Python");
    component.stop();
    component.join().expect("a good end");
    let out = String::from_utf8_lossy(&said.stdout);
    let lines: Vec<&str> = out.lines().collect();
    let expected = [
        "at first unconfigured [1]",
        "get_available_states 11 as rclpy",
        "get_transition_graph 25 as rclpy",
        "get_available_transitions 2 as rclpy",
        "activate False unconfigured [1]",
        "meanwhile configuring [10] transition_success transition_failure transition_error no reply yet",
        "configure True inactive [2]",
        "3 True active [3]",
        "1 False active [3]",
        "deactivate True inactive [2]",
        "cleanup True unconfigured [1]",
        "shutdown True finalized [4]",
        "configure False finalized [4]",
        "event configure unconfigured configuring",
        "event transition_success configuring inactive",
        "event activate inactive activating",
        "event transition_success activating active",
        "event deactivate active deactivating",
        "event transition_success deactivating inactive",
        "event cleanup inactive cleaningup",
        "event transition_success cleaningup unconfigured",
        "event shutdown unconfigured shuttingdown",
        "event transition_success shuttingdown finalized",
    ];
    let failed = String::from_utf8_lossy(&said.stderr);
    assert_eq!(lines, expected, "{failed}");
}
