//! Two processes with the same tree of InnerModel, and one that comes late.

use crate::network::site::Site;
use serde_json::{Value, json};

const NETWORK: &str = include_str!("../../../../components/networks/inner_model.ddsl");

impl Site {
    /// Calls an operation of a component.
    fn call_tree(&self, operation: &str, arguments: &Value) -> Value {
        let arguments = arguments.to_string();
        let name = self.network.as_str();
        let ran = self.rcdeploy(
            &["call", name, operation, &arguments, "--format", "json"],
            false,
        );
        serde_json::from_str(&ran.stdout).unwrap_or_else(|_| panic!("{ran:?}"))
    }

    /// The coordinate x of the bowl in the root.
    fn bowl(&self, component: &str) -> Option<f64> {
        let operation = format!("{component}.InnerModel.getPose");
        let reply = self.call_tree(&operation, &json!({"to": "root", "id": "bowl"}));
        reply["result"]["return"]["x"].as_f64()
    }

    fn set_bowl(&self, component: &str, x: f64) {
        let operation = format!("{component}.InnerModel.setPoseIn");
        let pose = json!({"x": x, "y": 900, "z": 0});
        self.call_tree(
            &operation,
            &json!({"id": "bowl", "base": "root", "pose": pose}),
        );
        self.await_bowl(x);
    }

    fn await_bowl(&self, x: f64) {
        for component in ["world", "copy"] {
            Self::until(&format!("the bowl of {component} is at {x}"), || {
                let there = self.bowl(component);
                there.is_some_and(|there| (there - x).abs() < 1e-9)
            });
        }
    }
}

#[test]
fn two_processes_hold_one_tree_through_changes_and_restarts() {
    let site = Site::new("inner_model");
    let scene = Site::components().join("../innermodel/scenes/house.xml");
    let text = NETWORK
        .replace("Deployment inner_model", "Deployment patrol")
        .replace(
            "../../innermodel/scenes/house.xml",
            &scene.display().to_string(),
        )
        .replace(
            "after world;",
            "after world; restart on_failure backoff 10ms;",
        );
    site.write_ddsl(&text);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    // The copy has no file: all of its nodes come from the other one.
    Site::until("the copy has the bowl", || site.bowl("copy").is_some());
    site.set_bowl("world", 100.0);
    site.set_bowl("copy", 200.0);

    // RoboComp's interface of one changes the tree of the other one.
    let pose = json!({"x": 300, "y": 900, "z": 0});
    let moved = site.call_tree(
        "copy.InnerModelManager.setPose",
        &json!({"base": "root", "item": "bowl", "pose": pose}),
    );
    assert_eq!(moved["result"]["return"], true, "{moved}");
    site.await_bowl(300.0);
    let refused = site.call_tree(
        "world.InnerModelManager.removeNode",
        &json!({"item": "bowll"}),
    );
    assert!(refused.to_string().contains("NonExistingNode"), "{refused}");

    // A process that was killed has the whole tree again.
    let status = site.status();
    let components = status["components"].as_array().expect("a list");
    let copy = components.iter().find(|c| c["name"] == "copy").expect("it");
    let pid = copy["pid"].as_i64().expect("a process");
    let pid = rustix::process::Pid::from_raw(pid as i32).expect("a process");
    rustix::process::kill_process(pid, rustix::process::Signal::KILL).expect("to kill it");
    site.await_component("copy", |c| {
        c["state"] == "running" && c["pid"] != copy["pid"]
    });
    site.await_bowl(300.0);
    site.set_bowl("copy", 400.0);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
