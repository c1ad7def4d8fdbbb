//! The parameter services of a running component, called as from another node.

use rc_middleware::rpc::{self, ENVELOPE, RequestId};
use rc_middleware::{
    Address, Backend, Cdr, Client, Endpoint, Environment, ExternalType, Header, OpenError, Profile,
    Qos, Reader, RunDirectory, Settings, TypeIdentity, WakeEvent, Writer,
};
use rc_runtime::{
    Component, Core, Description, ParamChange, Ports, StartError, Values, WorkerError, embed,
};
use rc_vocabulary::Value;
use rc_vocabulary::ros::Remapping;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(30);

static NODE: Description = Description {
    name: "tuned",
    model_hash: 1,
    middleware: "ros2",
    period: Duration::from_millis(2),
    parameters: Some(
        r#"{"name":"tuned","parameters":[
        {"name":"speed","doc":["How fast."],"kind":{"scalar":{"type":"float"}},"default":{"float":1.0},
         "range":{"min":{"float":0.0},"max":{"float":10.0}},"editable":true},
        {"name":"token","kind":{"scalar":{"type":"string"}},"default":{"text":"s3cret"},"editable":true,"secret":true},
        {"name":"count","kind":{"scalar":{"type":"int"}},"default":{"int":7},"range":{"min":{"int":1}}},
        {"name":"arm","kind":{"group":[
          {"name":"joints","kind":{"scalar":{"type":"string","array":{"min":0}}},
           "default":{"array":[{"text":"a"},{"text":"b"}]},"editable":true}]}}]}"#,
    ),
    folder: "/nowhere",
    slots: &[],
    backends: &[rc_ros2::LINKED],
    types: &[],
    simulates_time: false,
    converter: None,
    managed: false,
    note: b"",
};

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

    fn parameters_changed(&mut self, changes: &[ParamChange]) -> Result<(), WorkerError> {
        match changes.iter().find_map(|change| change.new.as_float()) {
            Some(4.0) => Err(WorkerError::Failed("the gear is stuck".to_owned())),
            _ => Ok(()),
        }
    }
}

/// Another node, which calls the services.
struct Asker {
    backend: Box<dyn Backend>,
    node: String,
}

impl Asker {
    fn new(network: &str, settings: Settings) -> Result<Self, OpenError> {
        let environment = Environment {
            network: network.to_owned(),
            instance: "asker".to_owned(),
            directory: RunDirectory::open(network).expect("a folder"),
            wake_event: WakeEvent::new().expect("an event"),
            settings,
        };
        let backend = rc_ros2::connect(&environment, &[])?;
        let node = format!("{network}/tuned");
        Ok(Self { backend, node })
    }

    /// A client of a service of the node.
    fn client(&self, name: &str, type_name: &str) -> Box<dyn Client> {
        let type_name = format!("rcl_interfaces/srv/{type_name}");
        let endpoint = Endpoint {
            address: Address::parse(&self.node).expect("an address"),
            types: TypeIdentity {
                name: type_name.clone(),
                hash: 1,
            },
            qos: Qos::CALL,
            external_types: vec![ExternalType {
                slot: "parameters".to_owned(),
                operation: name.to_owned(),
                id: 1,
                type_name,
            }],
        };
        self.backend.client(&endpoint).expect("a client")
    }

    /// Calls a service, and gives the body of its reply.
    fn ask(&self, name: &str, type_name: &str, body: &dyn Fn(&mut Writer)) -> Vec<u8> {
        let mut client = self.client(name, type_name);
        let id = RequestId {
            writer: client.guid(),
            sequence: 1,
        };
        let mut request = Writer::default();
        rpc::begin_request(&mut request, id, 1);
        rpc::begin_body(&mut request, Profile::Bare);
        body(&mut request);
        let mut answer = Vec::new();
        let mut take = |_: Header, bytes: &[u8]| answer = bytes[ENVELOPE..].to_vec();
        client
            .call(Header::default(), &request.into_bytes(), LIMIT, &mut take)
            .expect(name);
        answer
    }

    fn set(&self, name: &str, ty: u8, float: f64) -> (bool, String) {
        let answer = self.ask("set_parameters", "SetParameters", &|writer| {
            writer.put(&1_u32);
            value(writer, name, ty, float);
        });
        let mut reader = Reader::new(&answer);
        assert_eq!(reader.get::<u32>(), Ok(1));
        (get(&mut reader), get(&mut reader))
    }
}

fn get<T: Cdr>(reader: &mut Reader<'_>) -> T {
    reader.get().expect("what ROS says that is there")
}

/// `rcl_interfaces/msg/Parameter`, field by field.
fn value(writer: &mut Writer, name: &str, ty: u8, float: f64) {
    writer.put(&name.to_owned());
    writer.put(&ty);
    writer.put(&false);
    writer.put(&0_i64);
    writer.put(&float);
    writer.put(&String::new());
    writer.put(&Vec::<u8>::new());
    writer.put(&Vec::<bool>::new());
    writer.put(&Vec::<i64>::new());
    writer.put(&Vec::<f64>::new());
    writer.put(&Vec::<String>::new());
}

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// The settings of a node in this domain, alone on this machine.
fn settings(domain: u32) -> Settings {
    let mut settings = Settings::default();
    settings.set("ros2", "domain", Value::Int(domain.into()));
    settings.set("ros2", "interfaces", Value::Texts(vec!["lo".to_owned()]));
    settings
}

#[test]
fn services_reply() {
    let network = format!("rosparam_{}", std::process::id());
    let domain = 20 + std::process::id() * 2 % 80;
    let set = format!("ros2.domain={domain}");
    let args = [
        "--network",
        &network,
        "--set-middleware",
        &set,
        "--set-middleware",
        "ros2.interfaces=lo",
    ];
    let component = embed(&NODE, Worker::start, &args).expect("a component");
    let asker = Asker::new(&network, settings(domain)).expect("another node");

    let answer = asker.ask("list_parameters", "ListParameters", &|writer| {
        writer.put(&Vec::<String>::new());
        writer.put(&0_u64);
    });
    let mut reader = Reader::new(&answer);
    // Secret parameters are left out.
    assert_eq!(
        get::<Vec<String>>(&mut reader),
        ["speed", "count", "arm.joints"]
    );
    assert_eq!(get::<Vec<String>>(&mut reader), ["arm"]);

    let wanted = names(&["speed", "count", "token", "arm.joints"]);
    let answer = asker.ask("get_parameter_types", "GetParameterTypes", &|writer| {
        writer.put(&wanted);
    });
    assert_eq!(get::<Vec<u8>>(&mut Reader::new(&answer)), [3, 2, 0, 9]);

    let answer = asker.ask("describe_parameters", "DescribeParameters", &|writer| {
        writer.put(&names(&["speed", "count"]));
    });
    let mut reader = Reader::new(&answer);
    assert_eq!(get::<u32>(&mut reader), 2);
    assert_eq!(get::<String>(&mut reader), "speed");
    assert_eq!(get::<u8>(&mut reader), 3);
    assert_eq!(get::<String>(&mut reader), "How fast.");
    assert!(get::<String>(&mut reader).contains("from 0 to 10"));
    // Not read-only, no dynamic typing; one floating-point range and no integer range.
    assert_eq!(get::<[bool; 2]>(&mut reader), [false, false]);
    assert_eq!(get::<u32>(&mut reader), 1);
    assert_eq!(get::<[f64; 3]>(&mut reader), [0.0, 10.0, 0.0]);
    assert_eq!(get::<u32>(&mut reader), 0);
    assert_eq!(get::<String>(&mut reader), "count");
    assert_eq!(get::<u8>(&mut reader), 2);
    let _: [String; 2] = get(&mut reader);
    assert_eq!(get::<[bool; 2]>(&mut reader), [true, false]);
    assert_eq!(get::<[u32; 2]>(&mut reader), [0, 1]);
    assert_eq!(get::<[i64; 3]>(&mut reader), [1, i64::from(i32::MAX), 0]);

    assert_eq!(asker.set("speed", 3, 2.5), (true, String::new()));
    for (name, ty, number, why) in [
        ("speed", 3, 11.0, "from 0 to 10"),
        ("speed", 3, 4.0, "the gear is stuck"),
        ("speed", 0, 0.0, "cannot be null"),
        ("count", 2, 0.0, "fixed when the component starts"),
        ("token", 4, 0.0, "is secret"),
        ("sped", 3, 1.0, "did you mean `speed`?"),
    ] {
        let (done, reason) = asker.set(name, ty, number);
        assert!(!done && reason.contains(why), "{name}: {reason}");
    }
    let answer = asker.ask(
        "set_parameters_atomically",
        "SetParametersAtomically",
        &|writer| {
            writer.put(&2_u32);
            value(writer, "speed", 3, 3.5);
            value(writer, "count", 2, 0.0);
        },
    );
    assert!(!get::<bool>(&mut Reader::new(&answer)));
    let answer = asker.ask("get_parameters", "GetParameters", &|writer| {
        writer.put(&names(&["speed"]));
    });
    let mut reader = Reader::new(&answer);
    assert_eq!((get(&mut reader), get(&mut reader)), (1_u32, 3_u8));
    let _: (bool, i64) = (get(&mut reader), get(&mut reader));
    // An atomic change is refused as a whole.
    assert!((get::<f64>(&mut reader) - 2.5).abs() < 1e-9);

    component.stop();
    component.join().expect("a good end");
}

/// A component whose own interface describes the message of ROS receives the events.
#[test]
fn a_component_receives_parameter_events() {
    let network = format!("rosparam_heard_{}", std::process::id());
    let domain = 20 + (3 + std::process::id() * 2) % 80;
    let mut settings = settings(domain);
    let rule = Remapping::parse("Events/told:=/parameter_events").expect("a rule");
    settings.set("ros2", "remap", Value::Remappings(vec![rule]));
    let asker = Asker::new(&network, settings).expect("another node");
    let endpoint = Endpoint {
        address: Address::parse(&format!("{network}/Events/told")).expect("an address"),
        types: TypeIdentity {
            name: "Own::Events/told".to_owned(),
            hash: 99,
        },
        qos: Qos {
            depth: 10,
            ..Qos::PUBLISHER
        },
        external_types: vec![ExternalType {
            slot: "Events".to_owned(),
            operation: "told".to_owned(),
            id: 1,
            type_name: "rcl_interfaces/msg/ParameterEvent".to_owned(),
        }],
    };
    let mut events = asker.backend.subscriber(&endpoint).expect("an end");
    let setting = format!("ros2.domain={domain}");
    let set = "--set-middleware";
    let args = [
        "--network",
        &network,
        set,
        &setting,
        set,
        "ros2.interfaces=lo",
    ];
    let component = embed(&NODE, Worker::start, &args).expect("a component");
    let node = format!("/{network}/tuned");
    // Number of new parameters, and the name of the first changed one.
    let mut next = || {
        let begin = std::time::Instant::now();
        let mut told = None;
        while told.is_none() {
            assert!(begin.elapsed() < LIMIT, "nothing was reported");
            std::thread::sleep(Duration::from_millis(5));
            let mut take = |_: Header, body: &[u8]| {
                let mut reader = Reader::new(body);
                let _: (i32, u32) = (get(&mut reader), get(&mut reader));
                // Other nodes of this domain publish on the same topic.
                if get::<String>(&mut reader) == node {
                    let new: u32 = get(&mut reader);
                    let changed =
                        (new == 0).then(|| (get::<u32>(&mut reader), get::<String>(&mut reader)));
                    told = Some((new, changed));
                }
            };
            events.receive(&mut take).expect("no error");
        }
        told.expect("it was reported")
    };
    assert_eq!(next(), (3, None));
    assert_eq!(asker.set("speed", 3, 2.5), (true, String::new()));
    assert_eq!(next(), (0, Some((1, "speed".to_owned()))));
    component.stop();
    component.join().expect("a good end");
}

/// The replies of the six services to a node of ROS 2 on Cyclone DDS.
#[test]
fn a_node_on_cyclone_lists_describes_gets_and_sets_parameters() {
    let test = "a_node_on_cyclone_lists_describes_gets_and_sets_parameters";
    let Some(python) = rc_test_support::python::interpreter("cyclonedds==11.0.1", test) else {
        return;
    };
    let network = format!("rosparam_stranger_{}", std::process::id());
    let domain = (20 + (2 + std::process::id() * 3) % 80).to_string();
    let mut args = vec![
        "--network",
        &network,
        "--ros-args",
        "-r",
        "__ns:=/robot",
        "--",
    ];
    let set = format!("ros2.domain={domain}");
    for setting in [&set, "ros2.interfaces=lo"] {
        args.extend(["--set-middleware", setting]);
    }
    let component = embed(&NODE, Worker::start, &args).expect("a component");
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/stranger/parameters.py");
    let loopback = "<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>";
    let said = std::process::Command::new(python)
        .args(["-B", program, &network, &domain, "/robot/tuned"])
        .env("CYCLONEDDS_URI", loopback)
        .output()
        .expect("Python");
    component.stop();
    component.join().expect("a good end");
    let (out, failed) = (
        String::from_utf8_lossy(&said.stdout),
        String::from_utf8_lossy(&said.stderr),
    );
    let lines: Vec<&str> = out.lines().collect();
    let expected = [
        "list speed count arm.joints in arm",
        "describe speed 3 How fast. | ",
        "describe count 2  | ",
        "describe arm.joints 9  | ",
        "types 3 2 9",
        "get 1.0 7 ['a', 'b']",
        "set True ",
        "set False ",
        "set False ",
        "set True",
        "get 3.5 ['x', 'y', 'z']",
    ];
    assert_eq!(lines.len(), expected.len(), "{out}{failed}");
    for (line, expected) in lines.iter().zip(expected) {
        assert!(line.starts_with(expected), "{expected}: {out}");
    }
    assert!(lines[1].ends_with("False (0.0, 10.0)"), "{out}");
    assert!(lines[2].ends_with("True (1, 2147483647)"), "{out}");
    assert!(lines[7].contains("from 0 to 10"), "{out}");
    assert!(
        lines[8].contains("fixed when the component starts"),
        "{out}"
    );
}
