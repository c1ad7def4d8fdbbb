//! `/parameter_events`: a node publishes every change of its parameters, by any requester.

use crate::network::dds::{Domain, Over, python};

#[test]
fn every_change_of_a_parameter_is_published() {
    let Some(python) = python("every_change_of_a_parameter_is_published") else {
        return;
    };
    let domain = Domain::over(Over::Ros2, "ros_events", 17);
    let network = &domain.site.network;
    let node = format!("/{network}/interop");
    // Late joiners discover it at once, as `rmw_cyclonedds` with
    // ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST.
    let config = "<Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery>";
    let mut peer = domain.external_with(python, "events.py", &[&node], config);
    peer.says("listens");
    let component = domain.start(&[]);
    // Secret parameters are left out.
    assert_eq!(
        peer.line(),
        "new speed=1.0 count=7 images.bytes=64 images.count=0 arm.joints=['a', 'b']"
    );
    let mut next = |command: &str| {
        peer.write(&format!("{command}\n"));
        let mut lines: Vec<String> = (0..3).map(|_| peer.line()).collect();
        lines.sort();
        lines
    };
    // One event for each change, none for refused changes.
    assert_eq!(
        next("set"),
        [
            "changed speed=2.5",
            "changed speed=3.0",
            "set True False True"
        ]
    );
    let params = |changes: &[&str]| {
        let args = [&["params", "set", network, "interop"], changes].concat();
        domain.site.rcdeploy(&args, false)
    };
    // No event for equal, secret and refused values. An element is published with its array.
    assert_eq!(params(&["speed=3.0"]).code, 0);
    assert_eq!(params(&["token=other"]).code, 0);
    assert_ne!(params(&["speed=1", "count=8"]).code, 0);
    let ran = params(&["speed=4", "arm.joints[1]=c", "token=third"]);
    assert_eq!(ran.code, 0, "{ran:?}");
    assert_eq!(
        peer.line(),
        "changed speed=4.0 arm.joints=['a', 'c']",
        "{}",
        component.log()
    );
    peer.write("set_atomically\n");
    let mut lines = [peer.line(), peer.line()];
    lines.sort();
    assert_eq!(
        lines,
        ["changed speed=3.5 arm.joints=['x', 'y']", "set True"]
    );
    assert_eq!(peer.end(), [""; 0]);
    assert!(!component.log().contains("WARN"), "{}", component.log());
}
