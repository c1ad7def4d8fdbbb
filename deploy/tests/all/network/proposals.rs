//! Parameters that rules of the network read: changes of several components, kept by all or none.

use rc_test_site::site::{CommandOutput, Site};
use rustix::process::{Pid, Signal, kill_process};
use std::time::Duration;

const MOTORS: &str = include_str!("../../../../components/motor_bus/etc/config.toml");

/// How many changes of one network meet the end of a component. The pauses before restarts double.
const ROUNDS: u32 = 8;

/// How many networks; a long run takes more.
fn networks() -> u32 {
    let networks = std::env::var("RC_PROPOSAL_NETWORKS").ok();
    networks.and_then(|count| count.parse().ok()).unwrap_or(1)
}

/// Two buses of motors that may be fast together up to a limit.
fn site(name: &str) -> Site {
    let site = Site::new(name);
    site.write("motors.toml", MOTORS);
    let bus = |name: &str| {
        let cdsl = "cdsl \"../motor_bus/motor_bus.cdsl\"; config \"motors.toml\";";
        format!("    Component {name} {{ {cdsl} restart on_failure backoff 20ms; }};\n")
    };
    let rule = "    require max(left.motors.max_speed) + max(right.motors.max_speed) <= 12 \"too fast together\";\n    require left.period <= 50ms \"too slow\";\n";
    let (left, right) = (bus("left"), bus("right"));
    site.write_ddsl(&format!("Deployment patrol\n{{\n{left}{right}{rule}}};\n"));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site
}

fn set(site: &Site, words: &[&str]) -> CommandOutput {
    site.rcdeploy(&[&["params", "set", &site.network], words].concat(), false)
}

fn speed(site: &Site, bus: &str) -> Option<f64> {
    let path = "motors[1].max_speed";
    let got = site.rcdeploy(&["params", "get", &site.network, bus, path], false);
    let value = got.stdout.trim().strip_prefix("motors[1].max_speed = ")?;
    value.parse().ok()
}

fn speeds(site: &Site) -> (f64, f64) {
    let known = |bus| speed(site, bus).expect("a bus that runs");
    (known("left"), known("right"))
}

fn count(site: &Site, component: &str, code: &str) -> usize {
    let events = site.events(component);
    events.iter().filter(|(c, _)| c == code).count()
}

fn down(site: &Site) {
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn a_rule_of_the_network_holds_while_it_runs() {
    let site = site("ruled");
    // Each alone would break the rule.
    let alone = set(&site, &["left", "motors[1].max_speed=9.5"]);
    assert_ne!(alone.code, 0, "{alone:?}");
    for part in ["too fast together", "9.5"] {
        assert!(alone.stderr.contains(part), "{alone:?}");
    }
    assert_eq!(speeds(&site), (1.5, 1.5));
    let both = [
        "left",
        "motors[1].max_speed=9.5",
        "right",
        "motors[2].max_speed=2",
        "motors[1].max_speed=1",
    ];
    let done = set(&site, &both);
    assert_eq!(done.code, 0, "{done:?}");
    let lines = "left.motors[1].max_speed: 1.5 -> 9.5\nright.motors[1].max_speed: 1.5 -> 1.0\nright.motors[2].max_speed: 3.0 -> 2.0\n";
    assert_eq!(done.stdout, lines);
    assert_eq!(speeds(&site), (9.5, 1.0));

    // Values that the worker or the checker of one component refuses are applied by none.
    let wrong = ["left", "motors[1].max_speed=1", "right", "motors[0].min=3"];
    let refused = set(&site, &wrong);
    assert_ne!(refused.code, 0, "{refused:?}");
    assert!(
        refused.stderr.contains("min must lie below max"),
        "{refused:?}"
    );
    assert_eq!(speeds(&site), (9.5, 1.0));
    // A parameter that no rule reads is the component's own affair.
    assert_eq!(set(&site, &["right", "motors[0].max=5"]).code, 0);
    // Beside one that a rule reads, only the component knows whether it fits.
    let beside = ["right", "motors[0].zero=4", "motors[0].max_speed=2"];
    let done = set(&site, &beside);
    assert_eq!(done.code, 0, "{done:?}");
    // A request to the component itself is refused.
    let changes = serde_json::json!({"changes": {"motors[1].max_speed": 9.0}});
    let changed = site.tell("left", "parameters_set", &changes);
    let period = site.tell("left", "period", &serde_json::json!({"ms": 30.0}));
    assert!(changed.is_null() && period.is_null(), "{changed} {period}");
    let other = site.tell("right", "period", &serde_json::json!({"ms": 30.0}));
    assert!(!other.is_null(), "no rule reads its period");
    assert_eq!(speeds(&site), (9.5, 1.0));

    // A stopped component begins with what the rules have read.
    for command in ["stop", "start"] {
        let done = site.rcdeploy(&[command, &site.network, "left"], false);
        assert_eq!(done.code, 0, "{done:?}");
    }
    assert_eq!(speeds(&site), (9.5, 1.0));
    let missing = set(
        &site,
        &[
            "left",
            "motors[1].max_speed=1",
            "rihgt",
            "motors[1].max_speed=1",
        ],
    );
    assert_ne!(missing.code, 0);
    assert!(missing.stderr.contains("right"), "{missing:?}");
    down(&site);
}

#[test]
fn a_component_that_is_killed_in_a_change_leaves_both_with_the_old_or_both_with_the_new_values() {
    let mut random = 0x2545_f491_u32;
    let mut next = |below: u32| {
        random ^= random << 13;
        random ^= random >> 17;
        random ^= random << 5;
        random % below
    };
    let (mut kept, mut undone) = (0, 0);
    for _ in 0..networks() {
        let of_network = kept_beside_kills(&mut next);
        kept += of_network.0;
        undone += of_network.1;
    }
    let changes = networks() * ROUNDS;
    println!("{kept} of {changes} changes were kept, {undone} taken back with an event");
    // Few kills meet the moment in which one component has changed.
    assert!(undone > 0 || changes < 1000);
}

/// How many of the changes were kept, and how many were taken back after a component had changed.
fn kept_beside_kills(next: &mut impl FnMut(u32) -> u32) -> (u32, usize) {
    let site = site("halfway");
    let (mut old, mut kept) = (speeds(&site), 0);
    for round in 0..ROUNDS {
        // The sum tells whether both belong to one change.
        let left = f64::from(round % 7) + 0.25;
        let new = (left, 9.0 - left - 0.5);
        let victim = ["left", "right"][next(2) as usize];
        let before = count(&site, victim, "ready");
        let pid = site.ask(victim, "status")["pid"].as_i64();
        let pid = pid
            .and_then(|pid| Pid::from_raw(pid as i32))
            .expect("a pid");
        let pause = Duration::from_micros(u64::from(next(120_000)));
        let words = [
            format!("motors[1].max_speed={}", new.0),
            format!("motors[1].max_speed={}", new.1),
        ];
        let set = std::thread::scope(|scope| {
            scope.spawn(|| {
                // The moment is random; nothing is waited for.
                std::thread::sleep(pause);
                kill_process(pid, Signal::KILL).expect("to kill it");
            });
            set(&site, &["left", &words[0], "right", &words[1]])
        });
        Site::until("it is ready again", || {
            count(&site, victim, "ready") > before
        });
        Site::until("both reply", || {
            ["left", "right"]
                .iter()
                .all(|bus| speed(&site, bus).is_some())
        });
        let now = speeds(&site);
        assert!(
            now == old || now == new,
            "{round}: {old:?} {new:?} {now:?} {set:?}"
        );
        // A change that was reported as done stays.
        assert!(set.code != 0 || now == new, "{round}: {now:?} {set:?}");
        kept += u32::from(now == new);
        old = now;
    }
    let undisturbed = [
        "left",
        "motors[1].max_speed=4",
        "right",
        "motors[1].max_speed=5",
    ];
    let set = set(&site, &undisturbed);
    assert_eq!((set.code, speeds(&site)), (0, (4.0, 5.0)), "{set:?}");
    let undone = site.count_in_log("rcdeploy", "\"parameters-undone\"");
    down(&site);
    (kept, undone)
}
