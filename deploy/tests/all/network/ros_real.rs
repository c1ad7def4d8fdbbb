//! What users of ROS 2 do with a component. The first part of each test has packages of `PyPI`. The
//! second one has the programs of an installed ROS 2: `RC_ROS2_SETUP` names the file to source, such
//! as `/opt/ros/jazzy/setup.bash`. It needs the programs `ros2` and `colcon`, and the packages
//! `demo_nodes_cpp` and `example_interfaces`, none of which are wheels of `PyPI`.

use crate::network::dds::{Domain, Over};
use crate::network::ros_python::adding_at;
use rc_test_site::site::{CommandOutput, Site};
use rc_test_support::python::{self, skipped};
use rc_test_support::ros_packages::RosPackages;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

const IDSL: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../components/interop/Interop.idsl"
);

/// An installed ROS 2, and a domain.
struct Ros {
    setup: PathBuf,
    domain: Domain,
}

impl Ros {
    /// `None` without ROS 2: `part` of `test` is listed as skipped.
    fn new(test: &str, domain: Domain, part: &str) -> Option<Self> {
        let Some(setup) = std::env::var_os("RC_ROS2_SETUP") else {
            let reason = format!("{part} only: RC_ROS2_SETUP names no setup file of ROS 2");
            skipped(test, &reason);
            return None;
        };
        let setup = setup.into();
        Some(Self { setup, domain })
    }

    /// A shell with ROS 2 that runs `script` for at most `seconds`.
    fn shell(&self, seconds: u32, script: &str) -> Command {
        let mut command = Command::new("timeout");
        let setup = self.setup.display();
        command
            .args(["--kill-after=5", &seconds.to_string(), "bash", "-c"])
            .arg(format!("source '{setup}' && {script}"))
            .env("ROS_DOMAIN_ID", self.domain.id.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .env("PYTHONUNBUFFERED", "1")
            .env("ROS_LOG_DIR", self.domain.site.path("ros"));
        command
    }

    fn run(&self, script: &str) -> CommandOutput {
        self.domain.site.run(self.shell(60, script))
    }

    /// Runs `script` in the background. A file gets its output.
    fn start(&self, name: &str, script: &str) -> Background {
        let path = self.domain.site.path(name);
        let output = std::fs::File::create(&path).expect("a file");
        let mut command = self.shell(120, &format!("exec {script}"));
        self.domain.site.place(&mut command);
        let child = command
            .stdin(Stdio::null())
            .stdout(output.try_clone().expect("a file"))
            .stderr(output)
            .spawn()
            .expect("a shell");
        Background { child, path }
    }

    /// Waits until a command of ROS 2 succeeds and prints `text`.
    fn says(&self, script: &str, text: &str) {
        let mut last = None;
        for _ in 0..10 {
            let ran = self.run(script);
            if ran.code == 0 && ran.stdout.contains(text) {
                return;
            }
            last = Some(ran);
        }
        panic!("`{script}` does not say `{text}`: {last:?}");
    }
}

/// A program that ends with the test, with all its children.
struct Background {
    child: Child,
    path: PathBuf,
}

impl Background {
    fn has_said(&self, text: &str) -> bool {
        std::fs::read_to_string(&self.path).is_ok_and(|said| said.contains(text))
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        // `timeout` forwards SIGTERM, but cannot forward SIGKILL.
        let pid = rustix::process::Pid::from_child(&self.child);
        let _ = rustix::process::kill_process(pid, rustix::process::Signal::TERM);
        let _ = self.child.wait();
    }
}

#[test]
fn a_component_is_a_node_of_ros() {
    let test = "a_component_is_a_node_of_ros";
    let domain = Domain::over(Over::Ros2, "ros_real", 15);
    let remap = "ros2.remap=Talk/chatter:=/chatter";
    if let Some(python) = python::ros(test) {
        let component = domain.start_local(&["--set-middleware", remap]);
        let said = domain.rclpy(python, "talk.py", &["/chatter"]).end();
        let node = format!("node /{}/interop", domain.site.network);
        assert_eq!(said, [&*node, "heard Hello World"], "{}", component.log());
    }
    let part = "`ros2 node|topic|service`, services of example_interfaces, nodes of demo_nodes_cpp";
    let Some(ros) = Ros::new(test, domain, part) else {
        return;
    };
    let network = ros.domain.site.network.clone();
    let _component = ros.domain.start(&[remap]);
    ros.says("ros2 node list", &format!("/{network}/interop"));
    let _talker = ros.start("talker", "ros2 run demo_nodes_cpp talker");
    Site::until("the component hears the talker", || {
        ros.domain.slot("Talk")["handlers"]["count"].as_u64() > Some(0)
    });
    let topic = format!("/{network}/Gossip/chatter");
    let listener = format!("ros2 run demo_nodes_cpp listener --ros-args -r chatter:={topic}");
    let listener = ros.start("listener", &listener);
    Site::until("the listener hears the component", || {
        listener.has_said("I heard: [Hello World")
    });
    ros.says(
        &format!("ros2 topic echo --once {topic} std_msgs/msg/String"),
        "data: 'Hello World",
    );
    let service = format!("/{network}/Interop/add");
    ros.says(
        &format!("ros2 service call {service} example_interfaces/srv/AddTwoInts '{{a: 40, b: 2}}'"),
        "sum=42",
    );
    // In the other direction.
    let _server = ros.start("server", "ros2 run demo_nodes_cpp add_two_ints_server");
    let mut client = adding_at(&ros.domain, "/add_two_ints");
    for number in 0..10 {
        assert_eq!(client.add(number, 1).expect("a sum"), number + 1);
    }
}

/// `ros2 param` reads and sets the parameters of a component. `/parameter_events` has changes by
/// others.
#[test]
fn parameters_are_those_of_a_node_of_ros() {
    let test = "parameters_are_those_of_a_node_of_ros";
    let domain = Domain::over(Over::Ros2, "ros_real", 18);
    if let Some(python) = python::ros(test) {
        let component = domain.start_local(&[]);
        let events = domain.rclpy(python, "parameter_events.py", &[]);
        // A secret has no name in ROS.
        let names = "names arm.joints count images.bytes images.count speed";
        assert_eq!(events.line(), names, "{}", component.log());
        // The event is published once, and discovery of the subscriber takes a moment.
        Site::until("a change by rcdeploy is published", || {
            set_speed(&domain, "4.25");
            set_speed(&domain, "4.75");
            events.has_said("speed 4.75")
        });
    }
    let Some(ros) = Ros::new(test, domain, "`ros2 param` and `ros2 topic echo`") else {
        return;
    };
    let network = ros.domain.site.network.clone();
    let _component = ros.domain.start(&[]);
    let param = |verb: &str, rest: &str| format!("ros2 param {verb} /{network}/interop {rest}");
    ros.says(&param("list", ""), "arm.joints");
    let listed = ros.run(&param("list", ""));
    assert!(!listed.stdout.contains("token"), "{listed:?}");
    for (name, value) in [
        ("speed", "Double value is: 1.0"),
        ("count", "Integer value is: 7"),
        ("arm.joints", "String values are: ['a', 'b']"),
    ] {
        ros.says(&param("get", name), value);
    }
    ros.says(&param("describe", "speed"), "Max value: 10.0");
    ros.says(&param("set", "speed 2.5"), "Set parameter successful");
    ros.says(&param("get", "speed"), "Double value is: 2.5");
    for (wanted, why) in [
        ("speed 11.0", "from 0 to 10"),
        ("count 8", "fixed when the component starts"),
    ] {
        let refused = ros.run(&param("set", wanted));
        let said = format!("{}{}", refused.stdout, refused.stderr);
        assert!(
            said.contains("Setting parameter failed") && said.contains(why),
            "{refused:?}"
        );
    }
    let echo = "ros2 topic echo /parameter_events rcl_interfaces/msg/ParameterEvent";
    let echo = ros.start("events", echo);
    Site::until("a change by rcdeploy is published", || {
        set_speed(&ros.domain, "4.25");
        set_speed(&ros.domain, "4.75");
        echo.has_said("double_value: 4.75")
    });
}

/// Changes a parameter of the component with rcdeploy.
fn set_speed(domain: &Domain, value: &str) {
    let change = format!("speed={value}");
    let set = ["params", "set", &domain.site.network, "interop", &change];
    let ran = domain.site.rcdeploy(&set, false);
    assert_eq!(ran.code, 0, "{ran:?}");
}

/// An IDSL with each kind of file that becomes one of ROS 2.
const SMALL: &str = "module Small {\n    exception Nonsense { string what; };\n    \
    struct Way { double length; sequence<int> turns; };\n    \
    interface Guide { Way shift(Way at, double by) throws Nonsense; };\n};\n";

/// Prints a message as bytes, and both halves of a service.
const USE_SMALL: &str = "from rclpy.serialization import deserialize_message, serialize_message\n\
    from robocomp_small_msgs.msg import Way\n\
    from robocomp_small_msgs.srv import GuideShift\n\
    way = Way(length=1.0, turns=[2])\n\
    data = serialize_message(way)\n\
    print(data.hex(), deserialize_message(data, Way) == way)\n\
    print(GuideShift.Request(at=way, by=3.0).by, GuideShift.Response().nonsense.what == '')\n";

/// cmake builds the package that `rcgen export` writes, and rclpy has its types.
#[test]
fn an_exported_package_is_one_of_ros() {
    let test = "an_exported_package_is_one_of_ros";
    let domain = Domain::over(Over::Ros2, "ros_real", 16);
    if let Some(tools) = RosPackages::new(test) {
        let idsl = domain.site.write("Small.idsl", SMALL);
        let (source, built) = (domain.site.path("small"), domain.site.path("built"));
        export(&idsl, &source);
        tools.build(&source.join("robocomp_small_msgs"), &built);
        let data = "00010000000000000000f03f0100000002000000";
        let ran = tools.python(&built).args(["-B", "-c", USE_SMALL]).output();
        let ran = ran.expect("to run");
        assert!(ran.status.success(), "{ran:?}");
        let said = String::from_utf8_lossy(&ran.stdout);
        assert_eq!(said, format!("{data} True\n3.0 True\n"));
    }
    let part = "`colcon build` and `ros2 interface show`";
    let Some(ros) = Ros::new(test, domain, part) else {
        return;
    };
    let place = ros.domain.site.path("workspace");
    export(Path::new(IDSL), &place.join("src"));
    let script = |what: &str| format!("cd '{}' && {what}", place.display());
    let built = ros.shell(580, &script("colcon build"));
    let built = ros.domain.site.run(built);
    assert_eq!(built.code, 0, "{built:?}");
    let show = |what: &str| {
        ros.run(&script(&format!(
            "source install/setup.bash && ros2 interface show interop_msgs/{what}"
        )))
    };
    let report = show("msg/Report");
    assert!(report.stdout.contains("float64[] ranges"), "{report:?}");
    let shift = show("srv/InteropShift");
    assert!(shift.stdout.contains("int32 NONSENSE=1"), "{shift:?}");
}

/// Runs `rcgen export IDSL --to ros2 --out FOLDER`.
fn export(idsl: &Path, folder: &Path) {
    let mut command = Command::new(Site::executable("rcgen"));
    command
        .arg("export")
        .arg(idsl)
        .args(["--to", "ros2", "--out"]);
    let ran = command.arg(folder).output().expect("to run");
    assert!(ran.status.success(), "{ran:?}");
}
