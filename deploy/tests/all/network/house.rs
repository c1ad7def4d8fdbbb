//! The robot of the patrol in a simulated house: its programs are the same, and only the network's
//! file differs.

use crate::network::site::{PATROL, Site};
use serde_json::Value;
use std::process::Command;

const HOUSE: &str = include_str!("../../../../components/networks/house.ddsl");
/// Four seconds.
const POSES: usize = 80;

/// The programs of the avoider and of the monitor.
fn programs(site: &Site, network: &str) -> Vec<(Value, Value)> {
    site.write_ddsl(&network.replace("Deployment house", "Deployment patrol"));
    let plan = ["plan", "--unbuilt", "--format", "json", "--profile", "dev"];
    let ran = site.rcdeploy(&plan, true);
    assert_eq!(ran.code, 0, "{ran:?}");
    let plan: Value = serde_json::from_str(&ran.stdout).expect("one document");
    let components = plan["components"].as_array().expect("a list").iter();
    let components = components.map(|c| (c["name"].clone(), c["executable"].clone()));
    let mut named: Vec<_> = components
        .filter(|(name, _)| name == "avoider" || name == "monitor")
        .collect();
    named.sort_by_key(|(name, _)| name.to_string());
    named
}

#[test]
fn the_robot_drives_in_a_simulated_house_with_the_programs_of_the_patrol() {
    let site = Site::new("house");
    let patrol = programs(&site, PATROL);
    let house = programs(&site, HOUSE);
    assert_eq!(patrol.len(), 2, "{patrol:?}");
    assert_eq!(patrol, house);

    // The list in the file is the one that the scene gives.
    let mut rcview = Command::new(Site::executable("rcview"));
    rcview
        .arg(Site::components().join("rcis/house.xml"))
        .arg("--slots");
    let printed = site.run(rcview);
    assert_eq!(printed.code, 0, "{printed:?}");
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let lines = printed
        .stdout
        .lines()
        .map(|line| line.split(" //").next().unwrap_or_default());
    let clause = words(&lines.collect::<Vec<_>>().join(" "));
    assert!(words(HOUSE).contains(&clause), "{clause}");

    let trace = site.path("trace");
    let up = site.rcdeploy(
        &[
            "up",
            "--detach",
            "--profile",
            "dev",
            "--set",
            &format!("monitor.trace={}", trace.display()),
            "--set",
            &format!("monitor.samples={POSES}"),
        ],
        true,
    );
    assert_eq!(up.code, 0, "{up:?}");
    site.await_end_of("monitor");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    let text = std::fs::read_to_string(trace).expect("a trace");
    let poses: Vec<Vec<f64>> = text
        .lines()
        .map(|line| {
            line.split(',')
                .filter_map(|number| number.parse().ok())
                .collect()
        })
        .filter(|numbers: &Vec<f64>| numbers.len() == 4)
        .collect();
    assert_eq!(poses.len(), POSES, "{text}");
    let (first, last) = (&poses[0], &poses[POSES - 1]);
    let moved = (last[1] - first[1]).hypot(last[2] - first[2]);
    let turned = (last[3] - first[3]).abs();
    assert!(
        moved > 100.0 || turned > 0.2,
        "moved by {moved} mm, turned by {turned} rad"
    );
}
