//! Known defects of libraries beside other nodes of ROS 2, each with a test that a component does
//! not have it. `ros_python.rs` tests lengths that are not multiples of four, the first call, and
//! peers that were killed. Nodes on several networks are not tested: the tests use the loopback
//! interface.

use crate::network::dds::{COMPONENT, Domain, Over, python};
use rc_test_site::site::Site;
use rustix::process::{Signal, kill_process};
use std::time::{Duration, Instant};

/// The endpoints of the component: names, types, and quality of service.
const ENDS: [&str; 29] = [
    "hears rq/NET/Camera/setCameraInfoRequest sensor_msgs::srv::dds_::SetCameraInfo_Request_ reliable",
    "hears rq/NET/Interop/addRequest example_interfaces::srv::dds_::AddTwoInts_Request_ reliable",
    "hears rq/NET/Interop/consultRequest interop_msgs::srv::dds_::InteropConsult_Request_ reliable",
    "hears rq/NET/Interop/noteRequest interop_msgs::srv::dds_::InteropNote_Request_ reliable",
    "hears rq/NET/Interop/notedRequest interop_msgs::srv::dds_::InteropNoted_Request_ reliable",
    "hears rq/NET/Interop/shiftRequest interop_msgs::srv::dds_::InteropShift_Request_ reliable",
    "hears rq/NET/Mirror/echoRequest interop_types_msgs::srv::dds_::MirrorEcho_Request_ reliable",
    "hears rq/NET/Mirror/failRequest interop_types_msgs::srv::dds_::MirrorFail_Request_ reliable",
    "hears rr/NET/CameraDriver/setCameraInfoReply sensor_msgs::srv::dds_::SetCameraInfo_Response_ reliable",
    "hears rr/NET/Oracle/askReply interop_msgs::srv::dds_::OracleAsk_Response_ reliable",
    "hears rr/NET/Oracle/tellReply interop_msgs::srv::dds_::OracleTell_Response_ reliable",
    "hears rt/NET/Orders/order interop_msgs::msg::dds_::OrdersOrder_ reliable kept",
    "hears rt/NET/Reports/report interop_msgs::msg::dds_::Report_ reliable",
    "hears rt/NET/Talk/chatter std_msgs::msg::dds_::String_ reliable",
    "sends rq/NET/CameraDriver/setCameraInfoRequest sensor_msgs::srv::dds_::SetCameraInfo_Request_ reliable",
    "sends rq/NET/Oracle/askRequest interop_msgs::srv::dds_::OracleAsk_Request_ reliable",
    "sends rq/NET/Oracle/tellRequest interop_msgs::srv::dds_::OracleTell_Request_ reliable",
    "sends rr/NET/Camera/setCameraInfoReply sensor_msgs::srv::dds_::SetCameraInfo_Response_ reliable",
    "sends rr/NET/Interop/addReply example_interfaces::srv::dds_::AddTwoInts_Response_ reliable",
    "sends rr/NET/Interop/consultReply interop_msgs::srv::dds_::InteropConsult_Response_ reliable",
    "sends rr/NET/Interop/noteReply interop_msgs::srv::dds_::InteropNote_Response_ reliable",
    "sends rr/NET/Interop/notedReply interop_msgs::srv::dds_::InteropNoted_Response_ reliable",
    "sends rr/NET/Interop/shiftReply interop_msgs::srv::dds_::InteropShift_Response_ reliable",
    "sends rr/NET/Mirror/echoReply interop_types_msgs::srv::dds_::MirrorEcho_Response_ reliable",
    "sends rr/NET/Mirror/failReply interop_types_msgs::srv::dds_::MirrorFail_Response_ reliable",
    "sends rt/NET/Archive/keep interop_msgs::msg::dds_::ArchiveKeep_ reliable kept",
    "sends rt/NET/Echoes/echo interop_msgs::msg::dds_::Report_ reliable",
    "sends rt/NET/Gossip/chatter std_msgs::msg::dds_::String_ reliable",
    "sends rt/NET/Images/image sensor_msgs::msg::dds_::Image_ reliable",
];

/// Names are absolute, also of a node in the namespace `/`, where ros2-client would make
/// `rt//name`. Every policy is set. A component that stops removes its endpoints at once, without
/// its lease.
#[test]
fn endpoints_have_names_and_policies_and_leave_at_once() {
    let Some(python) = python("endpoints_have_names_and_policies_and_leave_at_once") else {
        return;
    };
    let domain = Domain::over(Over::Ros2, "ros_ends", 11);
    let component = domain.start(&["ros2.namespace=/"]);
    let ends = domain.external(python, "ends.py", &[&ENDS.len().to_string()]);
    for end in ENDS {
        let end = end.replace("/NET/", &format!("/{}/", domain.site.network));
        assert_eq!(ends.line(), end);
    }
    assert_eq!(ends.line(), "all");
    let stopped = Instant::now();
    kill_process(component.pid(), Signal::TERM).expect("it is ours");
    assert_eq!(ends.line(), "gone");
    assert!(stopped.elapsed() < Duration::from_secs(10));
    assert_eq!(component.end(), Some(0));
    ends.end();
}

/// Endpoints announce the quality of service that a setting chooses.
#[test]
fn endpoints_announce_the_policies_of_settings() {
    let Some(python) = python("endpoints_announce_the_policies_of_settings") else {
        return;
    };
    let domain = Domain::over(Over::Ros2, "ros_set", 19);
    let rules = "ros2.qos=Reports/report.reliability:=best_effort,Orders.durability:=volatile,Echoes.durability:=transient_local";
    let _component = domain.start(&[rules]);
    let ends = domain.external(python, "ends.py", &[&ENDS.len().to_string()]);
    let others = [
        ("Reports/report", "reliable", ""),
        ("Orders/order", "reliable kept", "reliable"),
        ("Echoes/echo", "reliable", "reliable kept"),
    ];
    for end in ENDS {
        let mut end = end.replace("/NET/", &format!("/{}/", domain.site.network));
        for (topic, usual, set) in others {
            if end.contains(topic) {
                end = end.replace(usual, set).trim_end().to_owned();
            }
        }
        assert_eq!(ends.line(), end);
    }
    assert_eq!(ends.line(), "all");
}

/// Incompatible quality of service is reported with both values.
#[test]
fn incompatible_policies_in_ros_are_reported() {
    let Some(python) = python("incompatible_policies_in_ros_are_reported") else {
        return;
    };
    let domain = Domain::over(Over::Ros2, "ros_misfit", 12);
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
    Site::until("the order came", || {
        domain.slot("Orders")["handlers"]["count"] == 1
    });
    assert_eq!(domain.slot("Reports")["handlers"]["count"], 0);
    misfit.end();
}

/// An endpoint with another type at the same topic is reported once, with both types. Others still
/// exchange samples.
#[test]
fn other_types_at_a_topic_of_ros_are_reported() {
    let Some(python) = python("other_types_at_a_topic_of_ros_are_reported") else {
        return;
    };
    let domain = Domain::over(Over::Ros2, "ros_types", 20);
    let component = domain.start(&[]);
    let other = domain.external(python, "other_type.py", &[]);
    // Cyclone DDS compares types itself.
    assert_eq!(other.line(), "matched 0 0");
    let told = |topic: &str| {
        let log = component.log();
        let both = [
            "interop_msgs::msg::dds_::Report_",
            "std_msgs::msg::dds_::String_",
        ];
        let about = |line: &&str| line.contains(topic) && both.iter().all(|ty| line.contains(ty));
        log.lines().filter(about).count()
    };
    Site::until("both ends are reported", || {
        told("Reports/report") > 0 && told("Echoes/echo") > 0
    });
    Site::until("the order came", || {
        domain.slot("Orders")["handlers"]["count"] == 1
    });
    for slot in ["Reports", "Echoes"] {
        assert_eq!(domain.slot(slot)["peers"], 0, "{slot}");
    }
    let reports = domain.slot("Reports");
    assert_eq!(reports["handlers"]["count"], 0, "{reports}");
    // A publisher of the right type is received.
    let mut peer = domain.external(python, "repeat.py", &["3"]);
    peer.says("met");
    Site::until("the component finds the program", || {
        domain.slot("Reports")["peers"] == 1 && domain.slot("Echoes")["peers"] == 1
    });
    peer.write("\n");
    assert_eq!(peer.end(), ["told 3 heard 3"]);
    let log = component.log();
    assert_eq!(
        (told("Reports/report"), told("Echoes/echo")),
        (1, 1),
        "{log}"
    );
    assert_eq!(domain.slot("Reports")["handlers"]["errors"], 0, "{log}");
    other.end();
}

/// `ROS_DOMAIN_ID` and the variables of discovery apply.
#[test]
fn the_variables_of_ros_are_respected() {
    let Some(python) = python("the_variables_of_ros_are_respected") else {
        return;
    };
    let domain = Domain::over(Over::Ros2, "ros_variables", 13);
    let id = domain.id.to_string();
    let variables = [
        ("ROS_DOMAIN_ID", id.as_str()),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
    ];
    let _component = domain
        .site
        .start_program(Over::Ros2.program(), COMPONENT, &[], &variables);
    let mut peer = domain.external(python, "repeat.py", &["3"]);
    peer.says("met");
    Site::until("the component finds the program", || {
        domain.slot("Reports")["peers"] == 1 && domain.slot("Echoes")["peers"] == 1
    });
    peer.write("\n");
    assert_eq!(peer.end(), ["told 3 heard 3"]);
}

#[test]
fn an_invalid_variable_of_ros_is_reported() {
    let domain = Domain::over(Over::Ros2, "ros_wrong", 14);
    for (name, value, said) in [
        (
            "ROS_DOMAIN_ID",
            "233",
            "ROS_DOMAIN_ID is a number from 0 to 232",
        ),
        (
            "ROS_AUTOMATIC_DISCOVERY_RANGE",
            "NEAR",
            "it is SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT",
        ),
    ] {
        let mut command = domain.site.command(&Site::executable(Over::Ros2.program()));
        command
            .args(["--network", &domain.site.network])
            .env(name, value);
        let ran = domain.site.run(command);
        assert_ne!(ran.code, 0, "{ran:?}");
        assert!(ran.stderr.contains(said), "{ran:?}");
    }
}
