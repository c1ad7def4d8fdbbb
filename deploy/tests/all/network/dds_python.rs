//! A generated component and programs of the Python package `cyclonedds`, which follow
//! `docs/dds.md`. The programs are in `middleware/dds/tests/stranger`, as examples for users; the
//! component is `interop`.

use crate::network::dds::{Domain, ExternalProgram, python};
use crate::network::interop_client::{InteropClient, PATIENCE};
use rc_test_site::site::Site;
use std::time::Instant;

/// A message with every kind of member travels both ways. Nothing is lost, and the order is kept.
#[test]
fn messages_travel_both_ways() {
    let Some(python) = python("messages_travel_both_ways") else {
        return;
    };
    let domain = Domain::new("dds_repeat", 215);
    let component = domain.start(&[]);
    let peer = domain.external(python, "repeat.py", &["10000"]);
    assert_eq!(
        peer.end(),
        ["told 10000 heard 10000"],
        "{}",
        component.log()
    );
    let reports = domain.slot("Reports");
    assert_eq!(reports["handlers"]["count"], 10_000, "{reports}");
    assert_eq!(reports["handlers"]["errors"], 0, "{reports}");
    assert_eq!(reports["lost"], 0, "{reports}");
    assert!(!component.log().contains("WARN"), "{}", component.log());
}

#[test]
fn a_python_client_calls_a_component_over_dds() {
    let Some(python) = python("a_python_client_calls_a_component_over_dds") else {
        return;
    };
    let domain = Domain::new("dds_ask", 216);
    let _component = domain.start(&[]);
    let said = domain.external(python, "ask.py", &[]).end();
    let moved =
        "marks=[Mark(name='a', at=Point(x=1.5, y=2.5)), Mark(name='', at=Point(x=0.5, y=0.5))]";
    let expected = [
        ("REMOTE_EX_OK", "Interop_shift_Out(count=2"),
        (
            "REMOTE_EX_OK",
            "Nonsense(what='`bare` has no marks', code=-7)",
        ),
        ("REMOTE_EX_OK", "Nothing(dummy=0)"),
        ("REMOTE_EX_OK", "return_=['from Python']"),
        ("REMOTE_EX_UNKNOWN_OPERATION", ""),
    ];
    assert_eq!(said.len(), expected.len(), "{said:?}");
    assert!(said[0].contains(moved), "{said:?}");
    for (said, (code, result)) in said.iter().zip(expected) {
        let outcome = said.split(' ').next();
        assert!(outcome == Some(code) && said.contains(result), "{said}");
    }
    let calls = domain.slot("Interop");
    assert_eq!(calls["handlers"]["count"], 5, "{calls}");
}

#[test]
fn a_component_calls_a_python_server_over_dds() {
    let Some(python) = python("a_component_calls_a_python_server_over_dds") else {
        return;
    };
    let domain = Domain::new("dds_consult", 217);
    let _component = domain.start(&[]);
    let mut consult = domain.external(python, "consult.py", &[]);
    consult.says("ready");
    consult.write("1000 early\n");
    let early = consult.line();
    assert!(early.contains("no server at"), "{early}");
    let oracle = domain.external(python, "oracle.py", &[]);
    oracle.says("ready");
    Site::until("the component finds the oracle", || {
        domain.slot("Oracle")["peers"] == 1
    });
    for (question, answer) in [
        ("where", "1099511627776 at 1.5 -2.5"),
        ("nonsense", "nonsense 9: so it is"),
        ("refuse", "refused: out of resources"),
    ] {
        consult.write(&format!("10000 {question}\n"));
        assert_eq!(consult.line(), answer);
    }
    assert_eq!(
        oracle.end(),
        [
            "asked where",
            "told where",
            "asked nonsense",
            "asked refuse"
        ]
    );
    consult.end();
}

#[test]
fn a_late_joiner_gets_the_last_samples() {
    let Some(python) = python("a_late_joiner_gets_the_last_samples") else {
        return;
    };
    let domain = Domain::new("dds_late", 218);
    let early = domain.external(python, "late.py", &["5"]);
    early.says("ready");
    let _component = domain.start(&[]);
    // Five orders were published; the depth is three.
    let mut client = interop_client(&domain, "early");
    Site::until("the orders came", || {
        domain.slot("Orders")["handlers"]["count"] == 3
    });
    Site::until("the component finds the subscriber", || {
        domain.slot("Archive")["peers"] == 1
    });
    for number in 0..8 {
        client.note(&format!("note {number}"));
    }
    let noted = client.noted();
    let ordered: Vec<String> = (2..5).map(|number| format!("order {number}")).collect();
    assert_eq!(noted[..3], ordered);
    let late = domain.external(python, "late.py", &["5"]);
    late.says("ready");
    for number in 3..8 {
        assert_eq!(late.line(), format!("note {number}"));
    }
    for number in 0..5 {
        assert_eq!(early.line(), format!("note {number}"));
    }
    early.end();
    late.end();
}

/// Incompatible quality of service is reported with both values. An endpoint of another type is
/// ignored.
#[test]
fn incompatible_policies_are_reported() {
    let Some(python) = python("incompatible_policies_are_reported") else {
        return;
    };
    let domain = Domain::new("dds_misfit", 219);
    let component = domain.start(&[]);
    let misfit = domain.external(python, "misfit.py", &[]);
    assert_eq!(misfit.line(), "matched 0 0");
    let told = [
        (
            "Reports/report",
            "reliability: offered best_effort, requested reliable",
        ),
        (
            "Echoes/echo",
            "durability: offered volatile, requested transient_local",
        ),
    ];
    Site::until("both are reported", || {
        let log = component.log();
        told.iter().all(|(topic, values)| {
            log.lines()
                .any(|line| line.contains(topic) && line.ends_with(values))
        })
    });
    let mut client = interop_client(&domain, "client");
    Site::until("the order came", || {
        domain.slot("Orders")["handlers"]["count"] == 1
    });
    assert_eq!(client.noted(), ["once"]);
    Site::until("one of the two is a publisher", || {
        domain.slot("Orders")["peers"] == 1
    });
    assert_eq!(domain.slot("Reports")["handlers"]["count"], 0);
    misfit.end();
}

/// A call to a server that was killed ends within the lease of the server.
#[test]
fn a_call_ends_with_its_server() {
    let Some(python) = python("a_call_ends_with_its_server") else {
        return;
    };
    let domain = Domain::new("dds_died", 220);
    let mut noticed = Vec::new();
    for (lease, announce) in [("1s", "250ms"), ("200ms", "50ms")] {
        let mut component = domain.start(&[&format!("dds.lease={lease}")]);
        // It announces itself four times within its lease, as components do.
        let config = format!(
            "<Discovery><LeaseDuration>{lease}</LeaseDuration><SPDPInterval>{announce}</SPDPInterval></Discovery>"
        );
        // Time from the kill to the error; `None` if the call ended before, because a process got
        // no processor for longer than its lease.
        let attempt = |kill: &mut dyn FnMut(&mut ExternalProgram), expected: &str| {
            let mut oracle = domain.external_with(python, "oracle.py", &[], &config);
            oracle.says("ready");
            Site::until("the component finds the oracle", || {
                domain.slot("Oracle")["peers"] == 1
            });
            std::thread::scope(|scope| {
                let answer =
                    scope.spawn(|| interop_client(&domain, "client").consult("hold", PATIENCE));
                while !oracle.has_said("asked hold") {
                    if answer.is_finished() {
                        return None;
                    }
                }
                let killed = Instant::now();
                kill(&mut oracle);
                let answer = answer.join().expect("an answer");
                let took = killed.elapsed();
                let answer = answer.unwrap_or_else(|error| format!("{error:?}"));
                assert!(answer.starts_with(expected), "{answer}");
                assert!(took < PATIENCE / 2, "{lease}: {took:?}");
                Some(took)
            })
        };
        let time = |kill: &mut dyn FnMut(&mut ExternalProgram), expected: &str| {
            (0..5)
                .find_map(|_| attempt(kill, expected))
                .expect("a question that waits")
        };
        // The component calls the program; then the component is called and killed.
        let peer = time(&mut |oracle| oracle.kill(), "the server died");
        let generated = time(&mut |_| component.kill(), "ServerDied");
        noticed.push(peer.min(generated));
    }
    assert!(noticed[1] < noticed[0], "{noticed:?}");
}

/// `CYCLONEDDS_URI` takes precedence.
#[test]
fn cyclones_own_configuration_is_respected() {
    let Some(python) = python("cyclones_own_configuration_is_respected") else {
        return;
    };
    let domain = Domain::new("dds_uri", 221);
    let trace = domain.site.path("trace");
    let config = format!(
        "<Discovery><ExternalDomainId>222</ExternalDomainId></Discovery>\
         <Tracing><Verbosity>config</Verbosity><OutputFile>{}</OutputFile></Tracing>",
        trace.display()
    );
    let component = domain.start_with(&[], &[("CYCLONEDDS_URI", &config)]);
    let elsewhere = Domain { id: 222, ..domain };
    let said = elsewhere.external(python, "repeat.py", &["3"]).end();
    assert_eq!(said, ["told 3 heard 3"], "{}", component.log());
    let traced = std::fs::read_to_string(trace).expect("a trace");
    assert!(traced.contains("ExternalDomainId"), "{traced}");
}

#[test]
fn an_unknown_interface_is_reported_with_the_known_ones() {
    let domain = Domain::new("dds_interface", 223);
    let args = ["--set-middleware", "dds.interfaces=lo,wlan77"];
    let args = [&["--network", &domain.site.network], &args[..]].concat();
    let ran = domain.site.component(domain.over.program(), &args);
    assert_ne!(ran.code, 0, "{ran:?}");
    let (_, there) = ran
        .stderr
        .split_once("there is no network interface `wlan77`; there are ")
        .unwrap_or_else(|| panic!("{ran:?}"));
    let there = there.lines().next().unwrap_or_default();
    let mut names = there.split(", ");
    assert!(names.any(|name| name == "lo (127.0.0.1)"), "{ran:?}");
}

/// A client of the component.
fn interop_client(domain: &Domain, name: &str) -> InteropClient {
    InteropClient::meet(domain, name, &[], &[])
}
