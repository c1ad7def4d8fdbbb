//! Invalid samples and requests over DDS are counted, logged at most once a second, and change
//! nothing.

use crate::network::bytes::{Target, Topic, change_nothing};
use crate::network::dds::Domain;

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

/// The body of a request of `note`.
fn note(number: u32, text: &str) -> Vec<u8> {
    let mut writer = rc_middleware::Writer::default();
    let id = rc_middleware::rpc::RequestId {
        writer: [7; 16],
        sequence: number.into(),
    };
    rc_middleware::rpc::begin_request(&mut writer, id, -900_475_222);
    writer.put(&text.to_owned());
    writer.into_bytes()
}

#[test]
fn invalid_samples_change_nothing() {
    let domain = Domain::new("dds_bytes", 224);
    let network = &domain.site.network;
    let topic = |name: &str, kind: &str| -> Topic {
        (format!("{network}/{name}"), format!("RcInterop::{kind}"))
    };
    let target = Target {
        reports: topic("Reports/report", "Reports_report"),
        echoes: topic("Echoes/echo", "Echoes_echo"),
        slot: "Interop",
        requests: topic("Interop_Request", "Interop_Request"),
        replies: topic("Interop_Reply", "Interop_Reply"),
        answers: topic("Oracle_Reply", "Oracle_Reply"),
        report: report(1),
        request: note(1, "never"),
        at_once: 200,
        warm_up: 1,
        flat: 2 << 20,
    };
    change_nothing(&domain, &[], &target);
}
