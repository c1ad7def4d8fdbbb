//! The command line of ROS 2 reaches the backend, the parameters and the log, and says what it does not know.

use rc_middleware::typed::{HandlerError, Request};
use rc_middleware::{Backend, Environment, OpenError, Reader, Settings};
use rc_runtime::{Component, Core, Description, Ports, StartError, Values, WorkerError, embed};
use std::sync::Mutex;
use std::time::Duration;

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
    slots: &[],
    backends: &[("ros2", connect)],
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
    backends: &[("local", rc_local::connect)],
    note: b"",
};

static SEEN: Mutex<Option<Settings>> = Mutex::new(None);
static PARAMETERS: Mutex<Option<(f64, String)>> = Mutex::new(None);

fn connect(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    *SEEN.lock().expect("the settings") = Some(environment.settings.clone());
    rc_local::connect(environment)
}

struct Worker(Core);

impl Worker {
    #[expect(clippy::unnecessary_wraps, reason = "the runtime wants it so")]
    fn start(core: Core, _: &Ports, values: &Values) -> Result<Self, StartError> {
        let seen = (values.float("rate"), values.text("device"));
        *PARAMETERS.lock().expect("the parameters") = Some(seen);
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

    fn emergency(&mut self) {}

    fn restore(&mut self) {}

    fn finalize(&mut self) {}

    fn sending_peers(&self, _: &mut [usize]) {}

    fn serve(&mut self, _: usize, request: &mut Request<'_>) -> Result<(), HandlerError> {
        request.unknown()
    }

    fn receive(&mut self, _: usize, _: usize, _: &mut Reader<'_>) -> Result<(), HandlerError> {
        Ok(())
    }
}

#[test]
fn names_and_parameters_are_taken() {
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
    let settings = SEEN.lock().expect("the settings").take();
    let settings = settings.expect("a backend that was asked");
    assert_eq!(settings.values("ros2", "node"), ["front"]);
    assert_eq!(settings.values("ros2", "namespace"), ["/robot"]);
    let rules = ["/a:=/c", "/d:=~/e", "/a:=/b"];
    assert_eq!(settings.values("ros2", "remap"), rules);
    let parameters = PARAMETERS.lock().expect("the parameters").take();
    assert_eq!(parameters, Some((3.0, "12".to_owned())));
}

#[test]
fn what_is_not_known_is_told() {
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
        ("--params-file x.yaml", "--config FILE"),
        ("--enclave /x", "no security here"),
        ("--log-level loud", "debug, info, warn, error and fatal"),
        ("--disable-rosout-logs", "is not known here"),
    ] {
        let error = refusal(&NODE, text);
        assert!(matches!(error, StartError::Usage(_)), "{text}: {error}");
        assert!(error.to_string().contains(said), "{text}: {error}");
    }
    for (text, said) in [
        ("-p rat:=3", "did you mean `rate`?"),
        ("-p rate:=30", "from 0 to 10"),
        ("-p rate:=fast", "from 0 to 10"),
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
