//! The command line of ROS 2 reaches the backend, the parameters and the log. Unknown arguments are
//! reported.

use rc_middleware::typed::{HandlerError, Operation};
use rc_middleware::{
    Backend, Client, Endpoint, Environment, Linked, OpenError, Publisher, Qos, Reliability, Server,
    Settings, Subscriber,
};
use rc_runtime::{
    Component, Core, Description, Member, Ports, Role, Sample, Slot, StartError, Values,
    WorkerError, embed,
};
use rc_vocabulary::Value;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::time::Duration;

const fn operation(name: &'static str, id: i32) -> Operation {
    Operation {
        name,
        id,
        type_hash: 1,
        two_way: false,
        replies: &[],
    }
}

const SCAN: Operation = operation("newScan", 1);
const STATE: Operation = operation("newState", 2);

const WANTED: Qos = Qos {
    deadline: Some(Duration::from_millis(100)),
    ..Qos::SUBSCRIBER
};

const fn topic(name: &'static str, role: Role, operations: &'static [Operation], qos: Qos) -> Slot {
    Slot {
        name,
        role,
        interface: name,
        type_name: "Test::Topic",
        type_hash: 1,
        backend: "ros2",
        qos,
        operations,
        is_array: false,
        external_types: &[],
    }
}

static NODE: Description = Description {
    name: "lidar",
    model_hash: 1,
    middleware: "ros2",
    period: Duration::from_millis(2),
    parameters: Some(
        r#"{"name":"lidar","parameters":[
        {"name":"rate","kind":{"scalar":{"type":"float"}},"default":{"float":1.0},
         "range":{"min":{"float":0.0},"max":{"float":10.0}}},
        {"name":"device","kind":{"scalar":{"type":"string"}},"default":{"text":"a"},"restart":true}]}"#,
    ),
    folder: "/nowhere",
    slots: &[
        topic("LaserPub", Role::Publishes, &[SCAN, STATE], Qos::PUBLISHER),
        topic("base", Role::SubscribesTo, &[STATE], WANTED),
    ],
    backends: &[Linked {
        connect,
        ..rc_ros2::LINKED
    }],
    types: &[],
    simulates_time: false,
    converter: None,
    managed: false,
    note: b"",
};

static OTHER: Description = Description {
    name: "lidar",
    model_hash: 1,
    middleware: "local",
    period: Duration::from_millis(2),
    parameters: None,
    folder: "/nowhere",
    slots: &[],
    backends: &[rc_local::LINKED],
    types: &[],
    simulates_time: false,
    converter: None,
    managed: false,
    note: b"",
};

/// The settings of the backend and the parameters of the worker, by network.
static SEEN: Mutex<BTreeMap<String, Settings>> = Mutex::new(BTreeMap::new());
static PARAMETERS: Mutex<BTreeMap<String, (f64, String)>> = Mutex::new(BTreeMap::new());

/// The quality of service of every opened endpoint, by address.
static ENDPOINTS: Mutex<BTreeMap<String, Qos>> = Mutex::new(BTreeMap::new());

fn connect(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    let (network, settings) = (environment.network.clone(), environment.settings.clone());
    SEEN.lock().expect("the settings").insert(network, settings);
    Ok(Box::new(Watched {
        backend: rc_local::connect(environment)?,
    }))
}

/// A backend that records the quality of service of its endpoints.
struct Watched {
    backend: Box<dyn Backend>,
}

impl Watched {
    fn note(endpoint: &Endpoint) {
        let mut endpoints = ENDPOINTS.lock().expect("the endpoints");
        endpoints.insert(endpoint.address.to_string(), endpoint.qos);
    }
}

impl Backend for Watched {
    fn name(&self) -> &'static str {
        "ros2"
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        Self::note(endpoint);
        self.backend.publisher(endpoint)
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        Self::note(endpoint);
        self.backend.subscriber(endpoint)
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        self.backend.client(endpoint)
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        self.backend.server(endpoint)
    }

    fn linger(&self, limit: Duration) {
        self.backend.linger(limit);
    }
}

struct Worker(Core);

impl Worker {
    fn start(core: Core, ports: &Ports, values: &Values) -> Result<Self, StartError> {
        for operation in 0..2 {
            drop(ports.publisher(0, operation)?);
        }
        let seen = (values.float("rate"), values.text("device"));
        let mut all = PARAMETERS.lock().expect("the parameters");
        all.insert(core.network().to_owned(), seen);
        drop(all);
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

    fn receive(
        &mut self,
        _: usize,
        _: Option<&Member>,
        _: usize,
        _: Sample<'_>,
    ) -> Result<(), HandlerError> {
        Ok(())
    }
}

#[test]
fn names_and_parameters_are_applied() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("config.toml");
    let text = "[middleware.ros2]\nnode = \"x\"\nremap = [\"/a:=/b\"]\n[parameters]\nrate = 2.0\n";
    std::fs::write(&file, text).expect("to write");
    let network = format!("ros_arguments_{}", std::process::id());
    let (file, own) = (file.to_string_lossy(), ["--network", &network]);
    let ros = "--ros-args -r /a:=/c --remap __node:=front -r __ns:=/robot -p rate:=3 --param device:=12 --log-level WARN --";
    let mut args: Vec<&str> = own.to_vec();
    args.extend(ros.split(' '));
    args.extend(["--config", &file, "--ros-args", "-r", "/d:=~/e"]);
    let component = embed(&NODE, Worker::start, &args).expect("a component");
    component.stop();
    component.join().expect("a good end");
    let settings = SEEN.lock().expect("the settings").remove(&network);
    let settings = settings.expect("the settings of this network");
    assert_eq!(settings.text("ros2", "node"), Some("front"));
    assert_eq!(settings.text("ros2", "namespace"), Some("/robot"));
    let Some(Value::Remappings(rules)) = settings.value("ros2", "remap") else {
        panic!("no rules in {settings:?}");
    };
    let rules: Vec<String> = rules.iter().map(ToString::to_string).collect();
    let default = format!("/{network}/*:=/robot/*");
    assert_eq!(rules, [&default, "/a:=/c", "/d:=~/e", "/a:=/b"]);
    let parameters = PARAMETERS.lock().expect("the parameters").remove(&network);
    assert_eq!(parameters, Some((3.0, "12".to_owned())));
}

#[test]
fn qos_overrides_are_applied() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("config.toml");
    let text = "[middleware.ros2.remap]\n\"LaserPub/newScan\" = \"scan\"\n\
                [middleware.ros2.qos.LaserPub]\nreliability = \"best_effort\"\ndepth = 5\n\
                [middleware.ros2.qos.base]\ndeadline = \"none\"\nliveliness = \"2s\"\n\
                [middleware.ros2.qos.bas]\ndepth = 1\n";
    std::fs::write(&file, text).expect("to write");
    let network = format!("ros_quality_{}", std::process::id());
    let file = file.to_string_lossy();
    let mut args = vec!["--network", &network, "--config", &file, "--ros-args"];
    let ros = "-r __ns:=/robot -p qos_overrides./robot/scan.publisher.depth:=7 \
               -p qos_overrides./robot/scan.publisher.deadline:=50000000 \
               -p qos_overrides./robot/scan.publisher.history:=keep_last \
               -p qos_overrides./robot/scan.subscription.durability:=transient_local \
               -p qos_overrides./robot/other.publisher.depth:=9";
    args.extend(ros.split_whitespace());
    let component = embed(&NODE, Worker::start, &args).expect("a component");
    component.stop();
    component.join().expect("a good end");
    let endpoints = ENDPOINTS.lock().expect("the endpoints");
    let of = |own: &str| endpoints[&format!("{network}/{own}")];
    let usual = Qos {
        reliability: Reliability::BestEffort,
        depth: 5,
        ..Qos::PUBLISHER
    };
    let scan = Qos {
        depth: 7,
        deadline: Some(Duration::from_millis(50)),
        ..usual
    };
    assert_eq!(of("LaserPub/newScan"), scan);
    assert_eq!(of("LaserPub/newState"), usual);
    let base = Qos {
        deadline: None,
        liveliness: Some(Duration::from_secs(2)),
        ..WANTED
    };
    assert_eq!(of("base/newState"), base);
}

#[test]
fn unknown_arguments_are_reported() {
    let network = format!("ros_arguments_wrong_{}", std::process::id());
    let refusal = |description, text: &str| {
        let mut args = vec!["--network", network.as_str(), "--ros-args"];
        args.extend(text.split(' '));
        embed(description, Worker::start, &args).expect_err(text)
    };
    for (text, said) in [
        ("-r a=b", "a rule FROM:=TO"),
        ("-r __ns:=robot", "a namespace of ROS 2"),
        ("-r __node:=a/b", "the name of a node"),
        ("-r", "-r takes a value"),
        ("-p rate=3", "-p takes NAME:=VALUE"),
        ("--enclave x", "an absolute name"),
        ("--log-level loud", "debug, info, warn, error and fatal"),
        ("--log-level :=debug", "LEVEL or NODE:=LEVEL"),
        ("--log-config-file x", "--disable-rosout-logs"),
        (
            "-p qos_overrides.scan.publisher.depth:=1",
            "with the topic in full",
        ),
        ("-p qos_overrides./scan.depth:=1", "TOPIC.publisher.POLICY"),
        (
            "-p qos_overrides./scan.publisher.dept:=1",
            "did you mean `depth`?",
        ),
        (
            "-p qos_overrides./scan.publisher.depth:=0",
            "from 1 to 1000",
        ),
        (
            "-p qos_overrides./scan.publisher.history:=keep_all",
            "history is keep_last",
        ),
        (
            "-p qos_overrides./scan.publisher.deadline:=1ms",
            "takes nanoseconds",
        ),
    ] {
        let error = refusal(&NODE, text);
        assert!(matches!(error, StartError::Usage(_)), "{text}: {error}");
        assert!(error.to_string().contains(said), "{text}: {error}");
    }
    for (text, said) in [
        ("-p rat:=3", "did you mean `rate`?"),
        ("-p rate:=30", "from 0 to 10"),
        ("-p rate:=fast", "from 0 to 10"),
        (
            "--params-file /nowhere/x.yaml",
            "/nowhere/x.yaml cannot be read",
        ),
        ("-p use_sim_time:=maybe", "`use_sim_time`"),
    ] {
        let error = refusal(&NODE, text);
        assert!(
            matches!(error, StartError::Configuration(_)),
            "{text}: {error}"
        );
        assert!(error.to_string().contains(said), "{text}: {error}");
    }
    let error = refusal(&OTHER, "-r /a:=/b");
    assert!(
        error.to_string().contains("components that use ros2"),
        "{error}"
    );
}

/// A node with a parameter that has no default.
static ARM: Description = Description {
    name: "arm",
    parameters: Some(
        r#"{"name":"arm","parameters":[
        {"name":"rate","kind":{"scalar":{"type":"float"}}},
        {"name":"device","kind":{"scalar":{"type":"string"}},"default":{"text":"a"}}]}"#,
    ),
    ..NODE
};

/// Starts `ARM` with a file of parameters and further arguments of ROS 2. Returns its parameters
/// and its settings.
fn started(test: &str, yaml: &str, more: &str) -> ((f64, String), Settings) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("params.yaml");
    std::fs::write(&file, yaml).expect("to write");
    let network = format!("ros_params_{test}_{}", std::process::id());
    let file = file.to_string_lossy();
    let mut args = vec!["--network", &network, "--ros-args", "--params-file", &file];
    args.extend(more.split_whitespace());
    let component = embed(&ARM, Worker::start, &args).expect("a component");
    component.stop();
    component.join().expect("a good end");
    let parameters = PARAMETERS.lock().expect("the parameters").remove(&network);
    let settings = SEEN.lock().expect("the settings").remove(&network);
    (parameters.expect("a worker"), settings.expect("a backend"))
}

/// As a launch file writes it: for all nodes, for others, for this one, and some that it has not.
#[test]
fn a_file_of_parameters_is_read() {
    let yaml = "\
/**:
  ros__parameters: {rate: 1, unknown: 7, device: all, use_sim_time: true}
/robot:
  front:
    ros__parameters: {rate: 2.5}
  rear:
    ros__parameters: {rate: 9.0}
";
    let names = "-r __ns:=/robot -r __node:=front";
    let ((rate, device), settings) = started("names", yaml, names);
    assert_eq!((rate, device.as_str()), (2.5, "all"));
    assert_eq!(settings.bool("ros2", "use_sim_time"), Some(true));
    // The last value counts, and rules for other nodes do not.
    let more = "-r __ns:=/robot -p rate:=4 -p rear:rate:=5 -p arm:device:=7 -r rear:__node:=x --log-level rear:=debug";
    let ((rate, device), settings) = started("order", yaml, more);
    assert_eq!((rate, device.as_str()), (4.0, "7"));
    assert_eq!(settings.text("ros2", "node"), None);
}

/// Arguments that launch files pass, and that change nothing or a setting.
#[test]
fn arguments_of_launch_files_are_taken() {
    let more = "--enclave /robot/arm --disable-external-lib-logs --disable-rosout-logs --enable-stdout-logs \
                -p start_type_description_service:=true --log-level arm:=warn --log-level rcl:=debug";
    let (_, settings) = started(
        "launch",
        "arm: {ros__parameters: {rate: 1}}\n",
        &format!("{more} -r __ns:=/"),
    );
    assert_eq!(settings.bool("ros2", "rosout"), Some(false));
}
