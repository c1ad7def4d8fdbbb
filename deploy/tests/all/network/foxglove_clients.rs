//! `rcdeploy foxglove`: clients see and touch a network, and hostile ones stop nothing.

use super::foxglove::{client, look, rcdeploy, serve};
use super::site::Site;
use serde_json::json;

fn patrol(name: &str) -> Site {
    let site = Site::new(name);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site
}

#[test]
fn foxglove_sees_and_touches_a_patrol() {
    let site = patrol("foxglove");
    look(&site, "foxglove_sees_and_touches_a_patrol");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn hostile_clients_of_foxglove_stop_nothing() {
    let site = patrol("hostile");
    let args = [
        "--origin",
        "https://viewer.example",
        "--frame",
        "newFullPose=base",
    ];
    let (mut tool, port) = serve(&site, &args);
    let test = "hostile_clients_of_foxglove_stop_nothing";
    if let Some(found) = client(&site, port, "attack", test) {
        let wanted = json!({
            "origin": 403, "protocol": 400, "allowed": null, "foxglove": null,
            "frames": ["world", "base"], "lives": true, "long": true, "served": true,
            "twice": 1, "ids": [1],
        });
        assert_eq!(found, wanted);
        assert!(
            tool.0.try_wait().expect("a child").is_none(),
            "it has ended"
        );
    }
    for (args, code, reason) in [
        (&["--frame", "newFullPos=base"][..], 1, "did you mean"),
        (&["--port", &port.to_string()], 3, "port"),
    ] {
        let all = [&["foxglove", site.network.as_str()], args].concat();
        let ran = site.run(rcdeploy(&site, &all));
        assert_eq!(ran.code, code, "{ran:?}");
        assert!(ran.stderr.contains(reason), "{ran:?}");
    }
    let ran = site.run(rcdeploy(&site, &["foxglove", "no_such_network"]));
    assert_eq!(ran.code, 3, "{ran:?}");
    drop(tool);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
}
