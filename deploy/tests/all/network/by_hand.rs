//! The output of a component that is started by hand about its session and its name.

use rc_test_site::site::Site;
use std::process::Command;

#[test]
fn a_component_does_not_take_a_name_of_the_supervisor() {
    let site = Site::new("reserved");
    for option in ["--name", "--network"] {
        for name in ["rcdeploy", "rcdeploy-guard"] {
            let ran = site.component("speech_server", &[option, name]);
            assert_eq!(ran.code, 2, "{ran:?}");
            let told = format!("{option}: the name `{name}` is reserved for rcdeploy");
            assert!(ran.stderr.contains(&told), "{ran:?}");
        }
    }
    site.assert_nothing_left();
}

/// Without a `.ddsl`, its servers are seldom at the default addresses.
#[test]
fn a_component_without_a_supervisor_says_where_it_calls() {
    const HINT: &str = "started without rcdeploy: this component calls servers at ";
    let site = Site::new("hint");
    let bind = format!("Laser={}/front/Laser", site.network);
    let simulator = site.start("simulator", &["--bind", &bind]);
    assert!(!simulator.log().contains(HINT), "{}", simulator.log());
    let avoider = site.start("avoider", &["--bind", &bind]);
    let log = avoider.log();
    let hint = log
        .lines()
        .find(|line| line.contains(HINT))
        .expect("a hint");
    assert!(hint.ends_with("`rcdeploy up`"), "{hint}");
    for called in ["DifferentialRobot", "BatteryStatus"] {
        assert!(
            hint.contains(&format!("`{}/{called}`", site.network)),
            "{hint}"
        );
    }
    // Somebody has said where this one is.
    assert!(!hint.contains("Laser"), "{hint}");
    drop((avoider, simulator));

    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_component("avoider", |one| one["state"] == "running");
    assert!(
        !site.log("avoider").contains(HINT),
        "{}",
        site.log("avoider")
    );
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.await_nothing_left();
}

/// iceoryx2 does not say why it cannot create a data segment.
#[test]
fn a_limit_of_mapped_memory_is_named() {
    const KIB: u32 = 300_000;
    let site = Site::new("mapped");
    let mut command = Command::new("sh");
    let script = format!("ulimit -v {KIB} && exec \"$@\"");
    command.args(["-c", &script, "sh"]);
    command.arg(Site::executable("speech_server"));
    command.args(["--network", &site.network]);
    let ran = site.run(command);
    assert_eq!(ran.code, 3, "{ran:?}");
    for word in [
        "UnableToCreateDataSegment",
        "limits the memory that a process maps to 300000 kB",
        "`ulimit -v unlimited` before it starts",
    ] {
        assert!(ran.stderr.contains(word), "{ran:?}");
    }
    site.assert_nothing_left();
}
