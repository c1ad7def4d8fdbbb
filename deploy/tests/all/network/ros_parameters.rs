//! What a node tells of its parameters in ROS 2, whoever changes them.

use crate::network::dds::{Domain, Over, python};

#[test]
fn every_change_of_a_parameter_is_told_in_ros() {
    let Some(python) = python("every_change_of_a_parameter_is_told_in_ros") else {
        return;
    };
    let domain = Domain::over(Over::Ros2, "ros_events", 17);
    let network = &domain.site.network;
    let node = format!("/{network}/interop");
    // Where it is found at once by who comes later, as `rmw_cyclonedds` is with ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST.
    let config = "<Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery>";
    let mut stranger = domain.stranger_with(python, "events.py", &[&node], config);
    stranger.says("listens");
    let component = domain.start(&[]);
    // What is secret is not among them.
    assert_eq!(
        stranger.line(),
        "new speed=1.0 count=7 images.bytes=64 images.count=0 arm.joints=['a', 'b']"
    );
    let mut next = |command: &str| {
        stranger.write(&format!("{command}\n"));
        let mut lines: Vec<String> = (0..3).map(|_| stranger.line()).collect();
        lines.sort();
        lines
    };
    // Each by itself, and nothing of what was refused.
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
    // What stays as it is, what is secret and what is refused is not told; one element is told with its array.
    assert_eq!(params(&["speed=3.0"]).code, 0);
    assert_eq!(params(&["token=other"]).code, 0);
    assert_ne!(params(&["speed=1", "count=8"]).code, 0);
    let ran = params(&["speed=4", "arm.joints[1]=c", "token=third"]);
    assert_eq!(ran.code, 0, "{ran:?}");
    assert_eq!(
        stranger.line(),
        "changed speed=4.0 arm.joints=['a', 'c']",
        "{}",
        component.log()
    );
    stranger.write("set_atomically\n");
    let mut lines = [stranger.line(), stranger.line()];
    lines.sort();
    assert_eq!(
        lines,
        ["changed speed=3.5 arm.joints=['x', 'y']", "set True"]
    );
    assert_eq!(stranger.end(), [""; 0]);
    assert!(!component.log().contains("WARN"), "{}", component.log());
}
