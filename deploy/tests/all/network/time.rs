//! Networks in simulated time: what is checked, the options of components, and the patrol in
//! lockstep over shared memory.

use rc_codegen::FileLoader;
use rc_deploy_network::{self as network, Network, Profile};
use rc_diagnostics::{Format, SourceMap, render};
use rc_test_site::other_host;
use rc_test_site::site::{Site, rcdeploy};
use rustix::process::{Pid, Signal, kill_process};
use std::path::Path;

/// How many poses a run has: ten seconds of simulated time.
const POSES: u32 = 200;

/// The patrol in simulated time, as fast as it goes. `head` stands before the components, `all` in
/// each of them, `clock` in the clock. Those that `inside` names are threads of one process.
fn placed(site: &Site, head: &str, inside: &[&str], all: &str, clock: &str) {
    let component = |name: &str, of: &str, more: &str| {
        let process = inside.contains(&name).then_some("process robot;");
        let process = process.unwrap_or_default();
        format!("    Component {name} {{ cdsl \"../{of}/{of}.cdsl\"; {more} {all} {process} }};\n")
    };
    let text = format!(
        "Deployment patrol\n{{\n    {head}\n    time simulated by clock;\n\n{}{}{}{}\n    \
         bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;\n}};\n",
        component("simulator", "simulator", ""),
        component("monitor", "pose_monitor", "config \"monitor.toml\";"),
        component("avoider", "avoider", ""),
        component("clock", "clock", &format!("config \"clock.toml\"; {clock}")),
    );
    site.write_ddsl(&text);
    let clock = "[parameters]\nstep = \"50ms\"\nrate = 0.0\nlimit = \"500ms\"\n";
    site.write("clock.toml", clock);
}

/// The patrol with a process for each component.
fn patrol(site: &Site, all: &str, clock: &str) {
    placed(site, "", &[], all, clock);
}

fn up(site: &Site) {
    let mut up = site.command(&rcdeploy());
    up.args(["up", "--detach", "--profile", "dev"])
        .arg(site.ddsl());
    // Of another host, if there is one.
    up.env("RC_SSH", other_host::ssh(&site.path("")));
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
}

fn down(site: &Site) {
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// The poses of a run, with every digit.
fn run(site: &Site, head: &str, inside: &[&str], all: &str) -> String {
    site.monitor("trace", POSES);
    placed(site, head, inside, all, "");
    up(site);
    site.await_end_of("monitor");
    // The monitor has left in order: time goes on without it.
    let clock = site.ask("clock", "status")["clock"].clone();
    assert_eq!(clock["kind"], "source");
    let tick = clock["tick"].as_u64();
    Site::until("time to go on", || {
        site.ask("clock", "status")["clock"]["tick"].as_u64() > tick
    });
    let status = site.ask("clock", "status");
    let faster = |time: &serde_json::Value| time.as_f64() > status["uptime_s"].as_f64();
    assert!(faster(&status["clock"]["time_s"]), "{status}");
    let table = site.rcdeploy(&["status", &site.network], false);
    assert!(table.stdout.contains("publishes time "), "{table:?}");
    assert!(table.stdout.contains("simulated time "), "{table:?}");
    let trace = std::fs::read_to_string(site.path("trace")).expect("the trace");
    down(site);
    trace
}

#[test]
fn the_patrol_in_lockstep_repeats_exactly() {
    let first = run(&Site::new("time_one"), "", &[], "");
    assert_eq!(first.lines().count(), POSES as usize);
    assert_eq!(first, run(&Site::new("time_two"), "", &[], ""));
}

/// `cargo xtask test` has built the program from `programs/in_one.ddsl`; its name has that of the
/// network.
#[test]
fn the_patrol_in_lockstep_is_the_same_wherever_its_components_run() {
    let apart = run(&Site::new("time_apart"), "", &[], "");
    let mut site = Site::new("patrol_in_one");
    site.network = "patrol_in_one".into();
    let all = ["simulator", "monitor", "avoider", "clock"];
    let elsewhere = "middleware auto; Host away { address \"away\"; };";
    for (head, inside, placed) in [
        ("", &all[..], ""),
        // In the process, and over shared memory to those outside.
        ("middleware auto;", &all, ""),
        ("middleware auto;", &["simulator", "avoider"], ""),
        ("middleware auto;", &["simulator", "monitor"], ""),
        // The process on another host.
        (elsewhere, &all, "host away;"),
    ] {
        let together = run(&site, head, inside, placed);
        assert_eq!(together.lines().count(), POSES as usize);
        assert_eq!(apart, together, "{head} {inside:?}");
    }
    each_middleware_has_its_counter(&site);
}

/// A topic with a subscriber in the process of its publisher, and one outside.
fn each_middleware_has_its_counter(site: &Site) {
    const TOPIC: &str = "FullPoseEstimationPub";
    site.monitor("trace", 0);
    let screen = "middleware auto;\n    Component screen { cdsl \"../pose_monitor/pose_monitor.cdsl\"; };\n    \
                  bind screen.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;";
    placed(site, screen, &["simulator", "monitor"], "", "");
    up(site);
    let counted = || {
        let status = site.ask("simulator", "status");
        let slots = status["slots"].as_array().expect("slots").clone();
        let slot = slots.into_iter().find(|slot| slot["name"] == TOPIC);
        slot.expect("the topic")
    };
    let over = |slot: &serde_json::Value, middleware: &str| {
        let all = slot["transports"].as_array().cloned().unwrap_or_default();
        let own = all.iter().find(|one| one["middleware"] == middleware);
        own.and_then(|own| own["messages"].as_u64()).unwrap_or(0)
    };
    Site::until("samples over both", || {
        let slot = counted();
        over(&slot, "local") > 10 && over(&slot, "iceoryx2") > 10
    });
    // Each sample goes over each of them; one may be under way.
    let slot = counted();
    let sent = slot["sent"].as_u64().expect("a number");
    for middleware in ["local", "iceoryx2"] {
        assert!(over(&slot, middleware).abs_diff(sent) <= 1, "{slot}");
    }
    let status = site.rcdeploy(&["status", &site.network], false);
    assert!(status.stdout.contains("iceoryx2"), "{status:?}");
    down(site);
}

fn pid(site: &Site, name: &str) -> Pid {
    let pid = site.ask(name, "status")["pid"].as_i64().expect("a pid");
    Pid::from_raw(i32::try_from(pid).expect("a pid")).expect("a pid")
}

fn await_event(site: &Site, component: &str, code: &str, text: &str) {
    Site::until(&format!("{code} of {component}, {text}"), || {
        let events = site.events(component);
        events
            .iter()
            .any(|(c, message)| c == code && message.contains(text))
    });
}

fn tick(site: &Site, name: &str) -> u64 {
    let status = site.ask(name, "status");
    status["clock"]["tick"].as_u64().expect("a tick")
}

fn await_ticks(site: &Site) {
    let before = tick(site, "avoider");
    Site::until("ticks", || tick(site, "avoider") > before + 10);
}

#[test]
fn who_hangs_is_named_time_may_be_paused_and_its_source_killed() {
    let site = Site::new("time_troubles");
    site.monitor("trace", 0);
    patrol(&site, "", "restart on_failure;");
    up(&site);
    await_ticks(&site);

    // A follower that hangs.
    let avoider = pid(&site, "avoider");
    kill_process(avoider, Signal::STOP).expect("to stop it");
    await_event(&site, "clock", "time-waits", "waits for avoider");
    site.await_component("clock", |c| c["clock"]["waiting_for"][0] == "avoider");
    kill_process(avoider, Signal::CONT).expect("to go on");
    await_event(&site, "clock", "time-goes-on", "");
    await_ticks(&site);

    // Time stands, and no component hangs. The topic of the monitor is silent, but its deadline is
    // a second of the network's time.
    let command = |verb: &str, component: &str| {
        let ran = site.rcdeploy(&[verb, &site.network, component], false);
        assert_eq!(ran.code, 0, "{ran:?}");
    };
    let set = |value: &str| {
        let args = ["params", "set", &site.network, "clock", value];
        let ran = site.rcdeploy(&args, false);
        assert_eq!(ran.code, 0, "{ran:?}");
    };
    set("paused=true");
    command("stop", "simulator");
    let stands = tick(&site, "clock");
    let before = site.ask("monitor", "status");
    Site::until("a second of the system's clock", || {
        let uptime = |status: &serde_json::Value| status["uptime_s"].as_f64().expect("a time");
        uptime(&site.ask("monitor", "status")) > uptime(&before) + 1.0
    });
    assert_eq!(tick(&site, "clock"), stands);
    assert_eq!(
        site.ask("monitor", "status")["compute"]["count"],
        before["compute"]["count"]
    );
    site.await_component("monitor", |c| c["state"] == "running");
    let is_silent = |(code, _): &(String, String)| code == "silent";
    assert!(!site.events("monitor").iter().any(is_silent));
    set("paused=false");
    let text = "no sample of FullPoseEstimationPub came for";
    await_event(&site, "monitor", "silent", text);
    command("start", "simulator");
    await_event(&site, "monitor", "heard-again", "FullPoseEstimationPub");
    await_ticks(&site);

    // A source that is killed comes back, and time begins again.
    let ticks = tick(&site, "avoider");
    kill_process(pid(&site, "clock"), Signal::KILL).expect("to kill it");
    await_event(&site, "avoider", "time-jumped", "time jumped back from");
    assert!(ticks > 0);
    await_ticks(&site);

    // A stopped source is reported; no component ends.
    command("stop", "clock");
    await_event(&site, "avoider", "time-lost", "its time stands");
    site.await_component("avoider", |c| c["state"] == "running");
    command("start", "clock");
    await_event(&site, "avoider", "time-back", "");
    await_ticks(&site);
    down(&site);
}

/// Reads a network of a source and some followers.
fn load(folder: &Path, body: &str) -> (Option<Network>, String) {
    let write = |name: &str, text: &str| {
        std::fs::write(folder.join(name), text).expect("to write");
    };
    for (name, clause) in [("source", "simulates time;"), ("user", "")] {
        let text =
            format!("Component {name} {{ Communications {{ }}; language rust; {clause} }};\n");
        write(&format!("{name}.cdsl"), &text);
    }
    let body = body
        .replace("$SOURCE", "cdsl \"source.cdsl\"; executable \"x\";")
        .replace("$USER", "cdsl \"user.cdsl\"; executable \"x\";");
    write("n.ddsl", &format!("Deployment n\n{{\n{body}\n}};\n"));
    let mut sources = SourceMap::new();
    let loader = FileLoader::default();
    let (network, found) = network::load(
        &folder.join("n.ddsl"),
        &network::Overrides::default(),
        &mut sources,
        &loader,
    )
    .expect("the files");
    let text = render(&sources, &found, Format::Short);
    let text = text.replace(&format!("{}/", folder.display()), "");
    (network.filter(|_| !found.has_errors()), text)
}

/// The options by which components get their clocks.
fn clocks(body: &str) -> Vec<(String, Vec<String>)> {
    let folder = tempfile::tempdir().expect("a folder");
    let (network, found) = load(folder.path(), body);
    let plan = network.expect(&found).plan(Profile::Dev).expect("a plan");
    let output = |args: &[String]| {
        let pairs = args.windows(2);
        let output = pairs.filter(|pair| pair[0] == "--clock" || pair[0] == "--followers");
        output.flatten().cloned().collect()
    };
    let components = plan.components.iter();
    components
        .map(|c| (c.name.clone(), output(&c.args)))
        .collect()
}

#[test]
fn components_are_told_their_clocks() {
    let output = clocks(
        "time simulated by world.sim;\n    Component a { $USER };\n    \
         Group world { Component sim { $SOURCE }; Component b { $USER }; };\n    \
         Component spare { $SOURCE };\n    Component screen { $USER time system; };",
    );
    let output: Vec<(&str, String)> = output
        .iter()
        .map(|(n, a)| (n.as_str(), a.join(" ")))
        .collect();
    let follows = "--clock simulated:iceoryx2".to_owned();
    assert_eq!(
        output,
        [
            ("a", follows.clone()),
            (
                "world.sim",
                "--clock source --followers a,world-b,spare".to_owned()
            ),
            ("world.b", follows.clone()),
            ("spare", follows),
            ("screen", String::new()),
        ]
    );
    let output = clocks("Component a { $SOURCE time system; };\n    Component b { $USER };");
    assert_eq!(output[0].1, ["--clock", "system"]);
    assert_eq!(output[1].1, [""; 0]);
}

#[track_caller]
fn refused(body: &str, expected: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, found) = load(folder.path(), body);
    assert_eq!(found.trim_end(), expected);
}

/// The clock of the system measures timeouts, also in lockstep.
#[test]
fn a_short_timeout_of_a_follower_is_noted() {
    let noted = |timeout: &str, of: &str| {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).expect("to write");
        };
        write(
            "Bell.idsl",
            "module M { interface Bell { query bool ring(); }; };",
        );
        let component = |name: &str, slots: &str| {
            let text = format!(
                "import \"Bell.idsl\";\nComponent {name} {{ Communications {{ {slots} }}; language rust; }};\n"
            );
            write(&format!("{name}.cdsl"), &text);
        };
        component("ringer", &format!("requires Bell {{ {timeout} }};"));
        component("tower", "implements Bell;");
        let ringer = format!("cdsl \"ringer.cdsl\"; executable \"x\"; {of}");
        let body = format!(
            "time simulated by a;\nComponent a {{ $SOURCE }};\nComponent r {{ {ringer} }};\n\
             Component t {{ cdsl \"tower.cdsl\"; executable \"x\"; }};"
        );
        load(folder.path(), &body).1
    };
    let note = "n.ddsl:5:11: note[timeout-in-lockstep]: a call of `r` to `Bell` ends after 20ms of the clock of the system, also in lockstep: then the next run may differ; its timeout at ringer.cdsl:2:46 (give it a `timeout` of 1s or more)\n";
    assert_eq!(noted("timeout 20ms;", ""), note);
    assert_eq!(noted("timeout 20ms;", "time system;"), "");
    assert_eq!(noted("timeout 1s;", ""), "");
}

/// Over a network, a sample of a subscriber that confirms nothing may come in a later tick.
#[test]
fn subscribers_over_a_network_are_reliable_in_simulated_time() {
    let reliable = |offered: &str, body: &str| {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).expect("to write");
        };
        write(
            "Beat.idsl",
            "module M { interface Beat { void beat(); }; };",
        );
        let publishes = format!("publishes Beat {{ {offered} }};");
        for (name, slots) in [("drum", publishes.as_str()), ("ear", "subscribesTo Beat;")] {
            let text = format!(
                "import \"Beat.idsl\";\nComponent {name} {{ Communications {{ {slots} }}; language rust; }};\n"
            );
            write(&format!("{name}.cdsl"), &text);
        }
        let of = |name: &str| format!("cdsl \"{name}.cdsl\"; executable \"x\";");
        let body = format!(
            "{body}\nComponent a {{ $SOURCE }};\nComponent d {{ {} }};\nComponent e {{ {} }};",
            of("drum"),
            of("ear")
        );
        let (network, found) = load(folder.path(), &body);
        let plan = network.expect(&found).plan(Profile::Dev).expect("a plan");
        let args = &plan.components[2].args;
        let at = args.iter().position(|arg| arg == "--reliable");
        at.map(|at| args[at + 1].clone())
    };
    let simulated = "middleware dds;\ntime simulated by a;";
    let beat = Some("Beat".to_owned());
    assert_eq!(reliable("", simulated), beat);
    assert_eq!(reliable("reliability best_effort;", simulated), None);
    assert_eq!(
        reliable("", "middleware iceoryx2;\ntime simulated by a;"),
        None
    );
    assert_eq!(reliable("", "middleware dds;"), None);
}

#[test]
fn what_is_wrong_with_the_time_is_found() {
    refused(
        "time simulated by b;\nComponent a { $SOURCE };\nComponent b { $USER };",
        "n.ddsl:3:19: error[not-a-time-source]: `b` cannot publish time; it has no clause `simulates time` at user.cdsl:1:11 (add `simulates time;` to the .cdsl of user)",
    );
    refused(
        "time simulated by a;\nComponent a { $SOURCE middleware iceoryx2; };\nComponent b { $USER middleware dds; };",
        "n.ddsl:5:11: error[time-out-of-reach]: `b` cannot hear the time of `a`: it uses dds, the source iceoryx2; the source of time at n.ddsl:3:19 (give both one middleware that connects them, or this one `time system;`)",
    );
    refused(
        "middleware dds;\ntime simulated by a;\nComponent a { $SOURCE };\nComponent b { $USER domain 7; };",
        "n.ddsl:6:11: error[time-out-of-reach]: `b` cannot hear the time of `a`: they are in different domains of dds; the source of time at n.ddsl:4:19 (give both one middleware that connects them, or this one `time system;`)",
    );
    refused(
        "time simulated by a;\nHost robot { address \"10.0.0.2\"; };\nComponent a { $SOURCE middleware iceoryx2; };\nComponent b { $USER host robot; };",
        "n.ddsl:6:11: error[time-out-of-reach]: `b` cannot hear the time of `a`: they are on different hosts, which iceoryx2 does not connect; the source of time at n.ddsl:3:19 (give both one middleware that connects them, or this one `time system;`)",
    );
    refused(
        "time simulated by a;\nComponent a { $SOURCE time system; };",
        "n.ddsl:4:51: error[two-clocks]: `a` publishes the network's time, and has the clock of the system; the source of time at n.ddsl:3:19 (remove one of them)",
    );
    refused(
        "middleware ros2 { use_sim_time true; };\ntime simulated by a;\nComponent a { $SOURCE };",
        "n.ddsl:3:19: error[two-clocks]: `a` has two clocks; the clock of the network at n.ddsl:4:19 (remove `use_sim_time`, or the other one)",
    );
    refused(
        "Component a { $SOURCE };",
        "n.ddsl:3:11: warning[unused-time-source]: `a` simulates time, but the network has the clock of the system (write `time simulated by a;` in the deployment, or `time system;` in the component)",
    );
    let many: String = (0..65)
        .map(|n| format!("Component u{n} {{ $USER }};\n"))
        .collect();
    refused(
        &format!("time simulated by a;\nComponent a {{ $SOURCE }};\n{many}"),
        "n.ddsl:3:19: error[too-many-followers]: 65 components follow the time of `a`, but at most 64 can (give some of them `time system;`)",
    );
}
