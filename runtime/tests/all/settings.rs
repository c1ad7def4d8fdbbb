//! Middleware settings of the configuration and the command line reach the backend.

use crate::time::slot;
use rc_middleware::{Backend, Environment, Linked, OpenError, Qos, Settings};
use rc_runtime::{
    Component, Core, Description, Ports, Role, Slot, StartError, Values, WorkerError, embed,
};
use std::sync::Mutex;
use std::time::Duration;

static DESCRIPTION: Description = Description {
    name: "set",
    model_hash: 1,
    middleware: "recorder",
    period: Duration::from_millis(2),
    parameters: None,
    folder: "/nowhere",
    slots: &[
        Slot {
            backend: "recorder",
            ..slot("In", Role::SubscribesTo, Qos::SUBSCRIBER)
        },
        Slot {
            backend: "recorder",
            ..slot("Out", Role::Publishes, Qos::PUBLISHER)
        },
    ],
    backends: &[Linked::new("recorder", connect)],
    types: &[],
    simulates_time: false,
    managed: false,
    converter: None,
    note: b"",
};

static SEEN: Mutex<Option<Settings>> = Mutex::new(None);

fn connect(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    *SEEN.lock().expect("the settings") = Some(environment.settings.clone());
    rc_local::connect(environment)
}

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
}

#[test]
fn the_command_line_overrides_the_configuration() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("config.toml");
    let text = "[middleware.dds]\ndomain = 3\nlease = \"0.5s\"\npeers = [\"a\"]\n";
    std::fs::write(&file, text).expect("to write");
    let network = format!("settings_{}", std::process::id());
    let args = [
        "--network",
        &network,
        "--config",
        &file.to_string_lossy(),
        "--set-middleware",
        "dds.domain=5",
        "--set-middleware",
        "dds.peers=b:7,c",
        "--reliable",
        "In",
    ];
    let component = embed(&DESCRIPTION, Worker::start, &args).expect("a component");
    component.stop();
    component.join().expect("a good end");
    let settings = SEEN.lock().expect("the settings").take();
    let settings = settings.expect("the settings of the backend");
    assert_eq!(settings.int("dds", "domain"), Some(5));
    let lease = settings.duration("dds", "lease");
    assert_eq!(lease, Some(Duration::from_millis(500)));
    assert_eq!(settings.texts("dds", "peers"), ["b:7", "c"]);
    assert!(settings.texts("dds", "interfaces").is_empty());
    assert_eq!(settings.value("iceoryx2", "domain"), None);
    let rules = settings.value("recorder", "qos").map(ToString::to_string);
    assert_eq!(rules.as_deref(), Some("In.reliability:=reliable"));
}

#[test]
fn an_invalid_setting_is_reported_with_the_allowed_values() {
    let message = |text: &str| {
        let network = format!("settings_wrong_{}", std::process::id());
        let args = ["--network", &network, "--set-middleware", text];
        let error = embed(&DESCRIPTION, Worker::start, &args).expect_err(text);
        assert!(matches!(error, StartError::Usage(_)), "{error}");
        error.to_string()
    };
    for (text, said) in [
        ("dds.domain", "takes MIDDLEWARE.KEY=VALUE"),
        ("ddds.domain=1", "did you mean `dds`?"),
        ("dds.domian=1", "did you mean `domain`?"),
        ("iceoryx2.x=1", "there are no settings of iceoryx2 yet"),
        ("dds.domain=233", "an integer from 0 to 232"),
        ("dds.lease=10ms", "at least 100ms"),
        (
            "dds.peers=a b",
            "a list with commas, each the name or the address",
        ),
    ] {
        let message = message(text);
        assert!(message.contains(said), "{text}: {message}");
    }
    for (slots, said) in [
        (
            "In,Out",
            "--reliable takes slots that subscribe, and `Out` does not",
        ),
        ("Inn", "did you mean `In`?"),
    ] {
        let error = embed(&DESCRIPTION, Worker::start, &["--reliable", slots]);
        let error = error.expect_err(slots).to_string();
        assert!(error.contains(said), "{slots}: {error}");
    }
}
