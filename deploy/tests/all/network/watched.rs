//! Conditions of a running network are reported when they start and when they end.

use rc_test_site::site::{PATROL, Site};
use serde_json::json;

fn await_event(site: &Site, component: &str, code: &str, text: &str) {
    Site::until(&format!("{code} of {component}, {text}"), || {
        let events = site.events(component);
        events
            .iter()
            .any(|(c, message)| c == code && message.contains(text))
    });
}

/// Checks that start and end of a condition alternate: on a busy machine it may start again. If
/// `slot` is not empty, checks the events of that slot.
fn assert_by_turns(site: &Site, component: &str, [begins, over]: [&str; 2], slot: &str) {
    let mut events = site.events(component);
    events.retain(|(code, text)| [begins, over].contains(&code.as_str()) && text.contains(slot));
    let right = [begins, over].into_iter().cycle();
    let codes = events.iter().map(|(code, _)| code.as_str());
    assert!(
        codes.zip(right).all(|(code, right)| code == right),
        "{events:?}"
    );
    assert!(!events.is_empty(), "no {begins}");
}

fn has_trouble(component: &serde_json::Value, code: &str, text: &str) -> bool {
    let troubles = component["troubles"]
        .as_array()
        .cloned()
        .unwrap_or_default();
    troubles.iter().any(|trouble| {
        trouble["code"] == code
            && trouble["message"]
                .as_str()
                .is_some_and(|m| m.contains(text))
    })
}

#[test]
fn overruns_silence_and_lost_peers_are_reported_at_their_start_and_end() {
    let site = Site::new("watched");
    site.write_ddsl(PATROL);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let net = site.network.as_str();

    // Two calls exceed this period.
    site.tell("avoider", "period", &json!({ "ms": 0.1 }));
    await_event(&site, "avoider", "overrun", "compute() took ");
    site.await_component("avoider", |c| {
        has_trouble(c, "overrun", "the period of 0.1 ms")
    });
    let status = site.rcdeploy(&["status", net], false);
    assert!(
        status.stdout.contains("overrun: compute() took"),
        "{status:?}"
    );
    site.tell("avoider", "period", &json!({ "ms": 200 }));
    await_event(&site, "avoider", "in-time", "");
    assert_by_turns(&site, "avoider", ["overrun", "in-time"], "");

    // The monitor expects poses every second.
    assert_eq!(site.rcdeploy(&["stop", net, "simulator"], false).code, 0);
    for slot in ["Laser", "DifferentialRobot"] {
        await_event(
            &site,
            "avoider",
            "peer-vanished",
            &format!("slot {slot} has no peer any more"),
        );
        site.await_component("avoider", |c| has_trouble(c, "peer-vanished", slot));
    }
    await_event(&site, "monitor", "peer-vanished", "FullPoseEstimationPub");
    await_event(
        &site,
        "monitor",
        "silent",
        "no sample of FullPoseEstimationPub came for 1",
    );
    site.await_component("monitor", |c| {
        has_trouble(c, "silent", "longer than its deadline")
    });
    assert_eq!(site.rcdeploy(&["start", net, "simulator"], false).code, 0);
    for slot in ["Laser", "DifferentialRobot"] {
        await_event(&site, "avoider", "peer-back", slot);
    }
    await_event(&site, "monitor", "peer-back", "FullPoseEstimationPub");
    await_event(&site, "monitor", "heard-again", "FullPoseEstimationPub");
    site.await_component("monitor", |c| !has_trouble(c, "peer-vanished", ""));
    let slot = "FullPoseEstimationPub";
    assert_by_turns(&site, "monitor", ["silent", "heard-again"], slot);
    assert_by_turns(&site, "monitor", ["peer-vanished", "peer-back"], slot);
    let output = ["avoider", "monitor"].map(|name| (name, site.events(name).len()));
    assert_eq!(site.rcdeploy(&["down", net], false).code, 0);
    // The final stop of all components is not reported as a loss.
    for (name, output) in output {
        let last = site.events(name).split_off(output);
        assert!(
            last.iter().all(|(code, _)| code != "peer-vanished"),
            "{last:?}"
        );
    }
    site.assert_nothing_left();
}
