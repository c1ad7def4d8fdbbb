//! A generated component beside rclpy of ROS 2 Jazzy on Fast DDS, both with their default settings. The
//! programs are in `middleware/ros2/tests/rclpy`.

use crate::network::dds::{Domain, Over, Stranger};
use crate::network::site::Site;
use crate::python;
use std::path::Path;

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
    let component = domain.start(&[]);
    let sizes = ["64", "0", "1", "1301", "65535", "1048576", "64"];
    let mut repeat = domain.rclpy(python, "repeat.py", &sizes);
    repeat.says("met");
    until_peers(&domain, &["Talk", "Gossip"]);
    repeat.write("\n");
    assert_eq!(repeat.end(), ["repeated 7"], "{}", component.log());
}

/// A component is a node with its topics, and nothing of its own beside them.
#[test]
fn the_graph_of_rclpy_has_the_component() {
    let Some(python) = python::ros("the_graph_of_rclpy_has_the_component") else {
        return;
    };
    let domain = domain("rclpy_graph", 44);
    let _component = domain.start(&[]);
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
    assert_eq!(services.count(), 6, "{said:?}");
    let publisher = said.last().expect("a publisher");
    let expected = "publisher interop std_msgs/msg/String ";
    assert!(publisher.starts_with(expected), "{publisher}");
}

/// A client goes on with a server that was killed and started again.
#[test]
fn a_server_that_was_killed_is_usable_at_once() {
    let Some(python) = python::ros("a_server_that_was_killed_is_usable_at_once") else {
        return;
    };
    let domain = domain("rclpy_restarts", 45);
    let mut component = domain.start(&[]);
    let mut client: Stranger = domain.rclpy(python, "restarts.py", &[]);
    client.says("ready");
    for _ in 0..3 {
        client.write("\n");
        assert_eq!(client.line(), "answered", "{}", component.log());
        component.kill();
        component = domain.start(&[]);
    }
    client.write("\n");
    assert_eq!(client.line(), "answered", "{}", component.log());
    client.end();
}
