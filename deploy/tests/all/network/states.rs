//! The states of a component in a running network: events from outside, status, pictures.

use rc_test_site::other_host;
use rc_test_site::site::{CommandOutput, PATROL, Site};
use serde_json::Value;
use std::process::Command;

/// The active states of the avoider.
fn states(site: &Site) -> Vec<String> {
    let status = site.ask("avoider", "status");
    let states = status["machine"]["states"].as_array().cloned();
    let states = states.unwrap_or_default().into_iter();
    states
        .filter_map(|state| state.as_str().map(str::to_owned))
        .collect()
}

#[test]
fn events_are_fired_and_states_are_shown() {
    let site = Site::new("states");
    let net = site.network.as_str();
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let fire =
        |event: &str| -> CommandOutput { site.rcdeploy(&["fire", net, "avoider", event], false) };
    Site::until("the robot drives", || {
        states(&site)
            .iter()
            .any(|state| state.starts_with("on.motion.driving"))
    });
    let stop = fire("stop");
    assert_eq!(stop.code, 0, "{stop:?}");
    assert_eq!(stop.stdout, "avoider: on.motion.idle, on.battery.charged\n");
    // Events without a transition, internal events, and events that do not exist.
    for (event, expected) in [
        (
            "stop",
            "no transition takes `stop` in `on.motion.idle`, `on.battery.charged`",
        ),
        (
            "clear",
            "`clear` may not be fired from outside; expected one of `go`, `stop`",
        ),
        (
            "stpo",
            "`stpo` is not an event of this component; did you mean `stop`?",
        ),
    ] {
        let refused = fire(event);
        assert_eq!(refused.code, 1, "{refused:?}");
        assert!(refused.stderr.contains(expected), "{refused:?}");
    }
    let other = site.rcdeploy(&["fire", net, "monitor", "go"], false);
    assert_eq!(other.code, 1, "{other:?}");
    assert!(other.stderr.contains("no state machine"), "{other:?}");
    // The supervisor knows it with the next heartbeat.
    let status = || site.rcdeploy(&["status", net], false).stdout;
    Site::until("the status shows it", || {
        let status = status();
        let line = status
            .lines()
            .find(|line| line.contains("in on.motion.idle"));
        line.is_some_and(|line| {
            line.contains("on.motion.driving => on.motion.idle [stop] in ")
                && line.ends_with(" s ago")
        })
    });
    let json = site.status();
    let of = |name: &str| -> &Value {
        let all = json["components"].as_array().expect("a list");
        all.iter()
            .find(|c| c["name"] == name)
            .expect("the component")
    };
    let machine = &of("avoider")["machine"];
    assert_eq!(machine["external"], serde_json::json!(["go", "stop"]));
    let last = machine["transitions"].as_array().and_then(|all| all.last());
    let last = last.expect("a transition");
    assert_eq!(
        (&last["event"], &last["to"][0]),
        (&"stop".into(), &"on.motion.idle".into())
    );
    assert!(last["took_us"].is_u64());
    assert!(of("monitor").get("machine").is_none());
    // The picture of the network shows the machine, with its active states. The only network that
    // runs needs no name.
    let picture = site.rcdeploy(&["graph", "--live"], false);
    assert_eq!(picture.code, 0, "{picture:?}");
    for expected in [
        "running in on.motion.idle, on.battery.charged",
        "<title>state idle, active</title>",
        "<title>state charged, active</title>",
        "<title>state driving</title>",
    ] {
        assert!(
            picture.stdout.contains(expected),
            "{expected}: {}",
            picture.stdout
        );
    }
    let json = site.rcdeploy(&["graph", net, "--live", "--format", "json"], false);
    let json: Value = serde_json::from_str(&json.stdout).expect("JSON");
    let avoider = json["components"].as_array().expect("a list");
    let avoider = avoider
        .iter()
        .find(|c| c["name"] == "avoider")
        .expect("the avoider");
    assert_eq!(avoider["live"]["states"][0], "on.motion.idle");
    let rates = json["components"].as_array().expect("a list").iter();
    let mut rates = rates.filter_map(|component| component["live"]["rates_hz"].as_object());
    assert!(rates.any(|rates| !rates.is_empty()), "{json}");
    let go = fire("go");
    assert_eq!(
        go.stdout,
        "avoider: on.motion.driving.cruising, on.battery.charged\n"
    );
    let log = site.log("avoider");
    assert!(
        log.contains("on.motion.driving => on.motion.idle, on.battery.charged [stop] in "),
        "{log}"
    );
    assert_eq!(site.rcdeploy(&["down", net], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn an_event_reaches_a_component_on_another_host() {
    let site = Site::new("far_states");
    let host = "middleware iceoryx2;\n    Host robot { address \"robot\"; };";
    let network = PATROL.replace("middleware iceoryx2;", host);
    site.write_ddsl(&network.replace(".cdsl\";", ".cdsl\"; host robot;"));
    let ssh = other_host::ssh(&site.path(""));
    let mut up = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    up.args(["up", "--detach", "--profile", "dev"]);
    up.arg(site.ddsl()).env("RC_SSH", &ssh);
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
    let net = site.network.as_str();
    let fire =
        |event: &str| -> CommandOutput { site.rcdeploy(&["fire", net, "avoider", event], false) };
    Site::until("the robot drives", || {
        states(&site)
            .iter()
            .any(|state| state.starts_with("on.motion.driving"))
    });
    let stop = fire("stop");
    assert_eq!(stop.stdout, "avoider: on.motion.idle, on.battery.charged\n");
    let again = fire("stop");
    assert_eq!(again.code, 1, "{again:?}");
    assert!(
        again.stderr.contains("no transition takes `stop`"),
        "{again:?}"
    );
    assert_eq!(site.rcdeploy(&["down", net], false).code, 0);
    site.assert_nothing_left();
}
