//! Components that share a world, in processes of their own.

use rc_test_site::site::Site;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use std::io::Read;
use std::process::Stdio;

/// The network of `components/networks/home.ddsl`.
const HOME: &str = include_str!("../../../../components/networks/home.ddsl");

#[test]
fn what_one_component_writes_another_one_gets_and_a_restarted_one_catches_up() {
    let site = Site::new("world_home");
    site.write_ddsl(&HOME.replace("Deployment home", "Deployment patrol"));
    let plan = site.rcdeploy(&["plan", "--profile", "dev"], true);
    let text = "door_finder  writes door, RT, door.opened stream 20ms; reads room";
    assert!(plan.stdout.contains(text), "{plan:?}");
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    // The room goes to the finder, its door comes back with a pose in that room, then the stream.
    site.await_in_log("door_finder", "a door is found");
    site.await_in_log("room_keeper", "door front of 0.8 m at 1.2 0");
    site.await_in_log("room_keeper", "door front is open by");

    // A keeper that is new gets the door, and the values of the stream after that.
    let doors = site.count_in_log("room_keeper", "door front of");
    let restarted = site.rcdeploy(&["restart", &site.network, "room_keeper"], false);
    assert_eq!(restarted.code, 0, "{restarted:?}");
    Site::until("the door comes again", || {
        site.count_in_log("room_keeper", "door front of") > doors
    });
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}

/// A component that stands still is split off from the world of the others, until it goes on.
#[test]
fn a_replica_that_nobody_hears_is_an_event_and_its_return_another_one() {
    let site = Site::new("world_split");
    site.write_ddsl(&HOME.replace("Deployment home", "Deployment patrol"));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_in_log("room_keeper", "door front of 0.8 m");

    let status = site.status();
    let mut components = status["components"].as_array().into_iter().flatten();
    let finder = components.find(|component| component["name"] == "door_finder");
    let pid = finder.and_then(|finder| finder["pid"].as_i64());
    let pid = Pid::from_raw(pid.expect("a pid") as i32).expect("a pid");
    kill_process(pid, Signal::STOP).expect("it runs");
    let await_event = |code: &str| {
        Site::until(code, || {
            let events = site.events("room_keeper");
            events.iter().any(|(own, _)| own == code)
        });
    };
    await_event("world-split");
    let status = site.rcdeploy(&["status", &site.network, "--format", "json"], false);
    assert!(status.stdout.contains("world-split"), "{status:?}");
    kill_process(pid, Signal::CONT).expect("it stands still");
    await_event("world-whole");
    let events = site.events("room_keeper");
    let split = events.iter().find(|(code, _)| code == "world-split");
    let text = &split.expect("it was there").1;
    let wanted = "its world hears nothing from door_finder, still running; each side goes on with what it has";
    assert_eq!(text, wanted);
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}

/// The commands of a user for a world. No component counts these commands as replicas.
#[test]
fn commands_read_change_ask_and_compare_a_world() {
    let site = Site::new("world_tools");
    site.write_ddsl(&HOME.replace("Deployment home", "Deployment patrol"));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_in_log("room_keeper", "door front of 0.8 m");
    let network = site.network.as_str();
    let run = |action: &str, more: &[&str]| {
        let args = [&["world", action, network], more].concat();
        site.rcdeploy(&args, false)
    };
    let done = |action: &str, more: &[&str]| {
        let ran = run(action, more);
        assert_eq!(ran.code, 0, "{ran:?}");
        ran.stdout
    };
    let listed = done("get", &[]);
    assert_eq!(listed, "door front\nroom kitchen\nRT kitchen/RT/front\n");
    let edge = done("get", &["kitchen/RT/front"]);
    let wanted = "RT kitchen/RT/front\n    pose = [1.2, 0.0, 0.0, 0.0, 0.0, 0.0]\n";
    assert_eq!(edge, wanted);

    // All replicas have it when the command ends, also those in other processes.
    let set = done("set", &["front.width=0.95", "kitchen.length=5"]);
    assert_eq!(
        set,
        "front.width = 0.95, was 0.8\nkitchen.length = 5.0, was 4.0\n"
    );
    let again = done("set", &["front.width=95 cm"]);
    assert_eq!(again, "front.width = 0.95, was 0.95\n");
    for replica in ["door_finder", "room_keeper"] {
        let of = format!("{network}@{replica}");
        let width = site.rcdeploy(&["world", "diff", &of, network, "--format", "json"], false);
        let found: Value = serde_json::from_str(&width.stdout).expect("JSON");
        let changed = found["changed"].as_array().expect("a list");
        // The stream goes on between the two looks.
        assert!(
            changed.iter().all(|one| one["attribute"] == "opened"),
            "{width:?}"
        );
    }
    let state = site.rcdeploy(&["world", network, "--format", "json"], false);
    let state: Value = serde_json::from_str(&state.stdout).expect("JSON");
    let replicas = state["replicas"].as_array().expect("a list");
    let names: Vec<&str> = replicas
        .iter()
        .filter_map(|one| one["name"].as_str())
        .collect();
    assert_eq!(names, ["door_finder", "room_keeper"]);
    let digests: Vec<&Value> = replicas.iter().map(|one| &one["digest"]).collect();
    assert_eq!(digests[0], digests[1]);
    // The stream goes on between their announcements.
    assert_eq!(state["is_equal"], true, "{state}");
    let rates = state["rates"].as_array().expect("a list");
    let stream = rates.iter().find(|rate| rate["what"] == "door.opened");
    let stream = stream.expect("the stream");
    assert_eq!(stream["writer"], "door_finder");
    assert!(stream["per_s"].as_f64() > Some(1.0), "{stream}");

    let watched = done("watch", &["door", "--count", "2", "--format", "json"]);
    let first = watched.lines().next().expect("a line");
    let first: Value = serde_json::from_str(first).expect("JSON");
    assert_eq!(
        (&first["element"], &first["attribute"]),
        (&json!("front"), &json!("opened"))
    );
    let asked = done(
        "query",
        &["MATCH (d:door) WHERE d.width > 0.9 RETURN d.name, d.width"],
    );
    assert_eq!(asked, "d.name  d.width [m]\nfront   0.95\n");
    let wrong = run("set", &["front.width=90kg"]);
    assert_eq!(wrong.code, 2, "{wrong:?}");
    assert!(
        wrong
            .stderr
            .contains("`width`: a number in `kg` is none in `m`"),
        "{wrong:?}"
    );
    let set = done("set", &["front.width=96 cm", "--format", "json"]);
    let told: Value = serde_json::from_str(&set).expect("JSON");
    let token = told[0]["token"].as_str().expect("a token");
    // What is read has the change of a token, or nothing is read.
    let width = done("get", &["front.width", "--after", token]);
    assert_eq!(width, "front.width = 0.96\n");
    let late = run(
        "query",
        &["MATCH (d:door) RETURN d.name", "--after", "ff:1"],
    );
    assert_eq!(late.code, 3, "{late:?}");
    assert!(late.stderr.contains("has no change ff:1 yet"), "{late:?}");

    // Pictures, and the frames as a tree: 1.2 m ahead are 1,200 mm along z.
    let picture = done("graph", &[]);
    let parsed = roxmltree::Document::parse(&picture).expect("a picture");
    let has_text = |text: &str| parsed.descendants().any(|node| node.text() == Some(text));
    assert!(has_text("front") && has_text("kitchen"), "{picture}");
    assert!(done("graph", &["--format", "dot"]).starts_with("digraph "));
    let args = ["graph", network, "--live", "--world"];
    let both = site.rcdeploy(&args, false);
    assert_eq!(both.code, 0, "{both:?}");
    let parsed = roxmltree::Document::parse(&both.stdout).expect("a picture");
    let has_text = |text: &str| parsed.descendants().any(|node| node.text() == Some(text));
    assert!(has_text("door_finder") && has_text("kitchen"), "{both:?}");
    let tree = done("tree", &[]);
    let wanted = "    <transform id=\"kitchen\">\n        <transform id=\"front\" tz=\"1200\"/>\n";
    assert!(tree.contains(wanted), "{tree}");

    // Whoever follows the tree ends when its reader has, though nothing changes any more.
    let mut follows = site.command(&rc_test_site::site::rcdeploy());
    follows.args(["world", "tree", "--follow", network]);
    let mut follows = follows.stdout(Stdio::piped()).spawn().expect("a process");
    let mut first = [0; 1];
    let mut output = follows.stdout.take().expect("a pipe");
    output.read_exact(&mut first).expect("a tree");
    drop(output);
    Site::until("the follower to end", || {
        follows.try_wait().expect("a state").is_some()
    });

    let file = site.path("kept.graph").display().to_string();
    let saved = done("save", &[&file]);
    assert_eq!(saved, format!("{file}: 2 nodes, 1 edge\n"));
    let changed = done("set", &["kitchen.length=6"]);
    assert_eq!(changed, "kitchen.length = 6.0, was 5.0\n");
    let diff = site.rcdeploy(&["world", "diff", &file, network], false);
    assert_eq!(diff.code, 1, "{diff:?}");
    assert!(
        diff.stdout.contains("  room kitchen.length: 5.0 and 6.0\n"),
        "{diff:?}"
    );

    // A recording has the world, too: it asks for it when it begins. One of the changes alone has not.
    let schema = Site::components()
        .join("interfaces/home.gdsl")
        .display()
        .to_string();
    let recorded = |name: &str, length: &str, topics: &[&str]| {
        let record = site.path(name).display().to_string();
        let args = ["record", network, "-o", &record, "--length", length];
        let recorded = site.rcdeploy(&[&args, topics].concat(), false);
        assert_eq!(recorded.code, 0, "{recorded:?}");
        record
    };
    let at_time = |time: &str, record: &str, words: &[&str]| {
        let args = ["world", "at", time, record, "--schema", &schema];
        site.rcdeploy(&[&args, words].concat(), false)
    };
    let at = |record: &str, words: &[&str]| at_time("4s", record, words);
    let record = recorded("whole.mcap", "4s", &[]);
    let found = at(&record, &["kitchen.length", "front.width"]);
    let wanted = "kitchen.length = 6.0\nfront.width = 0.96\n";
    assert_eq!(found.stdout, wanted, "{found:?}");
    for (time, ends) in [("3s", false), ("400s", true)] {
        let found = at_time(time, &record, &["kitchen.length"]);
        assert_eq!(found.stdout, "kitchen.length = 6.0\n", "{found:?}");
        let says = found.stderr.contains(" s: this is the world at its end");
        assert_eq!(says, ends, "{found:?}");
    }
    let wrong = at(&record, &["front.widt"]);
    let text = "`door` has no attribute `widt`; did you mean `width`?";
    assert!(wrong.code == 2 && wrong.stderr.contains(text), "{wrong:?}");
    let topics = site.rcdeploy(&["list", network, "--format", "json"], false);
    let topics: Value = serde_json::from_str(&topics.stdout).expect("JSON");
    let topics = topics["topics"].as_array().expect("a list").iter();
    let topics = topics.filter(|topic| {
        ["change", "digest"]
            .iter()
            .any(|own| topic["operation"] == *own)
    });
    let topics: Vec<&str> = topics.filter_map(|topic| topic["name"].as_str()).collect();
    let record = recorded("changes.mcap", "2s", &topics);
    let lacking = at(&record, &[]);
    let text = "lacks changes until then";
    assert!(
        lacking.code == 1 && lacking.stderr.contains(text),
        "{lacking:?}"
    );

    for (action, more, code, text) in [
        (
            "get",
            "fron",
            2,
            "no node has the name `fron`; did you mean `front`?",
        ),
        (
            "get",
            "frnt.width",
            2,
            "no node has the name `frnt`; did you mean `front`?",
        ),
        (
            "get",
            "front.widt",
            2,
            "`door` has no attribute `widt`; did you mean `width`?",
        ),
        (
            "get",
            "kitchen/TR/front",
            2,
            "no edge `kitchen/TR/front`; there is RT",
        ),
        (
            "set",
            "front=1",
            2,
            "`front` is an element; name an attribute, as in `front.name=…`",
        ),
        (
            "set",
            "front.width=-3",
            2,
            "`width` of `door` is in 0:inf m, found -3",
        ),
        (
            "set",
            "front.width=wide",
            2,
            "`width` of `door` is float, found `wide`",
        ),
        (
            "set",
            "front.width=5eV",
            2,
            "`width`: a number in `eV` is none in `m`",
        ),
        (
            "watch",
            "dor",
            2,
            "`dor` is neither a type nor an element; did you mean `door`?",
        ),
        (
            "query",
            "MATCH (d:doors) RETURN d.name",
            1,
            "the schema has no entity `doors`",
        ),
        (
            "save",
            "kept.txt",
            2,
            "expected a .graph file, found kept.txt",
        ),
    ] {
        let ran = run(action, &[more]);
        assert_eq!(ran.code, code, "{ran:?}");
        assert!(ran.stderr.contains(text), "{text}\n{ran:?}");
    }
    let unknown = format!("{network}@door_fnder");
    let ran = site.rcdeploy(&["world", "diff", &unknown, network], false);
    let text = "has no replica `door_fnder`; did you mean `door_finder`?";
    assert!(ran.code == 1 && ran.stderr.contains(text), "{ran:?}");
    let down = site.rcdeploy(&["down", network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}
