//! Invalid samples and requests over ROS 2 are counted, logged at most once a second, and change
//! nothing.

use crate::network::bytes::{Target, Topic, change_nothing};
use crate::network::dds::{Domain, Over};

/// The body of a valid report.
fn report(number: i64) -> Vec<u8> {
    let mut writer = rc_middleware::Writer::default();
    writer.put(&number);
    writer.put(&"right".to_owned());
    writer.put(&vec![1_u8, 2, 3]);
    writer.put(&vec![0.5, 1.5]);
    writer.put(&7_i32);
    writer.put(&1.5_f32);
    writer.put(&2.5_f64);
    // A mark.
    writer.put(&1_u32);
    writer.put(&"mark".to_owned());
    writer.put(&0.5_f32);
    writer.put(&0.25_f64);
    // No scores.
    writer.put(&0_u32);
    writer.into_bytes()
}

/// The body of a request of `note` in the mapping of Cyclone DDS: client, number of the request,
/// text.
fn note(number: i64, text: &str) -> Vec<u8> {
    let mut writer = rc_middleware::Writer::default();
    writer.put(&7_u64);
    writer.put(&number);
    writer.put(&text.to_owned());
    writer.into_bytes()
}

#[test]
fn invalid_samples_change_nothing_in_ros() {
    let domain = Domain::over(Over::Ros2, "ros_bytes", 10);
    let network = &domain.site.network;
    let topic = |name: &str, kind: &str| -> Topic {
        let (prefix, name) = name.split_once(' ').expect("a prefix");
        let kind = format!("interop_msgs::{kind}_");
        (format!("{prefix}/{network}/{name}"), kind)
    };
    let target = Target {
        reports: topic("rt Reports/report", "msg::dds_::Report"),
        echoes: topic("rt Echoes/echo", "msg::dds_::Report"),
        slot: "Interop",
        requests: topic("rq Interop/noteRequest", "srv::dds_::InteropNote_Request"),
        replies: topic("rr Interop/noteReply", "srv::dds_::InteropNote_Response"),
        answers: topic("rr Oracle/askReply", "srv::dds_::OracleAsk_Response"),
        report: report(1),
        request: note(1, "nothing"),
        at_once: 100,
        warm_up: 2,
        // A leak of sixty bytes a sample would exceed it.
        flat: 8 << 20,
    };
    change_nothing(&domain, &[], &target);
}
