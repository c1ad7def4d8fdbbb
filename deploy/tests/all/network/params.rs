//! `rcdeploy params` with real components: changes, errors, saving.

use rc_codegen::FileLoader;
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rc_test_site::site::{CommandOutput, PATROL, Site};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use std::fs;

/// The configuration of the avoider, with comments everywhere.
const CONFIG: &str = "# Mine.
[component]\t# as it was
period = \"20ms\"

[parameters]
lockstep = false
# Not nearer!
safe_distance = 600   # mm
turn_speed=0.8
# The end.
";

/// A network in which the avoider has its own configuration beside a copy of its description.
fn site(name: &str) -> Site {
    let site = Site::new(name);
    site.copy_component("avoider");
    fs::create_dir_all(site.path("networks/avoider/etc")).expect("a folder");
    site.write("avoider/etc/config.toml", CONFIG);
    let monitor = "[component]\nperiod = \"20ms\"\n[parameters]\nsvg = \"\"\n";
    site.write("monitor.toml", monitor);
    let with = |text: &str, name: &str, config: &str| {
        let cdsl = format!("cdsl \"../{name}/{name}.cdsl\";");
        assert!(text.contains(&cdsl), "{cdsl}");
        text.replace(&cdsl, &format!("{cdsl} config \"{config}\";"))
    };
    let text = with(PATROL, "avoider", "avoider/etc/config.toml");
    site.write_ddsl(&with(&text, "pose_monitor", "monitor.toml"));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site
}

fn params(site: &Site, args: &[&str]) -> CommandOutput {
    site.rcdeploy(&[&["params"], args].concat(), false)
}

/// The number of poses in the last line of the monitor, and the position in it.
fn last_place(site: &Site) -> (usize, Option<String>) {
    let log = site.log("monitor");
    // Ignore an incomplete last line.
    let mut lines = log
        .split_inclusive('\n')
        .rev()
        .filter(|l| l.ends_with('\n'));
    let output = lines.find_map(|line| {
        let (place, rest) = line.split_once("pose x=")?.1.split_once(" heading=")?;
        let count = rest.trim().rsplit_once("poses=")?.1.parse().ok()?;
        Some((count, Some(place.to_owned())))
    });
    output.unwrap_or_default()
}

fn down(site: &Site) {
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn a_parameter_is_changed_and_saved_at_run_time() {
    let site = site("params");
    let net = site.network.as_str();
    let file = site.path("networks/avoider/etc/config.toml");
    let table = params(&site, &[net, "avoider"]);
    assert_eq!(table.code, 0, "{table:?}");
    let row = "safe_distance  600.0  700.0    float, from 150 to 3000, in mm  now";
    assert!(table.stdout.contains(row), "{table:?}");

    // Only this network runs, so its name may be left out.
    assert_eq!(params(&site, &["avoider"]).stdout, table.stdout);
    let one = params(&site, &["get", "avoider", "safe_distance"]);
    assert_eq!(one.stdout, "safe_distance = 600.0\n", "{one:?}");
    for all in [&[][..], &[net]] {
        let all = params(&site, all);
        let parts = ["avoider\n  parameter ", row, "\nmonitor\n"];
        assert!(
            parts.iter().all(|part| all.stdout.contains(part)),
            "{all:?}"
        );
    }
    let logs = site.rcdeploy(&["logs", "avoider", "-n", "1"], false);
    assert_eq!((logs.code, logs.stdout.lines().count()), (0, 1), "{logs:?}");
    // A mistyped name is not an argument.
    let mistyped = format!("{net}x");
    for args in [&["list", &mistyped][..], &["params", &mistyped]] {
        let refused = site.rcdeploy(args, false);
        assert_eq!(refused.code, 3, "{refused:?}");
        let wanted = format!("network {mistyped} is not up; did you mean `{net}`?");
        assert!(refused.stderr.contains(&wanted), "{refused:?}");
    }

    // A dump, and a change that it undoes.
    let kept = site.path("kept.toml");
    let kept = kept.to_str().expect("a path");
    let dump = params(&site, &["dump", "-o", kept]);
    assert_eq!((dump.code, dump.stdout.as_str()), (0, ""), "{dump:?}");
    let text = fs::read_to_string(kept).expect("the file");
    assert!(
        text.contains("\n[avoider]\n") && text.contains("\nsafe_distance = 600.0\n"),
        "{text}"
    );
    assert_eq!(params(&site, &["dump", net]).stdout, text);
    let set = ["set", net, "avoider", "speed=310", "turn_speed=0.7"];
    let set = params(&site, &set);
    assert_eq!(set.code, 0, "{set:?}");
    let load = params(&site, &["load", net, kept]);
    assert_eq!(load.code, 0, "{load:?}");
    assert_eq!(
        load.stdout,
        "speed: 310.0 -> 400.0\nturn_speed: 0.7 -> 0.8\n"
    );
    let again = params(&site, &["load", kept]);
    assert_eq!(again.stdout, "these are the values already\n", "{again:?}");
    // All or nothing, and what is not running is named.
    for (name, text, reason) in [
        (
            "wide.toml",
            "[avoider]\nspeed = 1\nsped = 1\n",
            "did you mean `speed`?",
        ),
        (
            "who.toml",
            "[avoider]\nspeed = 1\n[avoidr]\nspeed = 1\n",
            "no component avoidr runs",
        ),
        (
            "torn.toml",
            "[avoider\n",
            "torn.toml: TOML parse error at line 1",
        ),
    ] {
        let file = site.write(name, text);
        let refused = params(&site, &["load", net, file.to_str().expect("a path")]);
        assert_ne!(refused.code, 0, "{refused:?}");
        assert!(refused.stderr.contains(reason), "{refused:?}");
    }
    let one = params(&site, &["get", "avoider", "speed"]);
    assert_eq!(one.stdout, "speed = 400.0\n", "{one:?}");

    let logs = [
        "logs", net, "monitor", "--grep", "POSE x=", "--grep", "pose x=",
    ];
    let logs = site.rcdeploy(
        &[&logs[..], &["--since", "10min", "--level", "info"]].concat(),
        false,
    );
    assert!(
        logs.stdout.lines().all(|line| line.contains("pose x=")),
        "{logs:?}"
    );
    let ever = site.rcdeploy(&["logs", net, "monitor", "--since", "1d"], false);
    assert!(
        ever.code == 2 && ever.stderr.contains("as in `90s`"),
        "{ever:?}"
    );
    let errors = site.rcdeploy(&["logs", "monitor", "--level", "error"], false);
    assert_eq!((errors.code, errors.stdout.as_str()), (0, ""), "{errors:?}");

    // With speed 0, the poses repeat.
    let stand = params(&site, &["set", net, "avoider", "speed=0", "turn_speed=0.1"]);
    assert_eq!(stand.code, 0, "{stand:?}");
    assert_eq!(
        stand.stdout,
        "speed: 400.0 -> 0.0\nturn_speed: 0.8 -> 0.1\n"
    );
    let place = || last_place(&site);
    Site::until("the robot stands", || {
        let before = place();
        Site::until("more poses", || place().0 > before.0 + 3);
        before.1.is_some() && place().1 == before.1
    });
    let set = [
        "set",
        net,
        "avoider",
        "speed=300",
        "safe_distance=650.5",
        "--format",
        "json",
    ];
    let drive = params(&site, &set);
    let changed: Value = serde_json::from_str(&drive.stdout).expect("one JSON document");
    assert_eq!(
        changed["changed"][1],
        json!({ "path": "speed", "old": 0.0, "new": 300.0 })
    );
    assert_eq!(fs::read_to_string(&file).expect("the file"), CONFIG);
    let standing = place();
    Site::until("the robot drives", || place().1 != standing.1);

    // Also with the network's file.
    let ddsl = site.ddsl();
    let ddsl = ddsl.to_str().expect("a path");
    let saved = params(&site, &["save", ddsl, "avoider"]);
    assert_eq!(saved.code, 0, "{saved:?}");
    assert!(
        saved.stdout.contains("safe_distance: 600.0 -> 650.5"),
        "{saved:?}"
    );
    let expected = CONFIG
        .replace("600 ", "650.5 ")
        .replace("turn_speed=0.8\n", "turn_speed=0.1\nspeed = 300.0\n");
    assert_eq!(fs::read_to_string(&file).expect("the file"), expected);
    let again = params(&site, &["save", net, "avoider"]);
    assert!(again.stdout.contains("nothing has changed"), "{again:?}");

    // The saved file is valid, and the next start uses it.
    let (mut sources, mut found) = (SourceMap::new(), Diagnostics::new());
    let loader = FileLoader::new(&[]);
    rcgen::check::file(&file, false, &mut sources, &loader, &[], &mut found).expect("a file");
    assert_eq!(render(&sources, &found, Format::Short), "");
    down(&site);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let get = params(&site, &["get", net, "avoider", "speed", "turn_speed"]);
    assert_eq!(get.stdout, "speed = 300.0\nturn_speed = 0.1\n", "{get:?}");
    down(&site);
}

#[test]
fn invalid_changes_are_reported_and_not_applied() {
    let site = site("refused");
    let net = site.network.as_str();
    let wrong = [
        "set",
        net,
        "avoider",
        "speed=300",
        "sped=1",
        "safe_distance=9",
        "turn_speed=x",
    ];
    let wrong = params(&site, &wrong);
    assert_eq!(wrong.code, 1, "{wrong:?}");
    for expected in [
        "error[unknown-parameter]: unknown parameter `sped` (did you mean `speed`?)",
        "error[out-of-range]: `safe_distance` cannot be the number 9 (allowed is a number of 32 bits, from 150 to 3000, in mm)",
        "error[wrong-type]: `turn_speed` cannot be the string \"x\"",
    ] {
        assert!(
            wrong.stderr.contains(expected),
            "{expected} is missing in {}",
            wrong.stderr
        );
    }
    let get = params(&site, &["get", net, "avoider", "speed"]);
    assert_eq!(get.stdout, "speed = 400.0\n", "{get:?}");
    let get = params(&site, &["get", net, "avoider", "sped"]);
    assert_eq!(get.code, 1, "{get:?}");
    // The simulator's parameters are fixed at its start.
    let fixed = params(&site, &["set", net, "simulator", "lockstep=true"]);
    assert_eq!(fixed.code, 1, "{fixed:?}");
    assert!(fixed.stderr.contains("mark it `T`"), "{fixed:?}");
    // Another program has edited the file meanwhile.
    let file = site.path("networks/avoider/etc/config.toml");
    let edited = CONFIG.replace("600 ", "550 ");
    assert_eq!(
        params(&site, &["set", net, "avoider", "safe_distance=700"]).code,
        0
    );
    fs::write(&file, &edited).expect("to write");
    let conflict = params(&site, &["save", net, "avoider"]);
    assert_eq!(conflict.code, 1, "{conflict:?}");
    assert!(
        conflict.stderr.contains("is 550.0 in the file now"),
        "{conflict:?}"
    );
    assert_eq!(fs::read_to_string(&file).expect("the file"), edited);

    for usage in [
        &["set", net, "avoider", "speed"][..],
        &["set", net, "avoider", "a=1", "a=2"],
    ] {
        assert_eq!(params(&site, usage).code, 2, "{usage:?}");
    }
    let nobody = params(&site, &[net, "avoidr"]);
    assert_eq!(nobody.code, 3, "{nobody:?}");
    assert!(nobody.stderr.contains("there are: avoider, "), "{nobody:?}");
    down(&site);
    let nobody = params(&site, &[net, "avoider"]);
    assert_eq!(nobody.code, 3, "{nobody:?}");
}

#[test]
fn a_component_that_was_started_by_hand_is_changed_too_and_one_that_is_stopped_does_not_answer() {
    let site = Site::new("byhand");
    let avoider = site.start("avoider", &[]);
    let set = params(&site, &["set", &site.network, "avoider", "speed=200"]);
    assert_eq!(
        (set.code, set.stdout.as_str()),
        (0, "speed: 400.0 -> 200.0\n"),
        "{set:?}"
    );
    let pid = avoider.pid();
    kill_process(pid, Signal::STOP).expect("to stop it");
    let silent = params(&site, &["get", &site.network, "avoider", "speed"]);
    kill_process(pid, Signal::CONT).expect("to let it go on");
    assert_eq!(silent.code, 3, "{silent:?}");
    assert!(silent.stderr.contains("has not replied"), "{silent:?}");
    kill_process(pid, Signal::TERM).expect("to end it");
    assert_eq!(avoider.end(), Some(0));
}

#[test]
fn a_component_with_an_unwritable_log_works() {
    let site = Site::new("unlogged");
    let full = || {
        fs::File::options()
            .write(true)
            .open("/dev/full")
            .expect("the device")
    };
    let mut command = site.command(&Site::executable("avoider"));
    command.args(["--network", &site.network]);
    let mut avoider = command
        .stdout(full())
        .stderr(full())
        .spawn()
        .expect("a component");
    let socket = site.directory().socket("avoider");
    Site::until("its socket", || {
        std::os::unix::net::UnixStream::connect(&socket).is_ok()
    });
    // It reports that its server is absent.
    Site::until("complaints", || {
        site.ask("avoider", "status")["compute"]["errors"].as_u64() > Some(2)
    });
    let asked = site.rcdeploy(&["emergency", &site.network, "avoider", "on"], false);
    assert_eq!(asked.code, 0, "{asked:?}");
    Site::until("its emergency", || {
        site.ask("avoider", "status")["state"] == "emergency"
    });
    kill_process(Pid::from_child(&avoider), Signal::TERM).expect("to end it");
    assert_eq!(avoider.wait().expect("it ended").code(), Some(0));
}
