//! A generated component beside rclpy of ROS 2 Jazzy on Fast DDS, both with their default settings.
//! The programs are in `middleware/ros2/tests/rclpy`.

use crate::network::dds::{Domain, ExternalProgram, Over};
use rc_test_site::site::Site;
use rc_test_support::python;
use rustix::process::{Signal, kill_process};
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest time until a node on Fast DDS has removed a component that has ended. Without a message,
/// it would wait for the lease.
const LEAVING: Duration = Duration::from_secs(5);

fn domain(name: &str, id: u32) -> Domain {
    Domain::over(Over::Ros2, name, id)
}

/// Waits until the component has found peers at these slots.
fn until_peers(domain: &Domain, slots: &[&str]) {
    Site::until("the component finds the node of rclpy", || {
        slots.iter().all(|slot| domain.slot(slot)["peers"] == 1)
    });
}

/// Runs a program to its end. Returns its lines.
fn lines(domain: &Domain, python: &Path, program: &str, args: &[&str]) -> Vec<String> {
    domain.rclpy(python, program, args).end()
}

#[test]
fn strings_travel_both_ways() {
    let Some(python) = python::ros("strings_travel_both_ways") else {
        return;
    };
    let domain = domain("rclpy_strings", 40);
    let component = domain.start_local(&[]);
    let sizes = ["64", "0", "1", "1301", "65535", "1048576", "64"];
    let mut repeat = domain.rclpy(python, "repeat.py", &sizes);
    repeat.says("met");
    until_peers(&domain, &["Talk", "Gossip"]);
    repeat.write("\n");
    assert_eq!(repeat.end(), ["repeated 7"], "{}", component.log());
}

#[test]
fn a_client_of_rclpy_calls() {
    let Some(python) = python::ros("a_client_of_rclpy_calls") else {
        return;
    };
    let domain = domain("rclpy_ask", 41);
    let component = domain.start_local(&[]);
    let service = "Camera/setCameraInfo";
    let sizes = ["64", "0", "1025", "65536", "1048576", "10485760"];
    let said = lines(
        &domain,
        python,
        "ask.py",
        &[&[service], &sizes[..]].concat(),
    );
    assert_eq!(said, ["answered 6"], "{}", component.log());
}

/// Clients that call as soon as they have found the service. Often the component has not found them
/// by then; Fast DDS would repeat such a request after three seconds.
#[test]
fn first_calls_of_rclpy_do_not_wait_for_a_heartbeat() {
    let Some(python) = python::ros("first_calls_of_rclpy_do_not_wait_for_a_heartbeat") else {
        return;
    };
    let domain = domain("rclpy_first", 47);
    let component = domain.start_local(&[]);
    let said = lines(&domain, python, "first.py", &["20"]);
    let time = |line: &String| line.strip_prefix("call ")?.parse().ok();
    let mut times: Vec<u32> = said.iter().filter_map(time).collect();
    times.sort_unstable();
    assert_eq!(times.len(), 20, "{said:?}");
    assert!(times[19] < 2000, "{times:?} ms; {}", component.log());
}

#[test]
fn a_server_of_rclpy_answers() {
    let Some(python) = python::ros("a_server_of_rclpy_answers") else {
        return;
    };
    let domain = domain("rclpy_serve", 42);
    let component = domain.start_local(&[]);
    let server = domain.rclpy(python, "serve.py", &[]);
    server.says("ready");
    until_peers(&domain, &["CameraDriver"]);
    let sizes = ["64", "0", "1025", "65536", "1048576", "10485760"];
    let said = lines(&domain, python, "ask_forward.py", &sizes);
    assert_eq!(said, ["forwarded 6"], "{}", component.log());
    server.end();
}

/// All parameters of a node with more than two hundred, in one reply.
#[test]
fn rclpy_reads_and_sets_parameters() {
    let Some(python) = python::ros("rclpy_reads_and_sets_parameters") else {
        return;
    };
    let domain = domain("rclpy_parameters", 43);
    let wheels = "[[parameters.wheels]]\nname = \"left\"\n".repeat(100);
    let config = domain.site.write("wheels.toml", &wheels);
    let component = domain.start_local(&["--config", &config.to_string_lossy()]);
    let said = lines(&domain, python, "parameters.py", &[]);
    let expected = [
        "listed 205",
        "described 205 read 205",
        "speed 1.0 False (0.0, 10.0)",
        "count 7 True (1, 100)",
        "images.bytes 64 False (0, 16777216)",
        "images.count 0 False (0, 2147483647)",
        "arm.joints ['a', 'b'] False",
        "set speed True ",
    ];
    assert_eq!(said[..8], expected, "{}", component.log());
    let refused = |line: &str, name: &str, reason: &str| {
        assert!(line.starts_with(&format!("set {name} False ")), "{line}");
        assert!(line.contains(reason), "{line}");
    };
    refused(&said[8], "speed", "from 0 to 10");
    refused(&said[9], "count", "fixed when the component starts");
    assert_eq!(said[10..], ["set True", "now 3.5 ['x', 'y']"]);
}

/// A component is a node with its topics, and nothing of its own beside them.
#[test]
fn the_graph_of_rclpy_has_the_component() {
    let Some(python) = python::ros("the_graph_of_rclpy_has_the_component") else {
        return;
    };
    let domain = domain("rclpy_graph", 44);
    let _component = domain.start_local(&[]);
    let said = lines(&domain, python, "graph.py", &[]);
    let topic = |name: &str, kind: &str| format!("topic {name} {kind}");
    let expected = [
        topic("/Archive/keep", "interop_msgs/msg/ArchiveKeep"),
        topic("/Echoes/echo", "interop_msgs/msg/Report"),
        topic("/Gossip/chatter", "std_msgs/msg/String"),
        topic("/Images/image", "sensor_msgs/msg/Image"),
        topic("/Orders/order", "interop_msgs/msg/OrdersOrder"),
        topic("/Reports/report", "interop_msgs/msg/Report"),
        topic("/Talk/chatter", "std_msgs/msg/String"),
    ];
    let topics: Vec<&String> = said
        .iter()
        .filter(|line| line.starts_with("topic "))
        .collect();
    assert_eq!(topics, expected.iter().collect::<Vec<_>>());
    let services = said.iter().filter(|line| line.starts_with("service "));
    assert_eq!(services.count(), 8, "{said:?}");
    // The subscription is rclpy's own. `codegen/rcgen/tests/ros/hashes.py` printed the hash of the
    // report.
    let string = "std_msgs/msg/String RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18";
    let report = "interop_msgs/msg/Report RIHS01_29b0b474199fd086b2e0c5dcad62e6d0b72f2a0ca13f4b9ab83d8b755af3fc74";
    assert_eq!(
        said[said.len() - 3..],
        [
            format!("publisher interop {string}"),
            format!("publisher interop {report}"),
            format!("subscription graph {string}"),
        ]
    );
}

/// The service `get_type_description` of a node describes types of ROS 2 and of the component.
#[test]
fn rclpy_reads_descriptions_of_types() {
    let Some(python) = python::ros("rclpy_reads_descriptions_of_types") else {
        return;
    };
    let domain = domain("rclpy_types", 47);
    let component = domain.start_local(&[]);
    let said = lines(&domain, python, "types.py", &[]);
    let expected = [
        "described sensor_msgs/msg/Image True",
        "same as rclpy True",
        "described interop_msgs/msg/Report True",
        "unknown False no endpoint of this node has a type with this hash",
    ];
    assert_eq!(said, expected, "{}", component.log());
}

/// A node that uses this machine alone finds a component that uses the loopback interface. A
/// component that ends says so: nodes on Fast DDS need not wait for its lease.
#[test]
fn a_component_that_ends_leaves_the_graph_of_rclpy() {
    let Some(python) = python::ros("a_component_that_ends_leaves_the_graph_of_rclpy") else {
        return;
    };
    let domain = domain("rclpy_leaving", 48);
    let component = domain.start(&[]);
    let node = domain.rclpy(python, "leaving.py", &[]);
    node.says("found");
    kill_process(component.pid(), Signal::TERM).expect("the component");
    let ended = Instant::now();
    assert_eq!(component.end(), Some(0));
    node.says("left");
    assert!(ended.elapsed() < LEAVING, "{:?}", ended.elapsed());
    assert_eq!(node.end(), [""; 0]);
}

/// The log is on `/rosout`, also what was logged before anybody listened.
#[test]
fn rclpy_reads_the_log() {
    let Some(python) = python::ros("rclpy_reads_the_log") else {
        return;
    };
    let domain = domain("rclpy_rosout", 49);
    let unknown = ["--set-middleware", "ros2.remap=Gosip:=/gossip"];
    let component = domain.start_local(&unknown);
    let said = lines(&domain, python, "rosout.py", &[]);
    assert_eq!(said[0], "published True");
    let [early, by_hand, change] = &said[1..] else {
        panic!("{said:?}\n{}", component.log());
    };
    // The levels of rcl_interfaces/msg/Log.
    assert!(early.starts_with("30 src/settings.rs remap"), "{early}");
    assert!(early.contains("Gosip"), "{early}");
    let expected = "20 src/stages.rs started without rcdeploy: this component calls servers at ";
    assert!(by_hand.starts_with(expected), "{by_hand}");
    let expected = "20 src/parameter_server.rs parameter speed";
    assert!(change.starts_with(expected), "{change}");
    drop(component);
    let off = ["--ros-args", "--disable-rosout-logs"];
    let component = domain.start_local(&off);
    let said = lines(&domain, python, "rosout.py", &[]);
    assert_eq!(said, ["published False"], "{}", component.log());
}

/// A client goes on with a server that was killed and started again.
#[test]
fn a_server_that_was_killed_is_usable_at_once() {
    let Some(python) = python::ros("a_server_that_was_killed_is_usable_at_once") else {
        return;
    };
    let domain = domain("rclpy_restarts", 45);
    let mut component = domain.start_local(&[]);
    let mut client: ExternalProgram = domain.rclpy(python, "restarts.py", &[]);
    client.says("ready");
    for _ in 0..3 {
        client.write("\n");
        assert_eq!(client.line(), "answered", "{}", component.log());
        component.kill();
        component = domain.start_local(&[]);
    }
    client.write("\n");
    assert_eq!(client.line(), "answered", "{}", component.log());
    client.end();
}

/// Publishes images of a megabyte at 30 Hz to a subscriber of rclpy. Returns how many it received.
fn received_images(python: &Path, domain: &Domain, reliability: &str, count: usize) -> usize {
    let component = domain.start_local(&[]);
    domain
        .site
        .tell("interop", "period", &serde_json::json!({ "ms": 33 }));
    let count = count.to_string();
    let images = domain.rclpy(python, "images.py", &[reliability, &count]);
    images.says("met");
    until_peers(domain, &["Images"]);
    let network = &domain.site.network;
    let count = format!("images.count={count}");
    let set = [
        "params",
        "set",
        network,
        "interop",
        "images.bytes=1048576",
        &count,
    ];
    let ran = domain.site.rcdeploy(&set, false);
    assert_eq!(ran.code, 0, "{ran:?}");
    let said = images.end();
    let received = said.first().and_then(|line| line.strip_prefix("received "));
    let received = received.and_then(|count| count.parse().ok());
    received.unwrap_or_else(|| panic!("{said:?}; {}", component.log()))
}

#[test]
fn images_arrive_at_rclpy() {
    let Some(python) = python::ros("images_arrive_at_rclpy") else {
        return;
    };
    let domain = domain("rclpy_images", 46);
    assert_eq!(received_images(python, &domain, "reliable", 30), 30);
}

/// Fast DDS has a small socket, and nothing is repeated. Without pacing, one image in ten arrives.
/// `cargo xtask bench rclpy` has the figure of a quiet machine.
#[test]
fn most_images_arrive_at_rclpy_without_repair() {
    let Some(python) = python::ros("most_images_arrive_at_rclpy_without_repair") else {
        return;
    };
    let domain = domain("rclpy_unrepaired", 48);
    let received = received_images(python, &domain, "best_effort", 60);
    assert!(received >= 42, "{received} of 60");
}
