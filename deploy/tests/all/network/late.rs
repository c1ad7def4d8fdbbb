//! Late subscribers get the last samples if both ends declare `durability transient_local` in their
//! `.cdsl`: the simulator keeps its last hundred poses.

use rc_test_site::site::Site;
use serde_json::{Value, json};

const KEPT: usize = 100;

fn heard(site: &Site) -> Value {
    site.ask("pose_monitor", "status")["slots"][0].clone()
}

fn await_heard(site: &Site, count: usize) {
    Site::until(&format!("{count} poses were heard"), || {
        heard(site)["handlers"]["count"].as_u64() >= Some(count as u64)
    });
}

#[test]
fn late_and_restarted_subscribers_get_the_last_samples() {
    let site = Site::new("late");
    let config = site.write("simulator.toml", "[component]\nperiod = \"1ms\"\n");
    let config = config.display().to_string();
    let simulator = site.start("simulator", &["--config", &config]);
    let steps = || site.ask("simulator", "status")["compute"]["count"].as_u64();
    Site::until("the simulator has done many steps", || steps() > Some(250));
    // From now on it sends nothing.
    site.tell("simulator", "period", &json!({ "ms": 3_600_000 }));
    Site::until("its period is an hour", || {
        site.ask("simulator", "status")["period_ms"] == json!(3.6e6)
    });

    // Twice; each subscriber is killed when it has received the kept samples.
    for _ in 0..2 {
        let late = site.start_monitor("late", 0);
        await_heard(&site, KEPT);
        let slot = heard(&site);
        assert_eq!(slot["handlers"]["count"], KEPT, "{slot}");
        assert_eq!(
            (&slot["lost"], &slot["peers"]),
            (&json!(0), &json!(1)),
            "{slot}"
        );
        drop(late);
    }

    // The next subscriber gets kept and new samples without a gap.
    let late = site.start_monitor("trace", 0);
    await_heard(&site, KEPT);
    site.tell("simulator", "period", &json!({ "ms": 20 }));
    await_heard(&site, KEPT + 10);
    assert_eq!(heard(&site)["lost"], 0);

    // A restarted simulator is another sender.
    drop(simulator);
    let before = heard(&site)["handlers"]["count"].as_u64().expect("a count");
    let _simulator = site.start("simulator", &["--config", &config]);
    await_heard(&site, before as usize + KEPT);
    let slot = heard(&site);
    assert_eq!(slot["handlers"]["errors"], 0, "{slot}");
    drop(late);
}
