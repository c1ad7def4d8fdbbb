//! Managed components: the order in which a network configures, activates and deactivates them,
//! what follows a failure, and the commands.

use crate::bench::{Bench, Up, component, kill, well};
use rc_deploy::{Component, Policy, Restart};
use rc_management::lifecycle::LifecycleState;
use rustix::process::Signal;
use serde_json::{Value, json};
use std::time::Duration;

/// A managed component. `fails` are the hooks that fail, for each start.
fn managed(name: &str, fails: &str, after: &[&str]) -> Component {
    Component {
        managed: true,
        ready: Duration::from_secs(5),
        restart: Restart {
            policy: Policy::OnFailure,
            hung: None,
            limit: None,
            backoff: Duration::from_millis(20),
        },
        ..component(name, format!("managed {fails}").trim_end(), after)
    }
}

/// `viewer` needs `arm`, and that needs `bus`; only `viewer` is not managed.
fn network(arm_fails: &str) -> Vec<Component> {
    vec![
        component("viewer", "well", &["arm"]),
        managed("arm", arm_fails, &["bus"]),
        managed("bus", "", &[]),
    ]
}

/// Recorded steps of the components, without their starts.
fn steps(bench: &Bench) -> Vec<String> {
    let mut steps = bench.journal();
    steps.retain(|step| {
        !["start", "end", "orphan"]
            .iter()
            .any(|word| step.ends_with(word))
    });
    steps
}

fn lifecycles(bench: &Bench) -> Vec<Option<LifecycleState>> {
    let status = bench.status();
    status.components.iter().map(|c| c.lifecycle).collect()
}

fn command(bench: &Bench, name: &str, names: &[&str]) -> Value {
    let output = bench.command(name, names);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| {
        let error = String::from_utf8_lossy(&output.stderr);
        json!(error.trim())
    })
}

fn end(up: Up) -> Vec<Value> {
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0), "{events:#?}");
    events
}

#[test]
fn a_network_configures_all_then_activates_in_order_and_ends_backwards() {
    let bench = Bench::new();
    let mut up = bench.start(network(""));
    up.await_event("up", None);
    let active = Some(LifecycleState::Active);
    assert_eq!(lifecycles(&bench), [None, active, active]);
    assert!(rc_deploy_client::status::table(&bench.status()).contains("active"));
    let events = end(up);
    let wanted = [
        "bus ready",
        "bus configure",
        "arm ready",
        "arm configure",
        "bus activate",
        "arm activate",
        "viewer ready",
        "viewer stop",
        "arm stop",
        "arm deactivate",
        "arm cleanup",
        "arm shutdown",
        "bus stop",
        "bus deactivate",
        "bus cleanup",
        "bus shutdown",
    ];
    assert_eq!(steps(&bench), wanted);
    let of_arm = events.iter().filter(|event| event["component"] == "arm");
    let of_arm = of_arm.filter(|event| event["code"] == "lifecycle");
    let states: Vec<&Value> = of_arm.map(|event| &event["message"]).collect();
    let wanted = ["unconfigured", "inactive", "active"];
    assert_eq!(states[..3], wanted, "{events:#?}");
    bench.assert_nothing_left();
}

#[test]
fn a_failure_to_configure_or_activate_takes_the_network_back() {
    for (fails, reason) in [
        ("1", "configure: no motor"),
        ("2", "activate: no motor"),
        ("3", "ended before it was ready"),
    ] {
        let bench = Bench::new();
        let (code, events) = bench.start(network(fails)).end();
        assert_eq!(code, Some(3), "{events:#?}");
        let failed = events.iter().find(|event| event["code"] == "start-failed");
        let failed = failed.expect("a failed start");
        assert_eq!(failed["component"], "arm");
        let message = failed["message"].as_str().expect("a message");
        assert!(message.starts_with(reason), "{message}");
        let steps = steps(&bench);
        assert!(!steps.contains(&"viewer ready".to_owned()), "{steps:?}");
        let is_activated = steps.contains(&"bus activate".to_owned());
        assert_eq!(is_activated, fails != "1", "{steps:?}");
        assert_eq!(steps.contains(&"bus deactivate".to_owned()), is_activated);
        assert!(steps.ends_with(&["bus shutdown".to_owned()]), "{steps:?}");
        bench.assert_nothing_left();
    }
}

#[test]
fn a_hook_that_hangs_is_late() {
    let bench = Bench::new();
    let slow = Component {
        ready: Duration::from_millis(300),
        ..managed("slow", "4", &[])
    };
    let (code, events) = bench.start(vec![slow]).end();
    assert_eq!(code, Some(3), "{events:#?}");
    let failed = events.iter().find(|event| event["code"] == "start-failed");
    let message = failed.expect("a failed start")["message"].to_string();
    assert!(
        message.contains("is inactive, not active, after 300ms"),
        "{message}"
    );
}

#[test]
fn a_restart_returns_a_component_to_the_state_that_it_had() {
    let bench = Bench::new();
    let mut up = bench.start(network(""));
    up.await_event("up", None);
    for process in bench.processes("bus start") {
        kill(process);
    }
    up.await_event("restarting", Some("bus"));
    while up.await_event("lifecycle", Some("bus")) != "active" {}
    assert_eq!(
        command(&bench, "deactivate", &["arm"]),
        json!({ "done": ["arm"], "failed": [] })
    );
    for process in bench.processes("arm start") {
        kill(process);
    }
    up.await_event("restarting", Some("arm"));
    up.await_event("ready", Some("arm"));
    let (inactive, active) = (Some(LifecycleState::Inactive), Some(LifecycleState::Active));
    assert_eq!(lifecycles(&bench), [None, inactive, active]);
    let done = json!({ "done": ["bus"], "failed": [] });
    assert_eq!(command(&bench, "restart", &["bus"]), done);
    assert_eq!(lifecycles(&bench), [None, inactive, active]);
    // A command that starts it starts it as the network does.
    assert_eq!(command(&bench, "stop", &["arm"])["done"], json!(["arm"]));
    assert_eq!(command(&bench, "start", &["arm"])["done"], json!(["arm"]));
    assert_eq!(lifecycles(&bench), [None, active, active]);
    end(up);
    bench.assert_nothing_left();
}

#[test]
fn commands_change_the_life_cycle_in_order_and_say_what_they_cannot() {
    let bench = Bench::new();
    let mut up = bench.start(network(""));
    up.await_event("up", None);
    let before = steps(&bench).len();
    let all = json!({ "done": ["arm", "bus"], "failed": [] });
    for name in ["cleanup", "configure", "activate", "activate", "deactivate"] {
        assert_eq!(command(&bench, name, &[]), all, "{name}");
    }
    let wanted = [
        "arm deactivate",
        "arm cleanup",
        "bus deactivate",
        "bus cleanup",
        "arm configure",
        "bus configure",
        "bus activate",
        "arm activate",
        "arm deactivate",
        "bus deactivate",
    ];
    let mut seen = steps(&bench).split_off(before);
    // Nothing depends on the order of these two.
    seen[4..6].sort();
    assert_eq!(seen, wanted);
    let error = |name, names: &[&str]| command(&bench, name, names).to_string();
    assert!(error("activate", &["viewer"]).contains("`viewer` is not managed"));
    assert!(error("activate", &["amr"]).contains("did you mean `arm`?"));
    assert_eq!(command(&bench, "stop", &["arm"])["done"], json!(["arm"]));
    let refused = json!([{ "name": "arm", "reason": "does not run; start it" }]);
    assert_eq!(command(&bench, "activate", &[])["failed"], refused);
    end(up);
    bench.assert_nothing_left();

    let bench = Bench::new();
    let mut up = bench.start(vec![well("a")]);
    up.await_event("up", None);
    let none = command(&bench, "activate", &[]).to_string();
    assert!(
        none.contains("no component of this network is managed"),
        "{none}"
    );
    end(up);
}

#[test]
fn a_component_that_cannot_be_activated_again_is_restarted_by_its_policy() {
    let bench = Bench::new();
    let mut up = bench.start(vec![managed("arm", "0 2 0", &[])]);
    up.await_event("up", None);
    for process in bench.processes("arm start") {
        kill(process);
    }
    let text = up.await_event("not-changed", Some("arm"));
    assert_eq!(text, "activate: no motor");
    up.await_event("restarting", Some("arm"));
    while up.await_event("lifecycle", Some("arm")) != "active" {}
    assert_eq!(bench.status().components[0].restarts, 2);
    end(up);
    bench.assert_nothing_left();
}

#[test]
fn a_goal_that_a_command_gave_up_is_not_reached_later() {
    let bench = Bench::new();
    let slow = Component {
        ready: Duration::from_secs(6),
        ..managed("arm", "5", &[])
    };
    let mut up = bench.start(vec![slow]);
    up.await_event("up", None);
    let done = json!({ "done": ["arm"], "failed": [] });
    assert_eq!(command(&bench, "cleanup", &["arm"]), done);
    let late = command(&bench, "activate", &["arm"]);
    assert_eq!(
        late["failed"][0]["reason"],
        "is configuring, not inactive, after 6s"
    );
    std::fs::write(bench.path("go"), "").expect("written");
    while up.await_event("lifecycle", Some("arm")) != "configuring" {}
    while up.await_event("lifecycle", Some("arm")) != "inactive" {}
    assert_eq!(command(&bench, "configure", &["arm"]), done);
    assert_eq!(lifecycles(&bench), [Some(LifecycleState::Inactive)]);
    let activated = steps(&bench)
        .into_iter()
        .filter(|step| step == "arm activate");
    assert_eq!(activated.count(), 1);
    assert_eq!(command(&bench, "activate", &["arm"]), done);
    end(up);
    bench.assert_nothing_left();
}

#[test]
fn a_component_that_ends_in_a_command_returns_to_the_state_before() {
    let bench = Bench::new();
    let mut up = bench.start(vec![managed("arm", "6", &[])]);
    up.await_event("up", None);
    let done = json!({ "done": ["arm"], "failed": [] });
    assert_eq!(command(&bench, "deactivate", &["arm"]), done);
    let failed = command(&bench, "activate", &["arm"])["failed"][0]["reason"].to_string();
    assert!(failed.contains("SIGABRT"), "{failed}");
    up.await_event("restarting", Some("arm"));
    up.await_event("ready", Some("arm"));
    assert_eq!(command(&bench, "configure", &["arm"]), done);
    assert_eq!(lifecycles(&bench), [Some(LifecycleState::Inactive)]);
    end(up);
    bench.assert_nothing_left();
}

#[test]
fn a_hook_that_a_tool_begins_and_that_does_not_end_is_reported() {
    let bench = Bench::new();
    let mut up = bench.start(vec![managed("arm", "7", &[])]);
    let hung = up.await_event("hung", Some("arm"));
    assert_eq!(hung, "its event loop has not run for 60000 ms");
    end(up);
    bench.assert_nothing_left();
}
