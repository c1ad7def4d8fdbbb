//! What `check` says of whole networks.

use rc_test_site::site::Site;
use serde_json::Value;
use std::fmt::Write as _;

/// They are read, checked and planned; nothing starts.
#[test]
fn a_network_of_a_thousand_components_is_checked_and_planned() {
    const MANY: usize = 1000;
    let site = Site::new("large");
    let mut text = "Deployment patrol\n{\n".to_owned();
    for at in 0..MANY {
        let cdsl = "../speech_server/speech_server.cdsl";
        writeln!(text, "    Component c{at} {{ cdsl \"{cdsl}\"; }};").expect("text");
    }
    site.write_ddsl(&(text + "};\n"));
    let checked = site.rcdeploy(&["check", "--profile", "dev"], true);
    let sentence = format!("{MANY} components, 0 connections, nothing wrong");
    assert!(checked.stdout.contains(&sentence), "{checked:?}");
    let planned = site.rcdeploy(&["plan", "--format", "json", "--profile", "dev"], true);
    let plan: Value = serde_json::from_str(&planned.stdout).expect("a plan");
    assert_eq!(plan["components"].as_array().map(Vec::len), Some(MANY));
    assert_eq!(plan["waves"][0].as_array().map(Vec::len), Some(MANY));
}

/// A network with a warning is not called right.
#[test]
fn warnings_are_counted_after_a_check() {
    let site = Site::new("warned");
    site.write_ddsl(
        "Deployment patrol\n{\n    Component m { cdsl \"../pose_monitor/pose_monitor.cdsl\"; };\n};\n",
    );
    let checked = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert!(
        checked.stderr.contains("warning[no-publisher]"),
        "{checked:?}"
    );
    assert!(
        checked.stdout.contains("0 connections, 1 warning"),
        "{checked:?}"
    );
}
