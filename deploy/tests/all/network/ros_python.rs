//! A generated component and programs of the Python package `cyclonedds`, which use the names of
//! ROS 2 and the service mapping of Cyclone DDS. The programs are in
//! `middleware/ros2/tests/stranger`, the component is `interop`. `ros_fast` and `ros_rclpy` test
//! the mapping of Fast DDS.

use crate::network::dds::{Domain, ExternalProgram, Over, python};
use crate::network::interop_client::{InteropClient, PATIENCE};
use rc_middleware::CallError;
use rc_test_site::site::{Running, Site};
use std::time::Instant;

fn domain(name: &str, id: u32) -> Domain {
    Domain::over(Over::Ros2, name, id)
}

/// A program that publishes reports and receives them again. It begins when the component has
/// discovered its endpoints.
fn repeat(domain: &Domain, python: &std::path::Path, args: &[&str]) -> ExternalProgram {
    let mut peer = domain.external(python, "repeat.py", args);
    peer.says("met");
    Site::until("the component finds the program", || {
        domain.slot("Reports")["peers"] == 1 && domain.slot("Echoes")["peers"] == 1
    });
    peer.write("\n");
    peer
}

/// A message with every kind of member travels both ways. Nothing is lost, and the order is kept.
#[test]
fn messages_travel_both_ways_in_ros() {
    let Some(python) = python("messages_travel_both_ways_in_ros") else {
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

/// Samples of all lengths arrive, in one packet and in several, whatever the remainder modulo four.
#[test]
fn samples_of_every_length_reach_a_python_program() {
    let Some(python) = python("samples_of_every_length_reach_a_python_program") else {
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
fn a_python_client_calls_a_component() {
    let Some(python) = python("a_python_client_calls_a_component") else {
        return;
    };
    let domain = domain("ros_ask", 3);
    let _component = domain.start(&[]);
    let said = domain.external(python, "ask.py", &[]).end();
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

/// A client gets its reply even if the server discovers the reader of replies after the request.
#[test]
fn the_first_call_gets_a_reply() {
    let Some(python) = python("the_first_call_gets_a_reply") else {
        return;
    };
    let domain = domain("ros_first", 4);
    let component = domain.start(&[]);
    let said = domain.external(python, "first.py", &["40"]).end();
    assert_eq!(said, ["answered 40"]);
    drop(component);
    // A component finds the server, too: it uses the mapping of Fast DDS.
    let _component = domain.start(&[]);
    for number in 0..10 {
        let mut client = interop_client(&domain, &format!("client{number}"));
        assert_eq!(client.add(number, 1).expect("an answer"), number + 1);
    }
}

#[test]
fn a_component_calls_a_python_server() {
    let Some(python) = python("a_component_calls_a_python_server") else {
        return;
    };
    let domain = domain("ros_consult", 5);
    let _component = domain.start(&[]);
    let mut consult = domain.external(python, "consult.py", &[]);
    consult.says("ready");
    consult.write("1000 early\n");
    let early = consult.line();
    assert!(early.contains("no server at"), "{early}");
    let mut oracle = domain.external(python, "oracle.py", &[]);
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
    oracle.says_all(&["told where", "asked nonsense"]);
    // The process of the server is killed and sends nothing; its lease is long. The call ends at
    // its deadline.
    consult.write("700 hold\n");
    oracle.says("asked hold");
    oracle.kill();
    let late = consult.line();
    assert!(late.contains("no reply from"), "{late}");
    consult.end();
}

#[test]
fn a_late_joiner_in_ros_gets_the_last_samples() {
    let Some(python) = python("a_late_joiner_in_ros_gets_the_last_samples") else {
        return;
    };
    let domain = domain("ros_late", 6);
    let early = domain.external(python, "late.py", &["5"]);
    early.says("ready");
    let _component = domain.start(&[]);
    // Five orders were published; the depth is three.
    let mut client = interop_client(&domain, "early");
    Site::until("the orders came", || {
        domain.slot("Orders")["handlers"]["count"] == 3
    });
    for number in 0..8 {
        client.note(&format!("note {number}"));
    }
    let noted = client.noted();
    let ordered: Vec<String> = (2..5).map(|number| format!("order {number}")).collect();
    assert_eq!(noted[..3], ordered);
    let late = domain.external(python, "late.py", &["5"]);
    late.says("ready");
    for number in 0..5 {
        assert_eq!(early.line(), format!("note {number}"));
    }
    // The library removes samples beyond the depth with a delay.
    let first = late.line();
    let first = first.strip_prefix("note ").and_then(|n| n.parse().ok());
    let first: u32 = first.expect("a number");
    for number in first + 1..(first + 5).min(8) {
        assert_eq!(late.line(), format!("note {number}"));
    }
    early.end();
}

/// Components call each other in the mapping of Fast DDS, also with requests and replies larger
/// than a packet.
#[test]
fn components_call_each_other_in_ros() {
    let domain = domain("ros_enhanced", 7);
    let _component = domain.start(&[]);
    let mut client = interop_client(&domain, "client");
    assert_eq!(client.add(40, 2).expect("a sum"), 42);
    let mut noted = Vec::new();
    for size in [3, 1000, 1021, 1400, 2051, 200 * 1024 + 1] {
        let text = "x".repeat(size);
        client.note(&text);
        noted.push(text);
        assert!(client.noted() == noted, "{size}");
    }
    // A turn of the loop counts its calls at its end, when replies have been sent.
    Site::until("all calls are counted", || {
        domain.slot("Interop")["handlers"]["count"] == 13
    });
    let calls = domain.slot("Interop");
    assert_eq!(calls["handlers"]["errors"], 0, "{calls}");
}

/// A call to a component that was killed ends within the lease of the component, and its client
/// finds the next server.
#[test]
fn a_call_in_ros_ends_with_its_server() {
    let Some(python) = python("a_call_in_ros_ends_with_its_server") else {
        return;
    };
    let domain = domain("ros_died", 8);
    let mut component = domain.start(&[]);
    let mut oracle = domain.external(python, "oracle.py", &[]);
    oracle.says("ready");
    let mut attempt = |component: &mut Running, client: &mut InteropClient| {
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
    let mut client = interop_client(&domain, "client");
    attempt(&mut component, &mut client);
    // One client finds the next server, and the one after that.
    let mut component = domain.start(&[]);
    Site::until("the next server is found", || client.add(1, 2).is_ok());
    attempt(&mut component, &mut client);
    let _component = domain.start(&[]);
    Site::until("the last server is found", || client.add(1, 2).is_ok());
}

/// A subscriber that was killed confirms no samples until its lease ends. It delays no other
/// subscriber.
#[test]
fn a_killed_subscriber_delays_no_other() {
    let Some(python) = python("a_killed_subscriber_delays_no_other") else {
        return;
    };
    let domain = domain("ros_killed", 9);
    let component = domain.start(&[]);
    let mut peer = domain.external(python, "repeat.py", &["5000"]);
    peer.says("met");
    Site::until("the component finds the program", || {
        domain.slot("Reports")["peers"] == 1 && domain.slot("Echoes")["peers"] == 1
    });
    let mut killed = domain.external(python, "repeat.py", &["5000"]);
    killed.says("met");
    Site::until("the component finds the second program", || {
        domain.slot("Echoes")["peers"] == 2
    });
    killed.kill();
    peer.write("\n");
    assert_eq!(peer.end(), ["told 5000 heard 5000"], "{}", component.log());
}

/// A client of the component.
pub(crate) fn interop_client(domain: &Domain, name: &str) -> InteropClient {
    let types = [
        (InteropClient::NOTE, "interop_msgs/srv/InteropNote"),
        (InteropClient::NOTED, "interop_msgs/srv/InteropNoted"),
        (InteropClient::CONSULT, "interop_msgs/srv/InteropConsult"),
        (InteropClient::ADD, "example_interfaces/srv/AddTwoInts"),
    ];
    InteropClient::meet(domain, name, &[], &types)
}

/// A client of the service `service` of another program.
pub(crate) fn adding_at(domain: &Domain, service: &str) -> InteropClient {
    let rule = format!("Interop/add:={service}");
    let types = [(InteropClient::ADD, "example_interfaces/srv/AddTwoInts")];
    InteropClient::meet(domain, "adder", &[("remap", &rule)], &types)
}
