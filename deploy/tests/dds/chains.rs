//! A chain over five components that call each other, over each middleware. Over DDS and ROS 2,
//! three of them are on another host, whose clock is two seconds ahead. Each message takes as long
//! as its components note, and none is reported that was not late. Then something is slow, stands
//! still, or is started again, and the right component is named.

mod witness;

use crate::remote::component;
use rc_test_site::other_host;
use rc_test_site::site::Site;
use rc_test_support::python::skipped;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};
use witness::Witness;

/// How long each component works, in milliseconds: those behind the one that begins.
const WORK: [(&str, u64); 5] = [("b", 2), ("c", 4), ("d", 3), ("e", 5), ("f", 2)];
/// How far the clock of the other host is ahead, in seconds.
const AHEAD: u32 = 2;
/// The time between two looks at all messages: fewer come than the supervisor keeps.
const LOOK: Duration = Duration::from_secs(30);

/// Limits and lengths of a run.
struct Run {
    name: &'static str,
    /// The clause of the network.
    middleware: &'static str,
    has_other_host: bool,
    /// In milliseconds: `within`, and by how much one component becomes slower.
    within: u64,
    slower: u64,
    /// How long no report may be false. `None`: a few seconds, on a computer that does much else.
    quiet: Option<Duration>,
}

/// Where the messages come from is `a`; it calls `b`, which calls `c`, and so on.
fn network(site: &Site, run: &Run) -> String {
    let neighbour = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/programs/neighbour/neighbour.cdsl"
    );
    let head = if run.has_other_host {
        "Host robot { address \"robot\"; };"
    } else {
        ""
    };
    let notes = |name: &str| {
        let file = witness::file(site, name);
        file.map_or_else(String::new, |file| {
            format!("witness \"{}\"; ", file.display())
        })
    };
    let mut text = format!(
        "Deployment {}\n{{\n    {} {head}\n    Component a {{ cdsl \"{neighbour}\"; parameters {{ does \"call\"; {}}}; }};\n",
        site.network,
        run.middleware,
        notes("a")
    );
    let mut before = "a";
    for (name, work) in WORK {
        let does = if name == "f" { "" } else { "call back" };
        let is_away = run.has_other_host && ["d", "e", "f"].contains(&name);
        let host = if is_away { "host robot; " } else { "" };
        text += &format!(
            "    Component {name} {{ cdsl \"{neighbour}\"; {host}restart on_failure backoff 100ms; \
                 parameters {{ does \"{does}\"; delay {work}ms; {}}}; }};\n    \
             bind {before}.other -> {name}.BatteryStatus;\n",
            notes(name)
        );
        before = name;
    }
    // It calls nothing.
    text + &format!(
        "    bind f.other -> a.BatteryStatus;\n    \
             Chain power {{ from a.other.getBatteryState; to f.BatteryStatus.getBatteryState; \
             within {}ms; }};\n}};\n",
        run.within
    )
}

fn chain(site: &Site) -> Value {
    let shown = site.rcdeploy(&["chains", &site.network, "--format", "json"], false);
    assert_eq!(shown.code, 0, "{shown:?}");
    let document: Value = serde_json::from_str(&shown.stdout).expect("JSON");
    document["chains"][0].clone()
}

fn complete(site: &Site) -> u64 {
    chain(site)["complete"].as_u64().expect("a count")
}

/// Waits for so many more messages that come to the end.
fn await_messages(site: &Site, more: u64) {
    let before = complete(site);
    Site::until("messages on the chain", || complete(site) >= before + more);
}

/// The events of the chain so far, each as its code and its text.
fn events(site: &Site) -> Vec<(String, String)> {
    let log = site.log("rcdeploy");
    let lines = log.lines().filter(|line| line.contains("chain `power`"));
    let codes = ["chain-late", "chain-old", "chain-broken", "chain-in-time"];
    let found = lines.filter_map(|line| {
        let code = codes.iter().find(|code| line.contains(**code))?;
        Some(((*code).to_owned(), line.to_owned()))
    });
    found.collect()
}

/// Waits for an event after the first `known` ones, and returns its text.
fn await_event(site: &Site, known: usize, code: &str) -> String {
    let find = || {
        let all = events(site).into_iter().skip(known);
        all.into_iter().find(|(of, _)| of == code)
    };
    Site::until(code, || find().is_some());
    find().map(|(_, text)| text).unwrap_or_default()
}

/// The times of a quiet network are those of the components, and their sum is the whole.
fn the_times_are_right(site: &Site, run: &Run) {
    let chain = chain(site);
    let p50 = |of: &Value| of["p50_ms"].as_f64().expect("a time");
    let error = chain["uncertainty_ms"].as_f64().expect("an error");
    // Clocks that are apart would be in all times.
    let (most_error, most_more) = match run.quiet {
        Some(_) => (1.0, 20.0),
        None => (100.0, 500.0),
    };
    assert!(error <= most_error, "the stated error: {chain}");
    assert_eq!(error > 0.0, run.has_other_host, "{chain}");
    assert_eq!(chain["missing"], json!([]), "{chain}");
    let hops = chain["hops"].as_array().expect("hops");
    assert_eq!(hops.len(), WORK.len());
    for (hop, (name, work)) in hops.iter().zip(WORK) {
        assert_eq!(hop["component"], name);
        let known = work as f64;
        assert!(p50(&hop["work"]) >= known - error, "{hop}");
        assert!(p50(&hop["work"]) < known + most_more, "{hop}");
        let way = p50(&hop["way"]);
        assert!(way > -error && way < most_more, "{hop}");
        assert_eq!(hop["lost"], 0, "{hop}");
        assert_eq!(hop["swapped"], 0, "{hop}");
    }
    // Medians of parts are not parts of the median, but near.
    let sum: f64 = hops.iter().map(|hop| p50(&hop["times"])).sum();
    let whole = p50(&chain["times"]);
    assert!((sum - whole).abs() <= 1.0 + 0.2 * whole, "{sum}: {chain}");
    let shortest: u64 = WORK.iter().map(|(_, work)| work).sum();
    assert!(whole >= shortest as f64 - error, "{chain}");
}

fn send(site: &Site, name: &str, signal: Signal) {
    let pid = component(site, name)["pid"].as_i64();
    let pid = pid
        .and_then(|pid| Pid::from_raw(pid as i32))
        .expect("a process");
    kill_process(pid, signal).expect("to signal it");
}

/// Waits until the chain is in time after the first `known` events.
fn await_in_time(site: &Site, known: usize) {
    await_event(site, known, "chain-in-time");
    Site::until("no condition", || chain(site)["conditions"] == json!([]));
}

/// No report is false, and none is missing: the components themselves note how long each message
/// takes. So the computer may do other things meanwhile.
fn no_alarm_is_false(site: &Site, run: &Run) {
    let mut witness = Witness::new(site, run.within);
    let begun = Instant::now();
    witness.look();
    while let Some(left) = run.quiet.and_then(|all| all.checked_sub(begun.elapsed())) {
        std::thread::sleep(left.min(LOOK));
        witness.look();
    }
    witness.judge();
    Site::until("no condition", || chain(site)["conditions"] == json!([]));
}

fn runs(test: &str, run: &Run) {
    let site = Site::new(run.name);
    site.write_ddsl(&network(&site, run));
    let mut up = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    up.args(["up", "--build", "--detach", "--profile", "dev"]);
    up.arg(site.ddsl()).env("CARGO_NET_OFFLINE", "true");
    up.env("ROS_LOCALHOST_ONLY", "1");
    if run.has_other_host {
        let Some(ssh) = other_host::ssh_ahead(&site.path(""), AHEAD) else {
            return skipped(test, "the system has no clocks of their own for processes");
        };
        up.env("RC_SSH", ssh);
    }
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
    Site::until("messages on the chain", || complete(&site) > 20);
    await_messages(&site, 50);
    no_alarm_is_false(&site, run);
    the_times_are_right(&site, run);

    // One component is slower.
    let slower = |ms: u64| json!({"changes": {"delay": format!("{ms}ms")}});
    let work = WORK[2].1;
    let mut attempts = 0;
    Site::until("d to be named", || {
        attempts += 1;
        let known = events(&site).len();
        site.tell("d", "parameters_set", &slower(work + run.slower));
        let late = await_event(&site, known, "chain-late");
        site.tell("d", "parameters_set", &slower(work));
        await_in_time(&site, known);
        let is_named = late.contains(" of them at d (");
        // Just then, the computer may have let another one stand still.
        assert!(attempts < 3 || run.quiet.is_none() || is_named, "{late}");
        is_named
    });

    // One stands still, and goes on.
    let known = events(&site).len();
    send(&site, "e", Signal::STOP);
    let broken = await_event(&site, known, "chain-broken");
    assert!(broken.contains(": e "), "{broken}");
    send(&site, "e", Signal::CONT);
    await_in_time(&site, known);

    // One is killed, with the messages that it has, and started again.
    send(&site, "c", Signal::KILL);
    let restarts = |at: usize| chain(&site)["hops"][at]["restarts"].as_u64();
    Site::until("the restart to be seen", || restarts(1) == Some(1));
    await_messages(&site, 20);
    // The one that stood still did not answer, so that following it began again, too.
    for at in [0, 2, 4] {
        assert_eq!(restarts(at), Some(0), "{}", chain(&site));
    }
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.await_nothing_left();
}

/// What a computer that builds and tests at the same time seldom exceeds.
const SMOKE: Run = Run {
    name: "",
    middleware: "",
    has_other_host: true,
    within: 250,
    slower: 300,
    quiet: None,
};
const DDS: &str = "middleware dds { domain 186; };";
const ROS2: &str = "middleware ros2 { domain 187; };";

#[test]
fn a_chain_over_two_hosts_is_measured_over_dds() {
    let run = Run {
        name: "chains_dds",
        middleware: DDS,
        ..SMOKE
    };
    runs("a_chain_over_two_hosts_is_measured_over_dds", &run);
}

#[test]
fn a_chain_over_two_hosts_is_measured_over_ros2() {
    let run = Run {
        name: "chains_ros2",
        middleware: ROS2,
        ..SMOKE
    };
    runs("a_chain_over_two_hosts_is_measured_over_ros2", &run);
}

/// Ten minutes of each middleware without a false alarm, then 50 ms at one component.
/// `RC_CHAIN_SECONDS`: of each one; `RC_CHAIN_OVER`: over this one alone.
#[test]
#[ignore = "`cargo xtask soak chains` runs it: half an hour"]
fn ten_minutes_without_a_false_alarm() {
    let seconds = std::env::var("RC_CHAIN_SECONDS").ok();
    let seconds = seconds.map_or(600, |text| text.parse().expect("seconds"));
    let over = std::env::var("RC_CHAIN_OVER").unwrap_or_default();
    let test = "ten_minutes_without_a_false_alarm";
    let all = [
        ("chains_long_iceoryx2", "middleware iceoryx2;", false),
        ("chains_long_dds", DDS, true),
        ("chains_long_ros2", ROS2, true),
    ];
    for (name, middleware, has_other_host) in all {
        if !name.ends_with(&over) {
            continue;
        }
        let run = Run {
            name,
            middleware,
            has_other_host,
            within: 60,
            slower: 50,
            quiet: Some(Duration::from_secs(seconds)),
        };
        runs(test, &run);
        println!("{middleware} {seconds} s");
    }
}
