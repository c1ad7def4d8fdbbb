//! A generated component and programs of the Python package `cyclonedds`, which use the names of
//! ROS 2 and the service mapping of Cyclone DDS. The programs are in `middleware/ros2/tests/stranger`,
//! the component is `interop`. `ros_fast` and `ros_rclpy` test the mapping of Fast DDS.

use crate::network::asker::{Asker, PATIENCE};
use crate::network::dds::{Domain, Over, Stranger, python};
use crate::network::site::{Running, Site};
use rc_middleware::CallError;
use std::time::Instant;

fn domain(name: &str, id: u32) -> Domain {
    Domain::over(Over::Ros2, name, id)
}

/// A stranger that tells reports until they have come back. It begins when the component has found its ends.
fn repeat(domain: &Domain, python: &std::path::Path, args: &[&str]) -> Stranger {
    let mut stranger = domain.stranger(python, "repeat.py", args);
    stranger.says("met");
    Site::until("the component finds the stranger", || {
        domain.slot("Reports")["peers"] == 1 && domain.slot("Echoes")["peers"] == 1
    });
    stranger.write("\n");
    stranger
}

/// Strings, numbers, an enum, a dictionary, a structure in another one, a sequence of them: there and back, nothing lost,
/// in order.
#[test]
fn reports_come_and_go_in_ros() {
    let Some(python) = python("reports_come_and_go_in_ros") else {
        return;
    };
    let domain = domain("ros_repeat", 1);
    let component = domain.start(&[]);
    let said = repeat(&domain, python, &["5000"]).end();
    assert_eq!(said, ["told 5000 heard 5000"], "{}", component.log());
    let reports = domain.slot("Reports");
    assert_eq!(reports["handlers"]["count"], 5000, "{reports}");
    assert_eq!(reports["handlers"]["errors"], 0, "{reports}");
    assert_eq!(reports["lost"], 0, "{reports}");
    assert!(!component.log().contains("WARN"), "{}", component.log());
}

/// Samples of all lengths, in one packet and in several, whether they end at a multiple of four or not.
#[test]
fn every_length_reaches_a_stranger() {
    let Some(python) = python("every_length_reaches_a_stranger") else {
        return;
    };
    let domain = domain("ros_lengths", 2);
    let component = domain.start(&[]);
    let lengths = [
        "1300", "1301", "1302", "1303", "2048", "2049", "2050", "2051", "65535", "204801",
        "204802", "204803", "1048576",
    ];
    let args = [&["26"], &lengths[..]].concat();
    let said = repeat(&domain, python, &args).end();
    assert_eq!(said, ["told 26 heard 26"], "{}", component.log());
}

#[test]
fn a_stranger_of_ros_calls() {
    let Some(python) = python("a_stranger_of_ros_calls") else {
        return;
    };
    let domain = domain("ros_ask", 3);
    let _component = domain.start(&[]);
    let said = domain.stranger(python, "ask.py", &[]).end();
    let moved =
        "marks=[Mark(name='a', at=Point(x=1.5, y=2.5)), Mark(name='', at=Point(x=0.5, y=0.5))]";
    let expected = [
        "sum=1099511627774",
        "code=0, nonsense=Nonsense(what='', code=0), count=2",
        "code=1, nonsense=Nonsense(what='`bare` has no marks', code=-7), count=0",
        "InteropNote_Response(",
        "result=['from Python']",
        "shifted 2048",
        "shifted 2049",
        "shifted 204803",
        "shifted 1048576",
    ];
    assert_eq!(said.len(), expected.len(), "{said:?}");
    assert!(said[1].contains(moved), "{said:?}");
    for (said, expected) in said.iter().zip(expected) {
        assert!(said.contains(expected), "{said}");
    }
    let calls = domain.slot("Interop");
    assert_eq!(calls["handlers"]["count"], 9, "{calls}");
    assert_eq!(calls["handlers"]["errors"], 0, "{calls}");
}

/// Whose reader of replies is found later than its request comes is answered all the same.
#[test]
fn the_first_call_is_answered() {
    let Some(python) = python("the_first_call_is_answered") else {
        return;
    };
    let domain = domain("ros_first", 4);
    let component = domain.start(&[]);
    let said = domain.stranger(python, "first.py", &["40"]).end();
    assert_eq!(said, ["answered 40"]);
    drop(component);
    // The same between components, in the other mapping.
    let _component = domain.start(&[]);
    for number in 0..10 {
        let mut client = asker(&domain, &format!("asker{number}"));
        assert_eq!(client.add(number, 1).expect("an answer"), number + 1);
    }
}

#[test]
fn a_component_calls_a_stranger_of_ros() {
    let Some(python) = python("a_component_calls_a_stranger_of_ros") else {
        return;
    };
    let domain = domain("ros_consult", 5);
    let _component = domain.start(&[]);
    let mut consult = domain.stranger(python, "consult.py", &[]);
    consult.says("ready");
    consult.write("1000 early\n");
    let early = consult.line();
    assert!(early.contains("no server at"), "{early}");
    let mut oracle = domain.stranger(python, "oracle.py", &[]);
    oracle.says("ready");
    Site::until("the component finds the oracle", || {
        domain.slot("Oracle")["peers"] == 1
    });
    for (question, answer) in [
        ("where", "1099511627776 at 1.5 -2.5"),
        ("nonsense", "nonsense 9: so it is"),
    ] {
        consult.write(&format!("10000 {question}\n"));
        assert_eq!(consult.line(), answer);
    }
    oracle.says("told where");
    oracle.says("asked nonsense");
    // A stranger that dies says nothing of it, and nobody else does; the call ends by its own limit.
    consult.write("700 hold\n");
    oracle.says("asked hold");
    oracle.kill();
    let late = consult.line();
    assert!(late.contains("no reply from"), "{late}");
    consult.end();
}

#[test]
fn who_comes_late_into_ros_gets_what_was_kept() {
    let Some(python) = python("who_comes_late_into_ros_gets_what_was_kept") else {
        return;
    };
    let domain = domain("ros_late", 6);
    let early = domain.stranger(python, "late.py", &["5"]);
    early.says("ready");
    let _component = domain.start(&[]);
    // Five were ordered; the last three were kept.
    let mut client = asker(&domain, "early");
    Site::until("the orders came", || {
        domain.slot("Orders")["handlers"]["count"] == 3
    });
    for number in 0..8 {
        client.note(&format!("note {number}"));
    }
    let noted = client.noted();
    let ordered: Vec<String> = (2..5).map(|number| format!("order {number}")).collect();
    assert_eq!(noted[..3], ordered);
    let late = domain.stranger(python, "late.py", &["5"]);
    late.says("ready");
    for number in 0..5 {
        assert_eq!(early.line(), format!("note {number}"));
    }
    // The library forgets what is beyond the depth now and then.
    let first = late.line();
    let first = first.strip_prefix("note ").and_then(|n| n.parse().ok());
    let first: u32 = first.expect("a number");
    for number in first + 1..(first + 5).min(8) {
        assert_eq!(late.line(), format!("note {number}"));
    }
    early.end();
}

/// The mapping of services that ROS 2 has by default, between components: also what is larger than a packet.
#[test]
fn components_call_each_other_in_ros() {
    let domain = domain("ros_enhanced", 7);
    let _component = domain.start(&[]);
    let mut client = asker(&domain, "asker");
    assert_eq!(client.add(40, 2).expect("a sum"), 42);
    let mut noted = Vec::new();
    for size in [3, 1000, 1021, 1400, 2051, 200 * 1024 + 1] {
        let text = "x".repeat(size);
        client.note(&text);
        noted.push(text);
        assert!(client.noted() == noted, "{size}");
    }
    let calls = domain.slot("Interop");
    assert_eq!(calls["handlers"]["count"], 13, "{calls}");
    assert_eq!(calls["handlers"]["errors"], 0, "{calls}");
}

/// A server that was killed ends a call within its lease, though ROS 2 learns of it after most of a minute; and the next
/// server is found.
#[test]
fn a_call_in_ros_ends_with_its_server() {
    let Some(python) = python("a_call_in_ros_ends_with_its_server") else {
        return;
    };
    let domain = domain("ros_died", 8);
    let mut component = domain.start(&[]);
    let mut oracle = domain.stranger(python, "oracle.py", &[]);
    oracle.says("ready");
    let mut attempt = |component: &mut Running, client: &mut Asker| {
        Site::until("the component finds the oracle", || {
            domain.slot("Oracle")["peers"] == 1
        });
        let oracle = &mut oracle;
        std::thread::scope(|scope| {
            let killer = scope.spawn(move || {
                oracle.says("asked hold");
                component.kill();
                Instant::now()
            });
            let answer = client.consult("hold", PATIENCE);
            let took = killer.join().expect("it was asked").elapsed();
            assert!(
                matches!(answer, Err(CallError::ServerDied(_))),
                "{answer:?}"
            );
            assert!(took < PATIENCE / 2, "{took:?}");
        });
    };
    let mut client = asker(&domain, "asker");
    attempt(&mut component, &mut client);
    // The same client finds who comes next, and the one after that.
    let mut component = domain.start(&[]);
    Site::until("the next one is found", || client.add(1, 2).is_ok());
    attempt(&mut component, &mut client);
    let _component = domain.start(&[]);
    Site::until("the last one is found", || client.add(1, 2).is_ok());
}

/// A subscriber that was killed confirms nothing any more, and is not missed by anybody for most of a minute.
#[test]
fn a_killed_subscriber_holds_nobody_up() {
    let Some(python) = python("a_killed_subscriber_holds_nobody_up") else {
        return;
    };
    let domain = domain("ros_killed", 9);
    let component = domain.start(&[]);
    let mut stranger = domain.stranger(python, "repeat.py", &["5000"]);
    stranger.says("met");
    Site::until("the component finds it", || {
        domain.slot("Reports")["peers"] == 1 && domain.slot("Echoes")["peers"] == 1
    });
    let mut killed = domain.stranger(python, "repeat.py", &["5000"]);
    killed.says("met");
    Site::until("the component finds the other one", || {
        domain.slot("Echoes")["peers"] == 2
    });
    killed.kill();
    stranger.write("\n");
    assert_eq!(
        stranger.end(),
        ["told 5000 heard 5000"],
        "{}",
        component.log()
    );
}

/// A client of the component.
pub(crate) fn asker(domain: &Domain, name: &str) -> Asker {
    let types = [
        (Asker::NOTE, "interop_msgs/srv/InteropNote"),
        (Asker::NOTED, "interop_msgs/srv/InteropNoted"),
        (Asker::CONSULT, "interop_msgs/srv/InteropConsult"),
        (Asker::ADD, "example_interfaces/srv/AddTwoInts"),
    ];
    Asker::meet(domain, name, &[], &types)
}

/// A client of somebody else, who adds at `service`.
pub(crate) fn adding_at(domain: &Domain, service: &str) -> Asker {
    let rule = format!("Interop/add:={service}");
    let types = [(Asker::ADD, "example_interfaces/srv/AddTwoInts")];
    Asker::meet(domain, "adder", &[("remap", &rule)], &types)
}
