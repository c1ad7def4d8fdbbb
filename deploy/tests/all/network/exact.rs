//! Exact recordings: the patrol in simulated time lives again, and a run that differs is found.

use rc_test_site::site::{CommandOutput, Site};
use std::path::{Path, PathBuf};

/// How many poses a run has: twenty seconds of simulated time.
const POSES: u32 = 400;

/// The components that are recorded.
const RECORDED: [&str; 3] = ["simulator", "avoider", "monitor"];

fn patrol(site: &Site) {
    let exact = "record { exact; };";
    let text = format!(
        "Deployment patrol\n{{\n    time simulated by clock;\n\n    \
         Component simulator {{ cdsl \"../simulator/simulator.cdsl\"; {exact} }};\n    \
         Component monitor {{ cdsl \"../pose_monitor/pose_monitor.cdsl\"; config \"monitor.toml\"; {exact} }};\n    \
         Component avoider {{ cdsl \"../avoider/avoider.cdsl\"; {exact} }};\n    \
         Component clock {{ cdsl \"../clock/clock.cdsl\"; config \"clock.toml\"; {exact} }};\n\n    \
         bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;\n}};\n"
    );
    site.write_ddsl(&text);
    let clock = "[parameters]\nstep = \"50ms\"\nrate = 0.0\nlimit = \"500ms\"\n";
    site.write("clock.toml", clock);
}

fn recording(site: &Site, component: &str) -> PathBuf {
    let folder = site.path("state/robocomp").join(&site.network);
    folder.join(format!("{component}.exact.mcap"))
}

fn replay(site: &Site, file: &Path) -> CommandOutput {
    site.rcdeploy(&["replay", "--check", &file.display().to_string()], false)
}

#[test]
fn the_patrol_lives_again_exactly() {
    let site = Site::new("exact");
    site.monitor("trace", POSES);
    patrol(&site);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_end_of("monitor");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    for component in RECORDED.into_iter().chain(["clock"]) {
        let ran = replay(&site, &recording(&site, component));
        assert_eq!(ran.code, 0, "{component}: {ran:?}");
        assert!(ran.stdout.contains("the run is the same"), "{ran:?}");
        println!("{}", ran.stdout);
    }

    // By the name of the network.
    let ran = site.rcdeploy(
        &["replay", &site.network, "avoider", "--format", "json"],
        false,
    );
    assert_eq!(ran.code, 0, "{ran:?}");
    let report: serde_json::Value = serde_json::from_str(&ran.stdout).expect("one document");
    assert_eq!(report["equal"], true);
    assert!(
        report["compared"].as_u64() > Some(u64::from(POSES)),
        "{report}"
    );

    // An avoider with one other constant: its first effect is found, with both values.
    let file = recording(&site, "avoider").display().to_string();
    let program = Site::executable("other_avoider").display().to_string();
    let ran = site.rcdeploy(&["replay", "--check", &file, "--program", &program], false);
    assert_eq!(ran.code, 1, "{ran:?}");
    assert!(ran.stdout.contains("the run differs in turn"), "{ran:?}");
    let line = |word: &str| {
        let mut lines = ran.stdout.lines();
        let line = lines.find_map(|line| line.trim().strip_prefix(word));
        line.unwrap_or_else(|| panic!("{ran:?}")).trim().to_owned()
    };
    let (recorded, now) = (line("recorded"), line("now"));
    let begin = "send DifferentialRobot.setSpeedBase { adv: ";
    assert!(
        recorded.starts_with(begin) && now.starts_with(begin),
        "{ran:?}"
    );
    assert_ne!(recorded, now);

    // A recording that was cut ends before its end, and is right until there.
    let other = site.path("other.mcap");
    let bytes = std::fs::read(recording(&site, "avoider")).expect("a recording");
    std::fs::write(&other, &bytes[..bytes.len() / 2]).expect("to write");
    // A file from elsewhere may name any program.
    let ran = replay(&site, &other);
    assert_eq!(ran.code, 2, "{ran:?}");
    assert!(
        ran.stderr.contains("if you trust it, add --program"),
        "{ran:?}"
    );
    let (file, program) = (other.display().to_string(), Site::executable("avoider"));
    let program = program.display().to_string();
    let ran = site.rcdeploy(&["replay", "--check", &file, "--program", &program], false);
    assert_eq!(ran.code, 0, "{ran:?}");
    assert!(ran.stderr.contains("ends before its end"), "{ran:?}");
    let ran = site.rcdeploy(&["bag", "info", &other.display().to_string()], false);
    assert_eq!(ran.code, 0, "{ran:?}");
    assert!(ran.stdout.contains("incomplete "), "{ran:?}");

    // Not a recording of this component.
    let file = recording(&site, "avoider").display().to_string();
    let ran = site.rcdeploy(&["replay", &file, "avoidr"], false);
    assert_eq!(ran.code, 1, "{ran:?}");
    assert!(ran.stderr.contains("did you mean `avoider`?"), "{ran:?}");
    let simulator = Site::executable("simulator").display().to_string();
    let ran = site.rcdeploy(&["replay", &file, "--program", &simulator], false);
    assert_eq!(ran.code, 3, "{ran:?}");
    assert!(
        ran.stderr.contains("the recording is of `avoider`"),
        "{ran:?}"
    );
    let ran = site.rcdeploy(&["replay", &site.ddsl().display().to_string()], false);
    assert_eq!(ran.code, 2, "{ran:?}");
}

/// Two components that ask each other and do not wait, in lockstep: each call ends in the tick in
/// which it was started, so that the time of the last one is known. The run lives again.
#[test]
fn started_calls_live_again_exactly() {
    let site = Site::new("started");
    let program = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/programs/asker/asker.cdsl"
    );
    let askers = ["left", "right"].map(|name| {
        format!("    Component {name} {{ cdsl \"{program}\"; record {{ exact; }}; }};\n")
    });
    let binds = [("left", "right"), ("right", "left")].map(|(a, b)| {
        format!("    bind {a}.other -> {b}.near;\n    bind {a}.far_other -> {b}.far;\n")
    });
    site.write_ddsl(&format!(
        "Deployment patrol\n{{\n    time simulated by clock;\n{}    \
         Component clock {{ cdsl \"../clock/clock.cdsl\"; config \"clock.toml\"; }};\n{}    \
         domain 229;\n}};\n",
        askers.concat(),
        binds.concat()
    ));
    let clock = "[parameters]\nstep = \"50ms\"\nrate = 0.0\nlimit = \"5s\"\n";
    site.write("clock.toml", clock);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    // Twenty computes start a call of each slot; the next one takes the last result.
    for name in ["left", "right"] {
        site.await_in_log(name, "both others have answered 20 times by 1050 ms");
    }
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    for name in ["left", "right"] {
        let ran = replay(&site, &recording(&site, name));
        assert_eq!(ran.code, 0, "{name}: {ran:?}");
        assert!(ran.stdout.contains("the run is the same"), "{ran:?}");
    }
}

/// In lockstep, a proxy passes the calls and the poses of a recorded group in the same ticks of each
/// run, and both sides live again.
#[test]
fn a_group_with_a_proxy_lives_again_exactly() {
    let run = |name: &str| {
        let site = Site::new(name);
        site.monitor("trace", 100);
        let exact = "record { exact; };";
        site.write_ddsl(&format!(
            "Deployment patrol\n{{\n    time simulated by clock;\n    Group robot {{\n        \
             Component simulator {{ cdsl \"../simulator/simulator.cdsl\"; {exact} }};\n        \
             export Laser, DifferentialRobot, BatteryStatus, FullPoseEstimationPub;\n        proxy;\n    }};\n    \
             Component monitor {{ cdsl \"../pose_monitor/pose_monitor.cdsl\"; config \"monitor.toml\"; }};\n    \
             Component avoider {{ cdsl \"../avoider/avoider.cdsl\"; {exact} }};\n    \
             Component clock {{ cdsl \"../clock/clock.cdsl\"; config \"clock.toml\"; }};\n}};\n"
        ));
        let clock = "[parameters]\nstep = \"50ms\"\nrate = 0.0\nlimit = \"5s\"\n";
        site.write("clock.toml", clock);
        let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
        assert_eq!(up.code, 0, "{up:?}");
        site.await_end_of("monitor");
        assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
        site.assert_nothing_left();
        // The proxy itself has none.
        let none = site.rcdeploy(&["replay", &site.network, "robot"], false);
        let text = "no exact recording of `robot`";
        assert!(none.code == 2 && none.stderr.contains(text), "{none:?}");
        for component in ["robot.simulator", "avoider"] {
            let ran = replay(&site, &recording(&site, component));
            assert_eq!(ran.code, 0, "{component}: {ran:?}");
            assert!(ran.stdout.contains("the run is the same"), "{ran:?}");
        }
        std::fs::read_to_string(site.path("trace")).expect("a trace")
    };
    let [first, second] = ["exact_proxy_one", "exact_proxy_two"].map(run);
    assert!(first.lines().count() >= 100, "{first}");
    assert_eq!(first, second);
}
