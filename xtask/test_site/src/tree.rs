//! A network of two processes that share one tree of InnerModel.

use crate::site::Site;
use serde_json::{Value, json};

const NETWORK: &str = include_str!("../../../components/networks/inner_model.ddsl");

impl Site {
    /// Calls an operation of a component.
    pub fn call_tree(&self, operation: &str, arguments: &Value) -> Value {
        let arguments = arguments.to_string();
        let name = self.network.as_str();
        let ran = self.rcdeploy(
            &["call", name, operation, &arguments, "--format", "json"],
            false,
        );
        serde_json::from_str(&ran.stdout).unwrap_or_else(|_| panic!("{ran:?}"))
    }

    /// Writes the network under the name of this site, over this middleware with its settings. The
    /// first process refuses collisions.
    pub fn write_trees(&self, middleware: &str) {
        let scene = Self::components().join("../innermodel/scenes/house.xml");
        let text = NETWORK
            .replace("Deployment inner_model", "Deployment patrol")
            .replace("middleware iceoryx2", &format!("middleware {middleware}"))
            .replace(
                "\"../../innermodel/scenes/house.xml\";",
                &format!("\"{}\"; refuse_collisions true;", scene.display()),
            )
            .replace(
                "after world;",
                "after world; restart on_failure backoff 10ms;",
            );
        self.write_ddsl(&text);
    }

    /// Changes the tree of each process, by both interfaces, and waits until the other one has it.
    pub fn share_a_tree(&self) {
        // The copy has no file: all of its nodes come from the other one.
        Self::until("the copy has the bowl", || self.bowl("copy").is_some());
        self.set_bowl("world", 100.0);
        self.set_bowl("copy", 200.0);
        // RoboComp's interface of one changes the tree of the other one.
        let pose = json!({"x": 300, "y": 900, "z": 0});
        let moved = self.call_tree(
            "copy.InnerModelManager.setPose",
            &json!({"base": "root", "item": "bowl", "pose": pose}),
        );
        assert_eq!(moved["result"]["return"], true, "{moved}");
        self.await_bowl(300.0);
    }

    /// The coordinate x of the bowl in the root.
    fn bowl(&self, component: &str) -> Option<f64> {
        let operation = format!("{component}.InnerModel.getPose");
        let reply = self.call_tree(&operation, &json!({"to": "root", "id": "bowl"}));
        reply["result"]["return"]["x"].as_f64()
    }

    /// Moves the bowl in the tree of one process, and waits until both have it there.
    pub fn set_bowl(&self, component: &str, x: f64) {
        let operation = format!("{component}.InnerModel.setPoseIn");
        let pose = json!({"x": x, "y": 900, "z": 0});
        self.call_tree(
            &operation,
            &json!({"id": "bowl", "base": "root", "pose": pose}),
        );
        self.await_bowl(x);
    }

    /// Waits until both trees have the bowl at this coordinate x of the root.
    pub fn await_bowl(&self, x: f64) {
        for component in ["world", "copy"] {
            Self::until(&format!("the bowl of {component} is at {x}"), || {
                let there = self.bowl(component);
                there.is_some_and(|there| (there - x).abs() < 1e-9)
            });
        }
    }
}
