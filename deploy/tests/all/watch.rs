//! Events from the heartbeats of components and from the state of their processes.

use crate::bench::{Bench, codes, component, well};
use rc_deploy::Component;
use rc_middleware::{
    Address, Backend, Endpoint, Environment, Qos, RunDirectory, Settings, TypeIdentity, WakeEvent,
};
use rc_vocabulary::Value;
use rustix::process::Signal;
use std::path::Path;

#[test]
fn intermittent_conditions_do_not_flood_the_events() {
    let bench = Bench::new();
    let mut up = bench.start(vec![component("a", "ill", &[]), well("b")]);
    let message = up.await_event("overrun", Some("a"));
    assert_eq!(
        message,
        "compute() took 12.5 ms, longer than the period of 10 ms"
    );
    up.await_event("heard-again", Some("a"));
    let message = up.await_event("mismatch", Some("a"));
    assert_eq!(message, "it does not fit");
    // One heartbeat has had it.
    let message = up.await_event("mismatch-over", Some("a"));
    assert_eq!(message, "no longer so: it does not fit");
    let status = bench.status();
    assert_eq!(status.components[0].troubles, []);
    assert_eq!(status.components[1].troubles, []);
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0));
    let output = codes(&events, "a");
    for code in [
        "overrun",
        "in-time",
        "silent",
        "heard-again",
        "peer-vanished",
        "peer-back",
        "mismatch",
        "mismatch-over",
    ] {
        assert_eq!(
            output.iter().filter(|c| *c == code).count(),
            1,
            "{code} in {output:?}"
        );
    }
    bench.assert_nothing_left();
}

#[test]
fn a_growing_process_is_reported() {
    let bench = Bench::new();
    let plan = vec![component("leaky", "leak 10", &[]), well("well")];
    let mut up = bench.start_with(plan, &["--hasty"]);
    let message = up.await_event("memory-growth", Some("leaky"));
    assert!(
        message.starts_with("its memory grows steadily: from "),
        "{message}"
    );
    let status = bench.status();
    assert_eq!(status.components[0].troubles[0].code, "memory-growth");
    up.signal(Signal::TERM);
    let (code, events) = up.end();
    assert_eq!(code, Some(0));
    assert!(!codes(&events, "well").contains(&"memory-growth".to_owned()));
    bench.assert_nothing_left();
}

#[test]
fn a_component_that_sends_only_garbage_is_stopped() {
    let bench = Bench::new();
    let mut up = bench.start(vec![component("a", "babble", &[]), well("b")]);
    let first = up.await_event("garbage", Some("a"));
    assert!(first.contains("further faults are not reported"), "{first}");
    let second = up.await_event("garbage", Some("a"));
    assert_eq!(
        second,
        "sent more than 1 MiB that its supervisor cannot read, and is stopped"
    );
    up.await_event("exited", Some("a"));
    assert_eq!(
        bench.status().components[1].state,
        rc_deploy::ComponentState::Running
    );
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(3));
    bench.assert_nothing_left();
}

/// The component `interop` over DDS.
fn interop(bench: &Bench, domain: &str) -> Component {
    let folder = Path::new(env!("CARGO_BIN_EXE_rcdeploy")).parent();
    let program = folder.expect("the target folder").join("interop");
    assert!(
        program.exists(),
        "{} is missing: run the tests by `cargo xtask test`",
        program.display()
    );
    let domain = format!("dds.domain={domain}");
    let args = ["--network", &bench.network, "--set-middleware", &domain];
    let args = args
        .into_iter()
        .chain(["--set-middleware", "dds.interfaces=lo"]);
    Component {
        args: args.map(str::to_owned).collect(),
        ..Component::new("interop", program, "/")
    }
}

#[test]
fn a_mismatched_endpoint_that_joins_later_is_reported() {
    const DOMAIN: &str = "61";
    let bench = Bench::new();
    let mut up = bench.start(vec![interop(&bench, DOMAIN)]);
    up.await_event("up", None);
    // As if on another machine, a publisher sends reports that may get lost; the component wants
    // them all.
    let network = format!("{}-beside", bench.network);
    let mut environment = Environment {
        directory: RunDirectory::open(&network).expect("a run directory"),
        network,
        instance: "stranger".to_owned(),
        wake_event: WakeEvent::new().expect("a wake event"),
        settings: Settings::default(),
    };
    let settings = &mut environment.settings;
    settings.set("dds", "domain", Value::Int(61));
    settings.set("dds", "interfaces", Value::Texts(vec!["lo".to_owned()]));
    let there: Box<dyn Backend> = rc_dds::connect(&environment).expect("the domain");
    let publisher = there.publisher(&Endpoint {
        address: Address::parse(&format!("{}/Reports/report", bench.network)).expect("an address"),
        types: TypeIdentity {
            name: "RcInterop::Reports/report".to_owned(),
            // Types of no component: else the publisher is refused if it finds the subscriber in
            // time.
            hash: 0,
        },
        qos: Qos {
            reliability: rc_middleware::qos::Reliability::BestEffort,
            ..Qos::PUBLISHER
        },
        external_types: Vec::new(),
    });
    let publisher = publisher.expect("a publisher");
    let message = up.await_event("mismatch", Some("interop"));
    assert!(
        message.contains("reliability: offered best_effort, requested reliable"),
        "{message}"
    );
    drop(publisher);
    drop(there);
    let _ = environment.directory.remove();
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// The sources below `folder`; those of tests make up codes of their own.
fn sources(folder: &Path, texts: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() && !path.ends_with("tests") {
            sources(&path, texts);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            texts.push(std::fs::read_to_string(path).expect("a source"));
        }
    }
}

/// Programs rely on the codes.
#[test]
fn every_code_is_in_the_table() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let table =
        std::fs::read_to_string(root.join("../docs/protocol/output.md")).expect("the table");
    let mut texts = Vec::new();
    sources(root, &mut texts);
    let mut count = 0;
    for text in texts {
        // Where an event is made, its code comes after its severity.
        for (at, _) in text.match_indices("Severity::") {
            let rest = text[at..].split_once(',').map_or("", |(_, rest)| rest);
            let Some(code) = rest.trim_start().strip_prefix('"') else {
                continue;
            };
            let code = code.split('"').next().unwrap_or_default();
            assert!(
                table.contains(&format!("`{code}`")),
                "`{code}` is in no row"
            );
            count += 1;
        }
    }
    assert!(count > 30, "{count} events were found");
}
