//! Forwarding of messages, over the fakes of tests.

use rc_forward::{Description, Forwarder};
use rc_host::{Operation, read, undecodable, write};
use rc_middleware::rpc::{self, Outcome, ReplyKind, RequestId};
use rc_middleware::typed::Request;
use rc_middleware::{Encoding, Header, Reader, Writer};
use rc_runtime::testing::{FakeServer, FakeSubscriber, Parts, TestBed};
use rc_runtime::{Body, Component, Sample};
use rc_values::Value;
use std::sync::Arc;

const DESCRIPTION: &str = r#"{
    "name": "rcforward", "model": "0000000000000001", "middleware": "local", "period_ns": 1000000000,
    "types": [{"module": "Demo", "types": [
        {"name": "Broken", "exception": [{"name": "why", "type": "string"}]}],
      "interfaces": [
        {"name": "Echo", "operations": [
            {"name": "twice", "id": 7, "hash": "0000000000000007", "pattern": "query",
             "inputs": [{"name": "number", "type": "float64"}], "result": "float64",
             "throws": [["Demo::Broken", 5]]}]},
        {"name": "Reports", "operations": [
            {"name": "report", "id": 9, "hash": "0000000000000009", "pattern": "publish",
             "inputs": [{"name": "number", "type": "int32"}]}]}]}],
    "slots": [
        {"name": "echo", "role": "implements", "interface": "Echo", "type_name": "Demo::Echo",
         "type_hash": "0000000000000002", "middleware": "local", "operations": [{"name": "twice"}]},
        {"name": "reports", "role": "publishes", "interface": "Reports",
         "type_name": "Demo::Reports", "type_hash": "0000000000000003", "middleware": "local",
         "operations": [{"name": "report"}]},
        {"name": "inside_echo", "role": "requires", "interface": "Echo", "type_name": "Demo::Echo",
         "type_hash": "0000000000000002", "middleware": "local", "operations": [{"name": "twice"}]},
        {"name": "inside_reports", "role": "subscribesTo", "interface": "Reports",
         "type_name": "Demo::Reports", "type_hash": "0000000000000003", "middleware": "local",
         "operations": [{"name": "report"}]}],
    "routes": [{"from": "echo", "to": "inside_echo"},
               {"from": "inside_reports", "to": "reports"}]
}"#;

/// The numbers of the slots.
const ECHO: usize = 0;
const REPORTS: usize = 1;
const INSIDE_ECHO: usize = 2;
const INSIDE_REPORTS: usize = 3;

const ID: RequestId = RequestId {
    writer: [3; 16],
    sequence: 4,
};

fn description() -> &'static Description {
    Box::leak(Box::new(
        Description::read(DESCRIPTION).expect("a description"),
    ))
}

fn operation(of: &'static Description, slot: usize) -> &'static Operation {
    of.program.operation(slot, 0).expect("an operation")
}

/// The server behind the forwarder, which reads the parameters.
fn server(bed: &TestBed, twice: &'static Operation) -> FakeServer<Value> {
    FakeServer::reading(bed, INSIDE_ECHO, None, move |request: &mut Request<'_>| {
        request.arguments(&twice.wire, |reader| {
            read(&twice.request, reader).map_err(undecodable)
        })
    })
}

/// Calls the forwarder, and gives its reply.
fn ask(forwarder: &mut Forwarder<'_>, number: f64) -> (Vec<u8>, ReplyKind) {
    let mut writer = Writer::default();
    rpc::begin_request(&mut writer, ID, 7);
    writer.put(&number);
    let body = writer.into_bytes();
    let header = Header {
        type_hash: 7,
        ..Header::default()
    };
    let mut reply = Vec::new();
    let mut request = Request::open(header, &body, &mut reply).expect("a request");
    // A refusal is an error for the log, and a reply.
    let _ = forwarder.serve(ECHO, None, &mut request);
    request.close();
    let (id, kind) = rpc::open_reply(&mut Reader::new(&reply), 7).expect("a reply");
    assert_eq!(id, ID);
    (reply, kind)
}

#[test]
fn calls_go_to_the_server_and_come_back_with_results_exceptions_and_refusals() {
    let of = description();
    let twice = operation(of, INSIDE_ECHO);
    let Parts { bed, core, ports } = TestBed::parts(of.program.description).expect("a component");
    let mut forwarder = Forwarder::open(of, core, &ports).expect("a forwarder");

    let server = server(&bed, twice);
    server.or_default(&twice.wire, move |request: &mut Request<'_>| {
        let number = request.arguments(&twice.wire, Reader::get::<f64>)?;
        if number < 0.0 {
            return request.reply_with(5, |writer| {
                let broken = Value::Struct(
                    Arc::clone(&twice.throws[0].ty),
                    vec![Value::Text("negative".to_owned())],
                );
                write(&broken, writer);
            });
        }
        if number > 100.0 {
            request.unavailable(&twice.wire, "resting");
            return Ok(());
        }
        if number > 10.0 {
            return request.fail(&"too much");
        }
        request.reply_with(0, |writer| writer.put(&(2.0 * number)))
    });
    let (reply, kind) = ask(&mut forwarder, 3.5);
    assert_eq!(kind, ReplyKind::Case(0));
    let mut reader = Reader::new(&reply);
    rpc::open_reply(&mut reader, 7).expect("a reply");
    assert_eq!(reader.get::<f64>(), Ok(7.0));
    let (reply, kind) = ask(&mut forwarder, -1.0);
    assert_eq!(kind, ReplyKind::Case(5));
    assert!(reply.windows(8).any(|part| part == b"negative"));
    assert_eq!(
        ask(&mut forwarder, 11.0).1,
        ReplyKind::Refused("too much".to_owned())
    );
    assert_eq!(
        ask(&mut forwarder, 101.0).1,
        ReplyKind::Unavailable("resting".to_owned())
    );
    let asked: Vec<Value> = server.calls();
    assert_eq!(asked.len(), 4);
}

#[test]
fn samples_keep_their_bytes() {
    let of = description();
    let report = operation(of, REPORTS);
    let Parts { bed, core, ports } = TestBed::parts(of.program.description).expect("a component");
    let mut forwarder = Forwarder::open(of, core, &ports).expect("a forwarder");
    let subscriber = FakeSubscriber::reading(&bed, REPORTS, None, move |_, reader: &mut _| {
        read(&report.request, reader).map_err(undecodable)
    });
    let sample = Sample {
        encoding: Encoding::Cdr,
        sent: 5,
        body: Body::Borrowed(&[42, 0, 0, 0]),
    };
    forwarder
        .receive(INSIDE_REPORTS, None, 0, sample)
        .expect("to be handed on");
    let expected = Value::Struct(Arc::clone(&report.request), vec![Value::Int(42)]);
    assert_eq!(subscriber.samples(), [expected]);
}

#[test]
fn routes_that_lead_nowhere_are_refused() {
    let with = |routes: &str| {
        let (head, _) = DESCRIPTION.split_once("\"routes\"").expect("routes");
        let read = Description::read(&format!("{head}\"routes\": [{routes}]}}"));
        read.err().expect("refused")
    };
    let echo = r#"{"from": "echo", "to": "inside_echo"}"#;
    assert!(
        with(echo).contains("`reports` has no route"),
        "{}",
        with(echo)
    );
    let missing = r#"{"from": "echo", "to": "other"}"#;
    assert!(with(missing).contains("`other`, which is not a slot"));
    let wrong = r#"{"from": "echo", "to": "reports"}"#;
    assert!(with(wrong).contains("do not fit"));
    assert!(with(&format!("{echo}, {echo}")).contains("two routes"));
}

/// The refusals of a server are those of a forwarder, too.
#[test]
fn an_unknown_operation_is_refused() {
    let of = description();
    let Parts { core, ports, .. } = TestBed::parts(of.program.description).expect("a component");
    let mut forwarder = Forwarder::open(of, core, &ports).expect("a forwarder");
    let mut writer = Writer::default();
    rpc::begin_request(&mut writer, ID, 8);
    let body = writer.into_bytes();
    let mut reply = Vec::new();
    let mut request = Request::open(Header::default(), &body, &mut reply).expect("a request");
    assert!(forwarder.serve(ECHO, None, &mut request).is_err());
    request.close();
    let outcome = i32::from_le_bytes(reply[24..28].try_into().expect("a code"));
    assert_eq!(outcome, Outcome::UnknownOperation as i32);
}

#[test]
fn a_probe_needs_no_description() {
    let mut probe = std::process::Command::new(env!("CARGO_BIN_EXE_rcforward"));
    let folder = std::env::temp_dir().join(format!("rcforward-{}", std::process::id()));
    probe.args(["--probe", "--network", "nobody", "--name", "arm"]);
    let output = probe
        .env("XDG_RUNTIME_DIR", folder)
        .output()
        .expect("to start it");
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(
        (output.status.code(), &*said),
        (Some(3), "arm: not there\n"),
        "{output:?}"
    );
}
