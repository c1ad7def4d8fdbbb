//! A client of `rcdeploy foxglove` that knows nothing but the protocol.

use crate::site::{self, Site};
use rc_test_support::python;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

const PACKAGES: &str = include_str!("foxglove.txt");

/// A running command. Dropping it ends it.
pub struct Tool(
    /// Its process.
    pub Child,
);

impl Drop for Tool {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// `rcdeploy ARGS…` in the environment of a site.
pub fn rcdeploy(site: &Site, args: &[&str]) -> Command {
    Site::executable("rcfoxglove");
    let mut command = site.command(&site::rcdeploy());
    command.args(args);
    command
}

/// Serves the network of a site on a free port.
pub fn serve(site: &Site, args: &[&str]) -> (Tool, u16) {
    let all = [&["foxglove", site.network.as_str(), "--port", "0"], args].concat();
    let mut command = rcdeploy(site, &all);
    let mut child = command.stdout(Stdio::piped()).spawn().expect("rcdeploy");
    let mut line = String::new();
    let output = child.stdout.take().expect("its output");
    let tool = Tool(child);
    BufReader::new(output)
        .read_line(&mut line)
        .expect("its first line");
    let port = line.split("ws://127.0.0.1:").nth(1);
    let port = port.and_then(|rest| rest.split(';').next()?.parse().ok());
    (tool, port.unwrap_or_else(|| panic!("no port in `{line}`")))
}

/// Runs the client. `None` if it cannot run here.
pub fn client(site: &Site, port: u16, what: &str, test: &str) -> Option<Value> {
    let python = python::packages("foxglove", PACKAGES, test)?;
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/foxglove.py");
    let mut command = site.command(python);
    command.arg(program).arg(port.to_string()).arg(what);
    command.arg(site::rcdeploy());
    command.args(["restart", &site.network, "simulator"]);
    let ran = site.run(command);
    assert_eq!(ran.code, 0, "{ran:?}");
    Some(serde_json::from_str(&ran.stdout).expect("JSON"))
}

/// A client sees and touches a running patrol.
pub fn look(site: &Site, test: &str) {
    let (mut tool, port) = serve(site, &[]);
    let pose =
        r#"{"pose": {"source": "sent", "x": 1500, "y": -250, "rz": 3.1415927, "confidence": 42}}"#;
    let send = ["send", &site.network, "newFullPose", pose, "--rate", "20"];
    let mut sender = rcdeploy(site, &send);
    let sender = Tool(sender.spawn().expect("rcdeploy"));
    let Some(found) = client(site, port, "look", test) else {
        return;
    };
    drop(sender);
    assert_eq!(found["info"]["name"], site.network);
    let capabilities = json!([
        "parameters",
        "parametersSubscribe",
        "connectionGraph",
        "services"
    ]);
    assert_eq!(found["info"]["capabilities"], capabilities);
    let pi = f64::from(std::f32::consts::PI);
    let pose = json!({"x": 1500.0, "y": -250.0, "rz": pi, "confidence": 42});
    assert_eq!(found["pose"], pose);
    assert!(found["age"].as_f64() < Some(60.0), "{found}");
    let shape = &found["shape"];
    assert_eq!(shape[0], "world");
    assert_eq!((&shape[1], &shape[2]), (&json!(1.5), &json!(-0.25)));
    // A quaternion and its negative are the same rotation.
    let turned = shape[3].as_f64().expect("a number").abs();
    assert!((turned - (pi / 2.0).sin()).abs() < 1e-12, "{turned}");
    let ranges = &found["ranges"];
    assert_eq!(
        (&ranges[0], &ranges[1]),
        (&json!("simulator"), &found["measures"])
    );
    assert!(ranges[2].as_f64() < ranges[3].as_f64(), "{found}");
    // In metres.
    let near = found["near"].as_f64().expect("a number");
    assert!((0.0..=5.1).contains(&near), "{found}");
    assert_eq!(found["called"], found["measures"]);
    assert_eq!(found["speed"]["type"], "float64");
    let speed = site.rcdeploy(&["params", "get", &site.network, "avoider", "speed"], false);
    assert!(speed.stdout.contains("speed = 300.0"), "{speed:?}");
    let refused = found["refused"].as_str().expect("a text");
    assert!(
        refused.contains("speed") && refused.contains("1500"),
        "{refused}"
    );
    let graph = found["graph"].to_string();
    let published = found["graph"]["publishedTopics"]
        .as_array()
        .expect("a list");
    let poses = published.iter().find(|one| {
        let name = one["name"].as_str();
        name.is_some_and(|name| name.ends_with("/newFullPose"))
    });
    assert_eq!(
        poses.expect("poses")["publisherIds"],
        json!(["simulator"]),
        "{graph}"
    );
    assert!(graph.contains(r#""subscriberIds":["monitor"]"#), "{graph}");
    assert!(graph.contains(r#""providerIds":["simulator"]"#), "{graph}");
    // Ctrl-C ends it.
    kill_process(Pid::from_child(&tool.0), Signal::INT).expect("to signal");
    assert_eq!(tool.0.wait().expect("a child").code(), Some(0));
}
