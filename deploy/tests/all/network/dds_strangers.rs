//! Strangers: programs that meet a generated component with the package `cyclonedds` of Python and nothing of ours, as
//! `docs/dds.md` tells them. The programs are in `middleware/dds/tests/stranger`, for people to begin with;
//! so is the component, `interop`.

use crate::network::asker::{Asker, PATIENCE};
use crate::network::dds::{Domain, Stranger, python};
use crate::network::site::Site;
use std::time::Instant;

/// A string, numbers, an enum, a structure in another one, a sequence of them: there and back, nothing lost, in order.
#[test]
fn reports_come_and_go() {
    let Some(python) = python("reports_come_and_go") else {
        return;
    };
    let domain = Domain::new("dds_repeat", 215);
    let component = domain.start(&[]);
    let stranger = domain.stranger(python, "repeat.py", &["10000"]);
    assert_eq!(
        stranger.end(),
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
fn a_stranger_calls() {
    let Some(python) = python("a_stranger_calls") else {
        return;
    };
    let domain = Domain::new("dds_ask", 216);
    let _component = domain.start(&[]);
    let said = domain.stranger(python, "ask.py", &[]).end();
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
fn a_component_calls_a_stranger() {
    let Some(python) = python("a_component_calls_a_stranger") else {
        return;
    };
    let domain = Domain::new("dds_consult", 217);
    let _component = domain.start(&[]);
    let mut consult = domain.stranger(python, "consult.py", &[]);
    consult.says("ready");
    consult.write("1000 early\n");
    let early = consult.line();
    assert!(early.contains("no server at"), "{early}");
    let oracle = domain.stranger(python, "oracle.py", &[]);
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
fn who_comes_late_gets_what_was_kept() {
    let Some(python) = python("who_comes_late_gets_what_was_kept") else {
        return;
    };
    let domain = Domain::new("dds_late", 218);
    let early = domain.stranger(python, "late.py", &["5"]);
    early.says("ready");
    let _component = domain.start(&[]);
    // Five were ordered; the last three were kept.
    let mut client = asker(&domain, "early");
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
    let late = domain.stranger(python, "late.py", &["5"]);
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

/// Qualities of service that do not fit are told with both values; another type is nobody, and does no harm.
#[test]
fn what_does_not_fit_is_told() {
    let Some(python) = python("what_does_not_fit_is_told") else {
        return;
    };
    let domain = Domain::new("dds_misfit", 219);
    let component = domain.start(&[]);
    let misfit = domain.stranger(python, "misfit.py", &[]);
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
    Site::until("both are told", || {
        let log = component.log();
        told.iter().all(|(topic, values)| {
            log.lines()
                .any(|line| line.contains(topic) && line.ends_with(values))
        })
    });
    let mut client = asker(&domain, "asker");
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

/// A server that was killed ends a call within its lease.
#[test]
fn a_call_ends_with_its_server() {
    let Some(python) = python("a_call_ends_with_its_server") else {
        return;
    };
    let domain = Domain::new("dds_died", 220);
    let mut noticed = Vec::new();
    for (lease, announce) in [("1s", "250ms"), ("200ms", "50ms")] {
        let mut component = domain.start(&[&format!("dds.lease={lease}")]);
        // It tells how long it may be silent, and is heard four times in that time, as components are.
        let config = format!(
            "<Discovery><LeaseDuration>{lease}</LeaseDuration><SPDPInterval>{announce}</SPDPInterval></Discovery>"
        );
        // How long it takes from the kill until the question has its answer; none where there was one before, because a
        // process waited for a processor for longer than its lease.
        let attempt = |kill: &mut dyn FnMut(&mut Stranger), expected: &str| {
            let mut oracle = domain.stranger_with(python, "oracle.py", &[], &config);
            oracle.says("ready");
            Site::until("the component finds the oracle", || {
                domain.slot("Oracle")["peers"] == 1
            });
            std::thread::scope(|scope| {
                let answer = scope.spawn(|| asker(&domain, "asker").consult("hold", PATIENCE));
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
        let time = |kill: &mut dyn FnMut(&mut Stranger), expected: &str| {
            (0..5)
                .find_map(|_| attempt(kill, expected))
                .expect("a question that waits")
        };
        // The component, which is generated, calls a stranger; then it is called, and killed.
        let stranger = time(&mut |oracle| oracle.kill(), "the server died");
        let generated = time(&mut |_| component.kill(), "ServerDied");
        noticed.push(stranger.min(generated));
    }
    assert!(noticed[1] < noticed[0], "{noticed:?}");
}

/// What somebody sets for Cyclone itself wins.
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
    let said = elsewhere.stranger(python, "repeat.py", &["3"]).end();
    assert_eq!(said, ["told 3 heard 3"], "{}", component.log());
    let traced = std::fs::read_to_string(trace).expect("a trace");
    assert!(traced.contains("ExternalDomainId"), "{traced}");
}

#[test]
fn a_wrong_interface_is_told_with_those_there_are() {
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
fn asker(domain: &Domain, name: &str) -> Asker {
    Asker::meet(domain, name, &[], &[])
}
