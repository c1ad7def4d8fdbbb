//! A guest without a language: its context calls and publishes with values, over the fakes of tests.

use rc_host::link::{self, Answer, Reading};
use rc_host::{HostError, Operation, Program, Session, read, session, undecodable, write};
use rc_middleware::typed::Request;
use rc_runtime::testing::{self, FakeServer, FakeSubscriber, Parts, TestBed};
use rc_values::Value;
use std::sync::Arc;

const DESCRIPTION: &str = r#"{
    "name": "guest", "model": "0000000000000001", "middleware": "local", "period_ns": 1000000,
    "types": [{"module": "Demo", "types": [], "interfaces": [
        {"name": "Echo", "operations": [
            {"name": "twice", "id": 7, "hash": "0000000000000007", "pattern": "query",
             "inputs": [{"name": "number", "type": "int32"}],
             "outputs": [{"name": "text", "type": "string"}], "result": "int32"}]},
        {"name": "Reports", "operations": [
            {"name": "report", "id": 9, "hash": "0000000000000009", "pattern": "publish",
             "inputs": [{"name": "number", "type": "int32"}]}]}]}],
    "slots": [
        {"name": "Echo", "role": "requires", "interface": "Echo", "type_name": "Demo::Echo",
         "type_hash": "0000000000000002", "middleware": "local", "operations": [{"name": "twice"}]},
        {"name": "Reports", "role": "publishes", "interface": "Reports",
         "type_name": "Demo::Reports", "type_hash": "0000000000000003", "middleware": "local",
         "operations": [{"name": "report"}]}]
}"#;

fn number(operation: &Operation, number: i64) -> Value {
    Value::Struct(Arc::clone(&operation.request), vec![Value::Int(number)])
}

#[test]
fn a_guest_calls_and_publishes_on_the_thread_of_its_session() {
    let program = Arc::new(Program::read(DESCRIPTION).expect("a program"));
    let Parts { bed, core, ports } = TestBed::parts(program.description).expect("a component");
    let mut opened = Session::open(&program, &ports).expect("a session");
    opened.core = Some(core);
    let twice = link::operation(&program, 0, 0).expect("an operation");
    let report = link::operation(&program, 1, 0).expect("an operation");
    assert!(twice.has_result && !report.has_result);

    let of = Arc::clone(&program);
    let server = FakeServer::reading(&bed, 0, None, move |request: &mut Request<'_>| {
        let operation = &of.slots[0].operations[0];
        if request.operation != operation.wire.id {
            return Err(testing::unknown(request));
        }
        request.arguments(&operation.wire, |reader| {
            read(&operation.request, reader).map_err(undecodable)
        })
    });
    let of = Arc::clone(&program);
    server.or_default(&twice.wire, move |request: &mut Request<'_>| {
        let operation = &of.slots[0].operations[0];
        request.arguments(&operation.wire, |_| Ok(()))?;
        let parts = vec![Value::Text("forty-two".to_owned()), Value::Int(42)];
        let reply = Value::Struct(Arc::clone(&operation.reply), parts);
        request.reply_with(0, |writer| write(&reply, writer))
    });
    let of = Arc::clone(&program);
    let subscriber = FakeSubscriber::reading(&bed, 1, None, move |at, reader: &mut _| {
        read(&of.slots[1].operations[at].request, reader).map_err(undecodable)
    });

    let ask = || link::query(0, twice, &number(twice, 21), Reading::Value);
    assert!(matches!(ask(), Err(HostError::WrongThread)));
    opened.begin();
    let Ok(Ok(Answer::Result(Value::Struct(_, parts)))) = ask() else {
        panic!("a reply");
    };
    assert_eq!(parts, [Value::Text("forty-two".to_owned()), Value::Int(42)]);
    assert_eq!(server.calls(), [number(twice, 21)]);
    let sent = link::publish(1, 0, &number(report, 3)).expect("a publisher");
    assert_eq!(sent, Ok(()));
    assert_eq!(subscriber.samples(), [number(report, 3)]);
    let name = session::with_core(|core| core.name().to_owned());
    assert_eq!(name.expect("a core"), "guest");

    // The context is that of its thread, and ends with the session.
    let elsewhere = std::thread::scope(|scope| scope.spawn(|| ask().is_err()).join());
    assert!(elsewhere.expect("a thread"));
    Session::end();
    assert!(matches!(ask(), Err(HostError::WrongThread)));
}
