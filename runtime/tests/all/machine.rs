//! The state machine of a component in simulated time, and events that tools fire.

// Also a module of the program `rc-test-component`: a program and a test of a crate share only its
// library.
#[path = "../programs/charts.rs"]
mod charts;

use crate::time::{ask, end, follower, network, note, script, source, until};
use charts::{Number, chart};
use rc_runtime::machine::{self, Action, Condition, Hooks, Machine, NONE, Parts};
use rc_runtime::{
    Component, Core, Description, Embedded, Ports, StartError, Values, WorkerError, embed,
};
use serde_json::json;
use std::time::Duration;

static TIMED: Description = TIMED_PARTS;

const TIMED_PARTS: Description = Description {
    name: "timed",
    model_hash: 3,
    middleware: "local",
    period: Duration::from_millis(20),
    parameters: None,
    folder: "/nowhere",
    slots: &[],
    types: &[],
    backends: &[rc_local::LINKED],
    simulates_time: false,
    managed: false,
    converter: None,
    note: b"",
};

static MANAGED: Description = Description {
    name: "managed",
    managed: true,
    converter: None,
    ..TIMED_PARTS
};

/// Enters `b` 25 ms after the start.
struct Timed {
    core: Core,
    machine: Machine<Number, Number>,
}

impl Timed {
    fn start(core: Core, _: &Ports, _: &Values) -> Result<Self, StartError> {
        let late = Action::Send {
            event: 0,
            delay: 25_000_000,
            id: NONE,
        };
        // The machine of the other name waits for a tool.
        let on_entry = if core.name() == "timed" {
            vec![late]
        } else {
            Vec::new()
        };
        let mut timed = Self {
            core,
            machine: Machine::new(chart(Condition::Always, on_entry), &[0]),
        };
        machine::start(&mut timed)?;
        Ok(timed)
    }
}

impl Hooks for Timed {
    fn parts(&mut self) -> &mut Parts {
        self.machine.parts()
    }

    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn guard(&mut self, _: u16) -> bool {
        true
    }

    fn action(&mut self, _: u16) -> Result<(), WorkerError> {
        Ok(())
    }

    fn entry(&mut self, state: u16) -> Result<(), WorkerError> {
        if state == 2 {
            note(&self.core, "late".to_owned());
        }
        Ok(())
    }

    fn exit(&mut self, _: u16) -> Result<(), WorkerError> {
        Ok(())
    }

    fn during(&mut self, _: u16) -> Result<(), WorkerError> {
        Ok(())
    }
}

impl Component for Timed {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        machine::rest(self)
    }

    fn react(&mut self) -> Result<(), WorkerError> {
        machine::react(self)
    }

    fn machine(&mut self) -> Option<&mut Parts> {
        Some(self.machine.parts())
    }
}

fn timed(network: &str, name: &str, more: &[&str]) -> Embedded {
    let mut args = vec!["--network", network, "--name", name];
    args.extend(more);
    embed(&TIMED, Timed::start, &args).expect("a component")
}

#[test]
fn in_lockstep_a_delayed_event_waits_for_the_turn_of_its_component() {
    let network = network("delayed");
    script(&network, |script| script.ticks = 50);
    let source = source(&network, "source", &["--followers", "b,timed"]);
    let timed = timed(&network, "timed", &["--clock", "simulated"]);
    let b = follower(&network, "b");
    until(&network, |script| script.last_tick == 50);
    end([b, timed, source]);
    let trace = script(&network, |script| std::mem::take(&mut script.trace));
    let place = |ms: u64, name: &str, what: &str| {
        let mut trace = trace.iter();
        trace.position(|(at, n, w)| (*at, n.as_str(), w.as_str()) == (ms, name, what))
    };
    let (before, late) = (place(30, "b", "compute 2"), place(30, "timed", "late"));
    assert!(late.is_some() && before < late, "{trace:?}");
    assert!(late < place(40, "b", "sample 2"), "{trace:?}");
}

#[test]
fn a_tool_fires_what_a_transition_takes() {
    let network = network("fired");
    let component = timed(&network, "waits", &[]);
    let fire = |event: &str| ask(&network, "waits", "fire", &json!({ "event": event }));
    let unknown = fire("gp");
    assert_eq!(unknown["error"]["code"], -32602);
    let message = unknown["error"]["message"].as_str().unwrap_or_default();
    assert!(message.contains("did you mean `go`?"), "{message}");
    assert_eq!(fire("go")["result"], json!({ "states": ["b"] }));
    let again = fire("go");
    assert_eq!(again["error"]["code"], -32001);
    assert_eq!(again["error"]["message"], "no transition takes `go` in `b`");
    end([component]);
}

#[test]
fn a_managed_component_takes_events_while_it_is_active() {
    let network = network("managed_events");
    let args = ["--network", &network, "--name", "managed"];
    let component = embed(&MANAGED, Timed::start, &args).expect("a component");
    let fire = || ask(&network, "managed", "fire", &json!({ "event": "go" }));
    let refused = |state: &str| {
        let error = fire()["error"].clone();
        let text = format!("the component is {state}; its machine takes events while it is active");
        assert_eq!(
            (&error["code"], &error["message"]),
            (&json!(-32001), &json!(text))
        );
    };
    let change = |transition: &str| {
        let changed = ask(
            &network,
            "managed",
            "lifecycle",
            &json!({ "transition": transition }),
        );
        assert!(changed["error"].is_null(), "{changed}");
    };
    refused("unconfigured");
    change("configure");
    refused("inactive");
    change("activate");
    assert_eq!(fire()["result"], json!({ "states": ["b"] }));
    change("deactivate");
    refused("inactive");
    end([component]);
}
