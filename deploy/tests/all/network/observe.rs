//! Tools look at the patrol, call its operations and send to its topics, and are not peers.

use rc_test_site::site::{CommandOutput, PATROL, Site};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use std::process::{Child, Command, Stdio};

fn patrol(name: &str) -> Site {
    let site = Site::new(name);
    site.write_ddsl(PATROL);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site
}

/// A command about the network of a site.
fn tool(site: &Site, command: &str, args: &[&str]) -> CommandOutput {
    let mut all = vec![command, site.network.as_str()];
    all.extend(args);
    site.rcdeploy(&all, false)
}

/// A command that goes on.
fn running_tool(site: &Site, command: &str, args: &[&str]) -> RunningTool {
    let mut child = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    child.arg(command).arg(&site.network).args(args);
    site.place(&mut child);
    child.stdout(Stdio::null()).stderr(Stdio::null());
    RunningTool(child.spawn().expect("to start"))
}

/// Dropping it kills the process.
struct RunningTool(Child);

impl Drop for RunningTool {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub(crate) fn json_of(ran: &CommandOutput) -> Value {
    assert_eq!(ran.code, 0, "{ran:?}");
    serde_json::from_str(ran.stdout.lines().next().unwrap_or_default()).expect("JSON")
}

#[test]
fn a_running_network_is_listed_shown_measured_and_called() {
    let site = patrol("observed");
    let listed = json_of(&tool(&site, "list", &["--format", "json"]));
    let topic = &listed["topics"][0];
    assert_eq!(topic["operation"], "newFullPose", "{listed}");
    assert_eq!(topic["publishers"][0]["component"], "simulator");
    assert_eq!(topic["subscribers"][0]["component"], "monitor");
    assert!(
        topic["publishers"][0]["rate_hz"]
            .as_f64()
            .is_some_and(|hz| hz > 0.0),
        "{listed}"
    );
    let services = listed["services"].as_array().expect("a list");
    assert_eq!(services.len(), 3, "{listed}");

    let shown = tool(&site, "show", &["FullPoseEuler"]);
    assert!(
        shown.stdout.contains("confidence: int32  (in %, 0 to 100)"),
        "{shown:?}"
    );
    let shown = json_of(&tool(
        &site,
        "show",
        &["simulator.Laser", "--format", "json"],
    ));
    assert_eq!(shown["interface"], "RoboCompLaser::Laser", "{shown}");

    let echoed = tool(&site, "echo", &["newFullPose", "--once"]);
    assert_eq!(echoed.code, 0, "{echoed:?}");
    // The time of sending, and the sender.
    let (head, value) = echoed.stdout.split_once('\n').expect("two lines");
    assert!(
        head.starts_with("# 20") && head.contains("Z from simulator."),
        "{head}"
    );
    assert!(
        value.starts_with("pose:\n  source: \"simulator\"\n  x: "),
        "{echoed:?}"
    );
    let csv = tool(
        &site,
        "echo",
        &["newFullPose", "--csv", "--field", "pose.x", "--count", "3"],
    );
    assert_eq!(csv.stdout.lines().count(), 4, "{csv:?}");
    // Whole messages have the columns of a recording's tables.
    let whole = tool(&site, "echo", &["newFullPose", "--csv", "--count", "1"]);
    let header = whole.stdout.lines().next().unwrap_or_default();
    let columns = "log_time_s,publish_time_s,source,x,y,z,";
    assert!(header.starts_with(columns), "{whole:?}");
    // The clock is the one of a recording's tables.
    let expected = "log_time_s,publish_time_s,pose.x\n";
    assert!(csv.stdout.starts_with(expected), "{csv:?}");
    let row = csv.stdout.lines().nth(1).unwrap_or_default();
    let times: Vec<f64> = row
        .split(',')
        .take(2)
        .filter_map(|t| t.parse().ok())
        .collect();
    let now = rc_record::system_time() as f64 / 1e9;
    assert!(
        (now - times[0]).abs() < 60.0 && (0.0..60.0).contains(&(times[0] - times[1])),
        "{row}"
    );
    let calls = tool(
        &site,
        "echo",
        &["getLaserData", "--format", "json", "--count", "2"],
    );
    let request = json_of(&calls);
    assert_eq!(request["kind"], "request", "{calls:?}");
    assert!(calls.stdout.contains("\"kind\":\"reply\""), "{calls:?}");
    let caller = request["sender"].as_str().unwrap_or_default();
    assert!(caller.starts_with("avoider.Laser ["), "{calls:?}");

    let hz = json_of(&tool(
        &site,
        "hz",
        &["newFullPose", "--lines", "1", "--format", "json"],
    ));
    assert!(hz["rate_hz"].as_f64().is_some_and(|hz| hz > 0.0), "{hz}");

    let called = json_of(&tool(
        &site,
        "call",
        &["getLaserConfData", "--format", "json"],
    ));
    assert!(
        called["result"]["return"]["maxMeasures"].is_number(),
        "{called}"
    );
    assert_eq!(
        tool(&site, "call", &["setSpeedBase", r#"{"adv": 1}"#]).code,
        0
    );
    // An address is not a name of a network.
    let called = site.rcdeploy(&["call", "Laser/getLaserData", "{}"], false);
    assert_eq!(called.code, 0, "{called:?}");
    let elsewhere = site.rcdeploy(&["list", "elsewhere"], false);
    let told = format!("; these networks run: {}", site.network);
    assert!(elsewhere.stderr.contains(&told), "{elsewhere:?}");
    let count = elsewhere.stderr.matches(&site.network).count();
    assert_eq!(count, 1, "{elsewhere:?}");
    each_connection_has_a_latency_beside_that_of_the_last_run(&site);
    the_start_shows_who_waited_for_whom(&site);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// The latency of samples and of calls, between two programs.
fn each_connection_has_a_latency_beside_that_of_the_last_run(site: &Site) {
    let bench = |more: &[&str]| tool(site, "bench", &[&["--seconds", "1"], more].concat());
    let run = json_of(&bench(&["--format", "json"]));
    let connections = run["connections"].as_array().expect("a list");
    for (from, to) in [
        (
            "simulator.FullPoseEstimationPub",
            "monitor.FullPoseEstimationPub.newFullPose",
        ),
        ("avoider.Laser", "simulator.Laser.getLaserData"),
    ] {
        let is = |one: &&Value| one["from"] == from && one["to"] == to;
        let one = connections.iter().find(is);
        let one = one.unwrap_or_else(|| panic!("{from} -> {to}: {run}"));
        assert_eq!(one["middleware"], "iceoryx2", "{one}");
        assert!(one["messages"].as_u64() > Some(0), "{one}");
        let time = |name: &str| one["times"][name].as_f64().expect("a time");
        assert!(
            time("p50_ms") > 0.0 && time("p50_ms") <= time("p99_ms"),
            "{one}"
        );
        assert!(time("p99_ms") <= time("worst_ms"), "{one}");
        assert_eq!(
            (&one["last"], &one["error_ms"]),
            (&Value::Null, &Value::Null)
        );
    }
    let again = bench(&[]);
    assert_eq!(again.code, 0, "{again:?}");
    let wanted =
        "simulator.FullPoseEstimationPub -> monitor.FullPoseEstimationPub.newFullPose  iceoryx2";
    let mut lines = again.stdout.lines();
    let line = lines.find(|line| line.starts_with(wanted)).expect(wanted);
    assert_eq!(
        line.matches(['+', '-']).count(),
        4,
        "an arrow and three differences: {line}"
    );
    assert!(
        again.stdout.ends_with("the difference to the last run.\n"),
        "{again:?}"
    );
    let wrong = site.rcdeploy(&["bench", "nowhere"], false);
    assert_eq!(wrong.code, 3, "{wrong:?}");
}

fn the_start_shows_who_waited_for_whom(site: &Site) {
    let status = tool(site, "status", &["--start", "--format", "json"]);
    let start = json_of(&status);
    let chain = start["chain"].as_array().expect("a list");
    let names: Vec<&str> = chain
        .iter()
        .filter_map(|link| link["component"].as_str())
        .collect();
    assert_eq!(names, ["avoider", "monitor", "simulator"], "{start}");
    let up = start["up_ms"].as_f64().expect("it is up");
    let ends = chain.iter().filter_map(|link| link["ended_ms"].as_f64());
    let ends: Vec<f64> = ends.collect();
    assert!(ends[0] <= up && ends.is_sorted_by(|a, b| a >= b), "{start}");
    assert!(
        chain
            .iter()
            .all(|link| link["took_ms"].as_f64() > Some(0.0)),
        "{start}"
    );
    let shown = tool(site, "status", &["--start"]);
    assert!(
        shown
            .stdout
            .starts_with(&format!("network {} was up ", site.network)),
        "{shown:?}"
    );
    let other = site.rcdeploy(&["status", "--start", "nowhere"], false);
    assert_eq!(other.code, 3, "{other:?}");
}

#[test]
fn wrong_names_and_values_are_refused_with_what_is_allowed() {
    let site = patrol("refused");
    let fails = |ran: CommandOutput, text: &str| {
        assert_eq!(ran.code, 1, "{ran:?}");
        assert!(ran.stderr.contains(text), "{ran:?}");
    };
    fails(
        tool(&site, "echo", &["newFullPos", "--once"]),
        "did you mean `simulator.FullPoseEstimationPub.newFullPose`?",
    );
    fails(
        tool(&site, "call", &["getBasePos"]),
        "did you mean `simulator.DifferentialRobot.getBasePose`?",
    );
    fails(tool(&site, "show", &["Lasr"]), "did you mean");
    fails(
        tool(
            &site,
            "echo",
            &["newFullPose", "--once", "--field", "pose.xx"],
        ),
        "there is no member `xx`",
    );
    fails(
        tool(
            &site,
            "send",
            &["newFullPose", r#"{"pose": {"confidence": 101}}"#],
        ),
        "`pose.confidence`: 101 is outside its range 0 to 100 %",
    );
    fails(
        tool(&site, "call", &["setSpeedBase", r#"{"advance": 1}"#]),
        "has no member `advance`",
    );
    fails(
        tool(&site, "call", &["setSpeedBase", "{"]),
        "the value is not JSON",
    );
    let gone = site.rcdeploy(&["echo", "no_such_network", "newFullPose"], false);
    assert_eq!(gone.code, 3, "{gone:?}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
}

/// Tools fill their places, and one is killed: the counts of peers stay, and a component joins.
#[test]
fn tools_are_no_peers_and_take_no_place() {
    let site = patrol("uncounted");
    let peers = || {
        let status = site.ask("simulator", "status");
        let slots = status["slots"].as_array().expect("a list").clone();
        slots
            .iter()
            .map(|slot| slot["peers"].clone())
            .collect::<Vec<Value>>()
    };
    let connected = [json!(1), json!(1), json!(1), json!(1)];
    Site::until("all are connected", || peers() == connected);
    let mut tools: Vec<RunningTool> = (0..4)
        .map(|_| running_tool(&site, "echo", &["newFullPose"]))
        .collect();
    Site::until("the places of tools are taken", || {
        // The fifth one may have come before one of the four.
        for tool in &mut tools {
            if tool.0.try_wait().expect("a child").is_some() {
                *tool = running_tool(&site, "echo", &["newFullPose"]);
            }
        }
        let fifth = tool(&site, "echo", &["newFullPose", "--once", "--timeout", "1"]);
        fifth.stderr.contains("4 tools observe it already")
    });
    assert_eq!(peers(), connected);
    let sent = json_of(&{
        let ran = tool(&site, "send", &["newFullPose", r#"{"pose": {"x": 1}}"#]);
        assert_eq!(ran.code, 0, "{ran:?}");
        tool(&site, "list", &["--format", "json"])
    });
    assert!(
        sent["topics"][0]["publishers"][0]["rate_hz"]
            .as_f64()
            .is_some_and(|hz| hz > 0.0),
        "{sent}"
    );
    let bind = format!(
        "FullPoseEstimationPub={}/simulator/FullPoseEstimationPub",
        site.network
    );
    let second = site.start_program(
        "pose_monitor",
        "second",
        &["--name", "second", "--bind", &bind],
        &[],
    );
    Site::until("another subscriber is counted", || peers()[3] == json!(2));
    drop(second);
    drop(tools);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn a_second_interrupt_ends_a_command_whose_output_nobody_reads() {
    let site = patrol("unread");
    site.tell("simulator", "period", &json!({ "ms": 5 }));
    let mut echo = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    echo.args(["echo", &site.network, "newFullPose"]);
    site.place(&mut echo);
    echo.stdout(Stdio::piped()).stderr(Stdio::null());
    let mut echo = RunningTool(echo.spawn().expect("to start"));
    let output = echo.0.stdout.take().expect("a pipe");
    rustix::pipe::fcntl_setpipe_size(&output, 4096).expect("a small pipe");
    // It writes until nothing more fits.
    let (mut held, mut looks) = (0, 0);
    Site::until("a pipe that is full", || {
        let before = held;
        held = rustix::io::ioctl_fionread(&output).expect("a pipe");
        looks = if held > 0 && held == before {
            looks + 1
        } else {
            0
        };
        looks > 20
    });
    let pid = Pid::from_child(&echo.0);
    // Signals of one kind that wait together count once.
    Site::until("its end", || {
        let _ = kill_process(pid, Signal::INT);
        echo.0.try_wait().expect("a child").is_some()
    });
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
}
