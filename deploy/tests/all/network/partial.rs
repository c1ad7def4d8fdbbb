//! Networks of which a part is somewhere else, and parameters that a network sets.

#![allow(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use rc_codegen::FileLoader;
use rc_deploy_graph::{Graph, GraphFormat};
use rc_deploy_network::preview::Preview;
use rc_deploy_network::{self as network, Network, Overrides, Profile};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rc_test_site::site::{CommandOutput, Site};
use rustix::process::{Signal, kill_process};
use std::path::Path;
use std::process::Stdio;

const PDSL: &str = "ComponentParams user\n{\n    speed float 400.0 0:1500 T unit \"mm/s\";\n    \
    low int 1 T;\n    high int 5 T;\n    token string \"\" secret;\n    gains float[0:3] [1.0];\n    \
    wait duration 20ms;\n    name string \"\";\n    require low < high \"low is below high\";\n};\n";

/// Findings in a network with the component `user`, which requires `Laser` and has parameters.
fn load(
    folder: &Path,
    body: &str,
    set: &[&str],
) -> (Option<Network>, SourceMap, Diagnostics, String) {
    let write = |name: &str, text: &str| {
        std::fs::write(folder.join(name), text).expect("to write");
    };
    write(
        "user.cdsl",
        "import \"Laser.idsl\";\nComponent user { Communications { requires Laser; }; language rust; parameters \"user.pdsl\"; };\n",
    );
    write("user.pdsl", PDSL);
    write("user.toml", "[parameters]\nhigh = 3\n");
    write(
        "n.ddsl",
        &format!(
            "Deployment n\n{{\nComponent user {{ cdsl \"user.cdsl\"; executable \"x\"; config \"user.toml\"; {body}\n}};\n"
        ),
    );
    let mut sources = SourceMap::new();
    let set: Vec<String> = set.iter().map(|text| (*text).to_owned()).collect();
    let overrides = Overrides {
        parameters: &set,
        ..Overrides::default()
    };
    let loader = FileLoader::default();
    let loaded = network::load(&folder.join("n.ddsl"), &overrides, &mut sources, &loader);
    let (network, found) = loaded.expect("the files");
    let output = render(&sources, &found, Format::Short);
    let output = output.replace(&format!("{}/", folder.display()), "");
    (network, sources, found, output)
}

/// The values of one option on the command line of `user`.
fn output(network: &Network, option: &str) -> Vec<String> {
    let plan = network.plan(Profile::Dev).expect("a plan");
    let pairs = plan.components[0].args.windows(2);
    let output = pairs.filter(|pair| pair[0] == option);
    output.map(|pair| pair[1].clone()).collect()
}

#[test]
fn values_reach_the_component_and_the_command_line_comes_first() {
    let folder = tempfile::tempdir().expect("a folder");
    let body = "parameters { speed 300; gains [0.5, 2]; wait 5ms; name \"a \\\"b\\\"\"; }; };\nexternal user.Laser;";
    let set = [
        "user.speed=250.5",
        "user.high=9",
        "user.low=8",
        "user.high=10",
    ];
    let (network, _, _, found) = load(folder.path(), body, &set);
    assert_eq!(found, "");
    let network = network.expect("a network");
    assert_eq!(
        output(&network, "--set"),
        [
            "gains=[0.5,2]",
            "wait=\"5ms\"",
            "name=\"a \\\"b\\\"\"",
            "speed=250.5",
            "low=8",
            "high=10"
        ]
    );
    assert_eq!(output(&network, "--bind"), ["Laser=n/Laser"]);
    let preview = Preview::of(&network, Profile::Dev).expect("a plan");
    let text = preview.to_string();
    assert!(
        text.contains("parameters     gains = [0.5,2], high = 10,"),
        "{text}"
    );
    assert!(
        text.contains("user.Laser  external Laser  call  iceoryx2  n/Laser"),
        "{text}"
    );
    let json = serde_json::to_value(&preview).expect("JSON");
    assert_eq!(json["components"][0]["parameters"]["speed"], 250.5);
    assert_eq!(json["connections"][0]["to"]["external"], true);
    assert_eq!(json["connections"][0]["to"]["component"], "n/Laser");
}

#[test]
fn wrong_values_are_found_where_they_stand() {
    let folder = tempfile::tempdir().expect("a folder");
    let check = |parameters: &str, set: &[&str]| {
        let body = format!("parameters {{ {parameters} }}; }};\nexternal user.Laser;");
        load(folder.path(), &body, set).3
    };
    expect_test::expect![[r#"
        n.ddsl:3:85: error[out-of-range]: `speed` cannot be the number 9000 (allowed is a number of 32 bits, from 0 to 1500, in mm/s)
        n.ddsl:3:97: error[unknown-parameter]: unknown parameter `sped` (did you mean `speed`?)
        n.ddsl:3:105: error[wrong-type]: `gains` cannot be the number 3 (allowed is an array, 0 to 3 elements, each a number of 32 bits)
        n.ddsl:3:114: error[wrong-type]: `wait` cannot be the string "fast" (allowed is a duration such as "50ms", or a number of milliseconds)
        n.ddsl:3:125: error[wrong-type]: `low` cannot be the string "x" (allowed is an integer of 32 bits)
        n.ddsl:3:134: error[unknown-parameter]: there is no `gains[1]` (there is only `gains[0]`)
    "#]].assert_eq(&check(
        "speed 9000; sped 1; gains 3; wait fast; low \"x\"; gains[1] 2;",
        &[],
    ));
    // The configuration says that `high` is 3.
    expect_test::expect![[r#"
        n.ddsl:3:85: error[rule-broken]: `low` breaks a rule: low is below high (`low < high` does not hold: `low` is 3, `high` is 3)
    "#]].assert_eq(&check("low 3;", &[]));
    expect_test::expect![[r#"
        n.ddsl:3:85: error[secret-override]: `token` is secret: a network cannot set it (write it into the configuration of the component: every user of the machine can read command lines)
    "#]].assert_eq(&check("token \"hush\";", &[]));
    expect_test::expect![[r#"
        --set:1:6: error[out-of-range]: `speed` cannot be the number 9000 (allowed is a number of 32 bits, from 0 to 1500, in mm/s)
        --set:1:1: error[bad-override]: `user` is not a value of a parameter (write `COMPONENT.PATH=VALUE`, as in `avoider.speed=300`)
        --set:1:1: error[unknown-instance]: unknown component `usr` (did you mean `user`?)
        --set:1:6: error[secret-override]: `token` is secret: a network cannot set it (write it into the configuration of the component: every user of the machine can read command lines)
        --set:1:6: error[unknown-parameter]: unknown parameter `sped` (did you mean `speed`?)
    "#]].assert_eq(&check(
        "",
        &[
            "user.speed=9000",
            "user",
            "usr.speed=1",
            "user.token=x",
            "user.sped=1",
        ],
    ));
}

#[test]
fn an_external_peer_is_drawn_outside() {
    let folder = tempfile::tempdir().expect("a folder");
    let body = "host robot; };\nHost robot { address \"10.0.0.2\"; };\nmiddleware dds;\nexternal user.Laser at \"fleet/lidar/Laser\";";
    let (network, sources, found, output) = load(folder.path(), body, &[]);
    assert_eq!(output, "");
    let graph = Graph::of(&network.expect("a network"), &sources, &found);
    let draw = |format| graph.draw(format).expect("a picture");
    let json: serde_json::Value = serde_json::from_str(&draw(GraphFormat::Json)).expect("JSON");
    let outside = &json["components"][1];
    assert_eq!(
        (
            &outside["name"],
            &outside["external"],
            &outside["slots"][0]["role"]
        ),
        (
            &"fleet/lidar/Laser".into(),
            &true.into(),
            &"implements".into()
        )
    );
    let dot = draw(GraphFormat::Dot);
    assert!(
        dot.contains("c1 [label=\"fleet/lidar/Laser\\nexternal\""),
        "{dot}"
    );
    assert!(dot.contains("style=\"rounded,dashed\""), "{dot}");
    // Before the box of the host.
    assert!(
        dot.find("  c1 [") < dot.find("subgraph cluster_host0"),
        "{dot}"
    );
    let mermaid = draw(GraphFormat::Mermaid);
    assert!(mermaid.contains(":::external"), "{mermaid}");
    let svg = draw(GraphFormat::Svg);
    assert!(svg.contains("not part of the network, over dds"), "{svg}");
    assert!(svg.contains("stroke-dasharray=\"4 3\""), "{svg}");
}

/// The avoider alone: its robot is not part of the network.
const ALONE: &str = "Deployment patrol\n{\n    Component avoider { cdsl \"../avoider/avoider.cdsl\"; };\n    \
    external avoider.Laser, avoider.DifferentialRobot;\n};\n";

fn params(site: &Site, args: &[&str]) -> CommandOutput {
    site.rcdeploy(&[&["params"], args].concat(), false)
}

#[test]
fn a_network_runs_without_the_part_that_is_started_by_hand() {
    let site = Site::new("partial");
    site.write_ddsl(ALONE);
    let net = site.network.clone();
    let up = [
        "up",
        "--detach",
        "--profile",
        "dev",
        "--set",
        "avoider.speed=300",
    ];
    let up = site.rcdeploy(&up, true);
    assert_eq!(up.code, 0, "{up:?}");
    let get = params(&site, &["get", &net, "avoider", "speed"]);
    assert_eq!(get.stdout, "speed = 300.0\n", "{get:?}");
    // Its calls fail, and the error names the missing peer.
    site.await_component("avoider", |c| {
        c["state"] == "running" && c["troubles"][0]["code"] == "peer-missing"
    });
    let mut simulator = site.start("simulator", &[]);
    site.await_component("avoider", |c| {
        c["troubles"].as_array().is_some_and(Vec::is_empty)
    });
    let before = site.ask("avoider", "status");
    let drives = |status: &serde_json::Value| {
        let sent = status["slots"].as_array().into_iter().flatten();
        // It reads the battery once a second.
        let sent = sent.filter(|slot| slot["name"] != "BatteryStatus");
        let mut sent = sent.map(|slot| (slot["peers"].as_u64(), slot["sent"].as_u64()));
        sent.all(|(peers, sent)| peers == Some(1) && sent > before["slots"][0]["sent"].as_u64())
    };
    Site::until("a robot that drives", || {
        drives(&site.ask("avoider", "status"))
    });
    // It belongs to the network as well, although the file does not list it.
    site.await_component("simulator", |c| {
        c["by_hand"] == true && c["state"] == "running"
    });
    let status = site.rcdeploy(&["status", &net], false);
    assert!(status.stdout.contains("  by hand"), "{status:?}");
    simulator.kill();
    site.await_component("avoider", |c| c["troubles"][0]["code"] == "peer-vanished");
    let simulator = site.start("simulator", &[]);
    site.await_component("avoider", |c| {
        c["troubles"].as_array().is_some_and(Vec::is_empty)
    });
    let output = site.events("avoider");
    let codes: Vec<&str> = output.iter().map(|(code, _)| code.as_str()).collect();
    assert_eq!(
        codes.iter().filter(|c| **c == "state").count(),
        1,
        "{output:?}"
    );
    assert!(codes.contains(&"peer-back"), "{output:?}");
    // Values are checked before anything starts.
    let wrong = site.rcdeploy(
        &["check", "--profile", "dev", "--set", "avoider.speed=3000"],
        true,
    );
    assert_eq!(wrong.code, 1, "{wrong:?}");
    assert!(wrong.stderr.contains("--set:1:9"), "{wrong:?}");
    kill_process(simulator.pid(), Signal::TERM).expect("to end it");
    assert_eq!(simulator.end(), Some(0));
    let down = site.rcdeploy(&["down", &net], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}

#[test]
fn components_that_were_started_by_hand_are_found_without_a_supervisor() {
    let site = Site::new("byhand2");
    let net = site.network.clone();
    let nobody = site.rcdeploy(&["status", &net], false);
    assert_eq!(nobody.code, 3, "{nobody:?}");
    let avoider = site.start("avoider", &[]);
    let simulator = site.start("simulator", &[]);
    let status = site.rcdeploy(&["status", &net], false);
    assert_eq!(status.code, 0, "{status:?}");
    assert!(
        status
            .stdout
            .starts_with(&format!("network {net} has no supervisor\n")),
        "{status:?}"
    );
    let rows = status.stdout.lines().skip(2);
    // A row with the states of its machine follows that of the avoider.
    let rows: Vec<&str> = rows.filter(|row| !row.starts_with(' ')).collect();
    assert_eq!(rows.len(), 2, "{status:?}");
    for (row, name) in rows.iter().zip(["avoider", "simulator"]) {
        assert!(row.starts_with(name) && row.ends_with("by hand"), "{row}");
    }
    let json = site.status();
    assert_eq!(
        (&json["pid"], &json["ddsl"]),
        (&serde_json::Value::Null, &serde_json::Value::Null)
    );
    let first = &json["components"][0];
    assert_eq!(first["pid"], avoider.pid().as_raw_nonzero().get());
    assert_eq!(
        first["executable"],
        Site::executable("avoider").display().to_string()
    );
    // Their logs are the files into which they print.
    let logs = site.rcdeploy(&["logs", &net, "simulator"], false);
    assert_eq!((logs.code, logs.stdout), (0, simulator.log()));
    let logs = site.rcdeploy(&["logs", &net], false);
    assert!(logs.stdout.contains("avoider   | "), "{logs:?}");
    // The only network that runs needs no name.
    let status = site.rcdeploy(&["status"], false);
    assert_eq!(status.code, 0, "{status:?}");
    // Each command that needs a supervisor says who started them.
    let pids = [&avoider, &simulator].map(|of| of.pid().as_raw_nonzero().to_string());
    let wanted = format!(
        "the components of network {net} were started by hand, and rcdeploy neither starts nor stops them; end them where they run, or with: kill {}",
        pids.join(" ")
    );
    for words in [
        &["down", &net][..],
        &["stop", &net, "avoider"],
        &["start", &net, "avoider"],
        &["restart", &net, "avoider"],
    ] {
        let refused = site.rcdeploy(words, false);
        assert_eq!(refused.code, 3, "{words:?}: {refused:?}");
        assert!(refused.stderr.contains(&wanted), "{words:?}: {refused:?}");
    }
    for component in [avoider, simulator] {
        kill_process(component.pid(), Signal::TERM).expect("to end it");
        assert_eq!(component.end(), Some(0));
    }
    // By its name: networks of other tests may run.
    assert_eq!(site.rcdeploy(&["status", &net], false).code, 3);
}

#[test]
fn a_component_that_prints_to_a_pipe_has_no_log() {
    let site = Site::new("piped");
    let mut command = site.command(&Site::executable("avoider"));
    command
        .args(["--network", &site.network])
        .stderr(Stdio::piped());
    let mut avoider = command.spawn().expect("a component");
    Site::until("its status", || {
        site.rcdeploy(&["status", &site.network], false).code == 0
    });
    let logs = site.rcdeploy(&["logs", &site.network, "avoider"], false);
    assert_eq!(logs.code, 3, "{logs:?}");
    assert!(
        logs.stderr
            .contains("avoider was started by hand and prints to pipe:"),
        "{logs:?}"
    );
    avoider.kill().expect("to kill it");
    avoider.wait().expect("to reap it");
}

/// The last one removes all files of the network, also of those that were killed, and one that
/// fails before it has a connection leaves none.
#[test]
fn components_over_dds_that_were_started_by_hand_leave_nothing() {
    let site = Site::new("byhand3");
    let over = |interface: &str| {
        let interface = format!("dds.interfaces={interface}");
        ["--set-middleware", "dds.domain=98", "--set-middleware"]
            .map(str::to_owned)
            .into_iter()
            .chain([interface])
            .collect::<Vec<String>>()
    };
    let start = || {
        let arguments = over("lo");
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        site.start("interop", &arguments)
    };
    let killed = start();
    assert!(site.directory().middleware("dds").exists());
    kill_process(killed.pid(), Signal::KILL).expect("to kill it");
    killed.end();
    let last = start();
    kill_process(last.pid(), Signal::TERM).expect("to end it");
    assert_eq!(last.end(), Some(0));
    assert!(!site.directory().path().exists());
    let mut arguments = over("nowhere");
    arguments.extend(["--network".to_owned(), site.network.clone()]);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let failed = site.component("interop", &arguments);
    assert_eq!(failed.code, 3, "{failed:?}");
    assert!(!site.directory().path().exists(), "{failed:?}");
}

/// What `rcdeploy check` says of two components in a group, with these rules in it and outside.
fn rules(inside: &str, outside: &str, set: &[&str]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let body = format!(
        "}};\nexternal user.Laser;\nGroup arm\n{{\n\
         Component left {{ cdsl \"user.cdsl\"; executable \"x\"; parameters {{ low 2; }}; }};\n\
         Component bare {{ cdsl \"bare.cdsl\"; executable \"x\"; }};\n\
         external left.Laser;\n{inside}\n}};\n{outside}"
    );
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("to write");
    };
    write(
        "bare.cdsl",
        "Component bare { Communications { }; language rust; period 50ms; };\n",
    );
    load(folder.path(), &body, set).3
}

#[test]
fn rules_between_components_hold_before_the_start() {
    // `user` has high = 3 by its configuration, `arm.left` low = 2 by the network.
    let held = [
        "require arm.left.low < user.high \"a\";",
        "require user.period == 100ms and arm.bare.period * 2 == user.period \"b\";",
        "require max(user.gains) <= arm.left.low and user.name == \"\" \"c\";",
    ];
    assert_eq!(rules("", &held.join("\n"), &[]), "");
    let inside = "require left.low < user.high or not bare.period < 1s \"d\";";
    assert_eq!(rules(inside, "", &[]), "");
    expect_test::expect![[r#"
        n.ddsl:10:9: error[rule-broken]: too low (`left.low > user.high` does not hold: `arm.left.low` is 2, `user.high` is 9)
        n.ddsl:12:9: error[rule-broken]: unstable (`arm.bare.period * arm.left.low < 40ms` does not hold: `arm.bare.period` is "50ms", `arm.left.low` is 2)
    "#]].assert_eq(&rules(
        "require left.low > user.high \"too low\";",
        "require arm.bare.period * arm.left.low < 40ms \"unstable\";",
        &["user.high=9"],
    ));
}

#[test]
fn mistakes_in_rules_between_components_have_their_places() {
    let wrong = [
        "require arm.lef.low < user.high \"a\";",
        "require arm.left.lo < user.high \"a\";",
        "require usr.low < 3 \"a\";",
        "require user.low < 3ms \"a\";",
        "require arm.left \"a\";",
        "require arm.bare.low < 3 \"a\";",
        "require user.token == \"x\" \"a\";",
        "require 1 < 2 \"a\";",
        "require user.low && user.high < 3 \"a\";",
    ];
    expect_test::expect![[r#"
        n.ddsl:12:13: error[unknown-instance]: group `arm` has no component or group `lef` (did you mean `left`?)
        n.ddsl:13:18: error[unknown-parameter]: unknown parameter `arm.left.lo` (did you mean `low`?)
        n.ddsl:14:9: error[unknown-instance]: unknown component or group `usr` (did you mean `user`?)
        n.ddsl:15:9: error[condition-type]: a number cannot be compared with a duration (a duration needs a unit here: `100ms`)
        n.ddsl:16:9: error[condition-type]: `arm.left` is a group and has no value (name one of the parameters in it)
        n.ddsl:17:18: error[unknown-parameter]: unknown parameter `arm.bare.low` (expected `period`)
        n.ddsl:18:9: error[rule-broken]: a (`user.token == "x"` does not hold: `user.token` is secret)
        n.ddsl:19:9: error[constant-condition]: no parameter is named here: it always holds
        n.ddsl:20:9: error[condition-type]: this is a number, not a condition (compare it with something: `a < b`)
        n.ddsl:20:18: error[foreign-operator]: `&&` is written `and` here
    "#]].assert_eq(&rules("", &wrong.join("\n"), &[]));
}
