//! Calls through a real `rcforward`, whose callers and servers this test plays.

use rc_middleware::typed::{
    Call, CallId, DeferredRequest, HandlerError, Operation, ReplyVariant, Request, Throws,
    TypedClient,
};
use rc_middleware::{
    Address, Backend, CallError, DecodeError, Endpoint, Environment, Reader, RunDirectory, Server,
    Settings, TypeIdentity, WakeEvent, wait,
};
use rc_vocabulary::Value;
use std::collections::BTreeMap;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// No test waits longer for anything.
const LIMIT: Duration = Duration::from_mins(1);
/// The longest look at one end while another one may have news.
const LOOK: Duration = Duration::from_millis(5);

/// The domain of DDS, which no other test has.
const DOMAIN: i64 = 149;

/// Two interfaces through a proxy, of which one has little time.
const DESCRIPTION: &str = r#"{
    "name": "rcforward", "model": "0000000000000001", "middleware": "iceoryx2", "further_middlewares": ["dds"], "period_ns": 1000000000,
    "types": [{"module": "Demo", "types": [
            {"name": "Odd", "exception": [{"name": "number", "type": "int32"}]}],
        "interfaces": [{"name": "Half", "operations": [
            {"name": "half", "id": 7, "hash": "0000000000000007", "pattern": "query",
             "inputs": [{"name": "number", "type": "int32"}], "result": "int32", "throws": [["Demo::Odd", 13]]},
            {"name": "note", "id": 9, "hash": "0000000000000009", "pattern": "command",
             "inputs": [{"name": "number", "type": "int32"}]}]},
          {"name": "Told", "operations": [
            {"name": "tell", "id": 11, "hash": "0000000000000007", "pattern": "publish",
             "inputs": [{"name": "number", "type": "int32"}]}]}]}],
    "slots": [SLOTS],
    "routes": [{"from": "Half", "to": "inside_Half"}, {"from": "Hasty", "to": "inside_Hasty"},
               {"from": "inside_Told", "to": "Told"}]
}"#;

/// `int32 half(int32 number) throws Odd`
const HALF: Operation = Operation {
    name: "half",
    id: 7,
    type_hash: 7,
    two_way: true,
    replies: &[ReplyVariant::of::<i32>(ODD), ReplyVariant::of::<i32>(0)],
};
/// `void note(int32 number)`
const NOTE: Operation = Operation::one_way("note", 9, 9);
/// The number of the exception.
const ODD: i32 = 13;
/// The number that the server refuses because of its state.
const BUSY: i32 = -1;
/// The number whose half the server had before it was asked, and how long before.
const KNOWN: i32 = 90;
const AGE: Duration = Duration::from_mins(3);

#[derive(Clone, Debug, PartialEq)]
enum Failed {
    Odd(i32),
    Call(CallError),
}

impl From<CallError> for Failed {
    fn from(error: CallError) -> Self {
        Self::Call(error)
    }
}

impl Throws for Failed {
    fn read(case: i32, reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match case {
            ODD => Ok(Self::Odd(reader.get()?)),
            _ => Err(DecodeError::Unknown("exception in the reply")),
        }
    }

    fn refuse(self, request: &mut Request<'_>) -> Result<(), HandlerError> {
        request.fail(&format!("{self:?}"))
    }
}

fn description() -> String {
    let of = |name: &str, role: &str, interface: &str, qos: &str, operations: &str| {
        format!(
            r#"{{"name": "{name}", "role": "{role}", "interface": "{interface}", "type_name": "Demo::{interface}",
            "type_hash": "0000000000000002", "middleware": "iceoryx2", "qos": {{{qos}}},
            "operations": [{operations}]}}"#
        )
    };
    let both = r#"{"name": "half"}, {"name": "note"}"#;
    let slot = |name: &str, role: &str, qos: &str| of(name, role, "Half", qos, both);
    let told = |name: &str, role: &str| of(name, role, "Told", "", r#"{"name": "tell"}"#);
    let slots = [
        told("Told", "publishes"),
        told("inside_Told", "subscribesTo"),
        slot("Half", "implements", ""),
        slot("Hasty", "implements", ""),
        slot("inside_Half", "requires", r#""timeout_ns": 60000000000"#),
        slot("inside_Hasty", "requires", r#""timeout_ns": 300000000"#),
    ];
    DESCRIPTION.replace("SLOTS", &slots.join(","))
}

/// A running proxy.
struct Proxy {
    child: Child,
    network: String,
    directory: RunDirectory,
}

impl Proxy {
    fn start(name: &str) -> Self {
        Self::start_with(name, &[])
    }

    /// With further arguments.
    fn start_with(name: &str, more: &[&str]) -> Self {
        let network = format!("{name}-{}", std::process::id());
        let mut command = Command::new(env!("CARGO_BIN_EXE_rcforward"));
        command.arg(description());
        command.args(["--network", &network, "--name", "arm"]);
        for slot in ["Half", "Hasty", "Told"] {
            command.arg(format!("--bind={slot}={network}/arm/{slot}"));
            command.arg(format!("--bind=inside_{slot}={network}/motor/{slot}"));
        }
        command.args(more);
        let child = command.stdin(Stdio::null()).spawn().expect("rcforward");
        let directory = RunDirectory::open(&network).expect("a run directory");
        Self {
            child,
            network,
            directory,
        }
    }

    fn join(&self, instance: &str) -> Box<dyn Backend> {
        self.join_over("iceoryx2", instance)
    }

    fn join_over(&self, middleware: &str, instance: &str) -> Box<dyn Backend> {
        let mut settings = Settings::default();
        settings.set("dds", "domain", Value::Int(DOMAIN));
        settings.set("dds", "interfaces", Value::Texts(vec!["lo".to_owned()]));
        let environment = Environment {
            network: self.network.clone(),
            instance: instance.to_owned(),
            directory: self.directory.clone(),
            wake_event: WakeEvent::new().expect("an event"),
            settings,
        };
        let linked = rc_backends::find(middleware).expect("a middleware");
        (linked.connect)(&environment).expect("the network")
    }

    fn endpoint(&self, component: &str, slot: &str) -> Endpoint {
        let address = format!("{}/{component}/{slot}", self.network);
        Endpoint {
            address: Address::parse(&address).expect("an address"),
            types: TypeIdentity {
                name: "Demo::Half".to_owned(),
                hash: 2,
            },
            external_types: Vec::new(),
            qos: rc_middleware::Qos::CALL,
        }
    }

    /// The topic of a component on one side of the proxy.
    fn topic(&self, component: &str) -> Endpoint {
        let endpoint = self.endpoint(component, "Told/tell");
        Endpoint {
            types: TypeIdentity {
                name: "Demo::Told/tell".to_owned(),
                hash: 7,
            },
            ..endpoint
        }
    }

    /// A client of the proxy, once the proxy is there.
    fn caller(&self, backend: &dyn Backend, slot: &str) -> TypedClient {
        let port = backend.client(&self.endpoint("arm", slot));
        let caller = TypedClient::new(port.expect("a client"), LIMIT);
        until("the proxy is there", || caller.peers() == 1);
        caller
    }

    /// A server behind the proxy, once the proxy sees it.
    fn server(&self, backend: &dyn Backend, slot: &str) -> Box<dyn Server> {
        let server = backend.server(&self.endpoint("motor", slot));
        let server = server.expect("a server");
        until("the proxy calls it", || server.peers() == 1);
        server
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = self.directory.remove();
    }
}

fn until(what: &str, mut condition: impl FnMut() -> bool) {
    let end = Instant::now() + LIMIT;
    while !condition() {
        assert!(Instant::now() < end, "waited in vain until {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A message that a server behind the proxy got.
enum Got {
    Half(i32, DeferredRequest),
    Note(i32),
}

impl Got {
    fn number(&self) -> i32 {
        match self {
            Self::Half(number, _) | Self::Note(number) => *number,
        }
    }

    /// Replies as the interface says.
    fn reply(self) {
        let Self::Half(number, request) = self else {
            return;
        };
        let sent = request.reply(|request| match number {
            BUSY => drop(request.unavailable(&HALF, "driving")),
            odd if odd % 2 == 1 => {
                let sent = request.reply_with(ODD, |writer| writer.put(&odd));
                sent.expect("an exception");
            }
            even => {
                if even == KNOWN {
                    request.set_age(AGE);
                }
                let sent = request.reply_with(0, |writer| writer.put(&(even / 2)));
                sent.expect("a result");
            }
        });
        sent.expect("to reply");
    }
}

/// Takes what has come to a server.
fn take(server: &mut dyn Server, got: &mut Vec<Got>) {
    let woken = wait(&[server.descriptor()], LOOK) != 0;
    server.acknowledge(woken);
    let mut handler = |header, body: &[u8], reply: &mut dyn rc_middleware::Reply| {
        let mut request = Request::open(header, body, reply).expect("an envelope");
        let operation = if request.operation == HALF.id {
            HALF
        } else {
            NOTE
        };
        let number = request.arguments(&operation, Reader::get::<i32>);
        let number = number.expect("a number");
        got.push(match request.defer() {
            Some(later) => Got::Half(number, later),
            None => Got::Note(number),
        });
        request.close();
    };
    while server.serve(&mut handler).expect("requests") {}
}

fn take_until(server: &mut dyn Server, count: usize) -> Vec<Got> {
    let mut got = Vec::new();
    until("requests have come", || {
        take(server, &mut got);
        got.len() >= count
    });
    got
}

fn start(caller: &mut TypedClient, number: i32) -> Call<i32, Failed> {
    let call = caller.start::<i32, Failed>(&HALF, (&number,));
    call.expect("to be started")
}

/// The end of the next call.
fn next(caller: &mut TypedClient) -> Result<i32, Failed> {
    next_end(caller).1
}

fn next_end(caller: &mut TypedClient) -> (CallId, Result<i32, Failed>) {
    let mut ended = None;
    until("a call ends", || {
        ended = caller.poll_with(|ended| (ended.id, ended.result::<i32, Failed>()));
        ended.is_some()
    });
    ended.expect("an end")
}

/// The ends of these calls, in their order. They may come in another one.
fn ends(caller: &mut TypedClient, calls: &[Call<i32, Failed>]) -> Vec<Result<i32, Failed>> {
    let mut ended: BTreeMap<CallId, _> = calls.iter().map(|_| next_end(caller)).collect();
    let of = |call: &Call<i32, Failed>| ended.remove(&call.id()).expect("its end");
    calls.iter().map(of).collect()
}

#[test]
fn a_long_call_holds_nobody_up() {
    let proxy = Proxy::start("forward_long");
    let inside = proxy.join("motor");
    let mut slow = proxy.server(&*inside, "Half");
    let mut fast = proxy.server(&*inside, "Hasty");
    let [one, other] = ["one", "other"].map(|name| proxy.join(name));
    let mut long = proxy.caller(&*one, "Half");
    let mut short = proxy.caller(&*other, "Hasty");
    let call = start(&mut long, 8);
    let held = take_until(&mut *slow, 1);
    // The proxy has the call, and its next one of the same client, one of another one, and of another slot.
    let second = start(&mut long, 6);
    let mut of_other = proxy.caller(&*other, "Half");
    let third = start(&mut of_other, 4);
    let fourth = start(&mut short, 2);
    for got in take_until(&mut *fast, 1) {
        got.reply();
    }
    assert_eq!(next(&mut short), Ok(1));
    for got in take_until(&mut *slow, 2) {
        got.reply();
    }
    assert_eq!((next(&mut long), next(&mut of_other)), (Ok(3), Ok(2)));
    for got in held {
        got.reply();
    }
    assert_eq!(next(&mut long), Ok(4));
    drop((call, second, third, fourth));
}

#[test]
fn calls_and_commands_of_a_sender_keep_their_order_within_a_bound() {
    let proxy = Proxy::start("forward_order");
    let inside = proxy.join("motor");
    let mut server = proxy.server(&*inside, "Half");
    let backends = ["one", "other"].map(|name| proxy.join(name));
    let mut callers = backends
        .each_ref()
        .map(|backend| proxy.caller(&**backend, "Half"));
    let mut calls = [Vec::new(), Vec::new()];
    for number in 0..6 {
        for ((caller, base), calls) in callers.iter_mut().zip([0, 100]).zip(&mut calls) {
            calls.push(start(caller, base + 4 * number));
            let sent = caller.send(&NOTE, (&(base + 4 * number + 1),));
            sent.expect("to be sent");
        }
    }
    // Eight calls are under way; the others wait until one of these has ended.
    let mut got = take_until(&mut *server, 8);
    let end = Instant::now() + Duration::from_millis(100);
    while Instant::now() < end {
        take(&mut *server, &mut got);
    }
    let queries = got.iter().filter(|got| matches!(got, Got::Half(..)));
    assert_eq!(queries.count(), 8);
    let mut numbers = Vec::new();
    until("all have come", || {
        for got in got.drain(..) {
            numbers.push(got.number());
            got.reply();
        }
        take(&mut *server, &mut got);
        numbers.len() == 24
    });
    for ((caller, base), calls) in callers.iter_mut().zip([0, 100]).zip(&calls) {
        let own = |number: &&i32| (base..base + 100).contains(*number);
        let came: Vec<i32> = numbers.iter().filter(own).copied().collect();
        let sent = (0..6).flat_map(|number| [base + 4 * number, base + 4 * number + 1]);
        assert_eq!(came, sent.collect::<Vec<_>>());
        let results: Vec<_> = (0..6).map(|number| Ok(base / 2 + 2 * number)).collect();
        assert_eq!(ends(caller, calls), results);
    }
}

/// A proxy whose slots have peers over shared memory and over DDS.
fn of_two_middlewares(name: &str) -> Proxy {
    let domain = format!("dds.domain={DOMAIN}");
    let settings = ["--set-middleware", &domain, "--set-middleware"];
    let transports = [
        "dds.interfaces=lo",
        "--transport=Half=iceoryx2,dds",
        "--transport=Told=iceoryx2,dds",
    ];
    Proxy::start_with(name, &[&settings[..], &transports[..]].concat())
}

#[test]
fn callers_over_two_middlewares_share_the_bound() {
    let proxy = of_two_middlewares("forward_both");
    let inside = proxy.join("motor");
    let mut server = proxy.server(&*inside, "Half");
    let near = proxy.join("near");
    let far = proxy.join_over("dds", "far");
    let mut callers = [&near, &far].map(|backend| proxy.caller(&**backend, "Half"));
    let mut calls: Vec<_> = (0..8).map(|_| start(&mut callers[0], 2)).collect();
    let mut got = take_until(&mut *server, 8);
    // The ninth call comes over the other middleware. It waits for room.
    calls.push(start(&mut callers[1], 4));
    let end = Instant::now() + Duration::from_millis(100);
    while Instant::now() < end {
        take(&mut *server, &mut got);
    }
    assert_eq!(got.len(), 8);
    for got in got.drain(..) {
        got.reply();
    }
    for got in take_until(&mut *server, 1) {
        got.reply();
    }
    assert_eq!(next(&mut callers[1]), Ok(2));
    for _ in 0..8 {
        assert_eq!(next(&mut callers[0]), Ok(1));
    }
}

#[test]
fn exceptions_refusals_and_deadlines_come_back() {
    let proxy = Proxy::start("forward_ends");
    let inside = proxy.join("motor");
    let outside = proxy.join("one");
    let mut caller = proxy.caller(&*outside, "Half");
    let mut hasty = proxy.caller(&*outside, "Hasty");
    let refused = |result: Result<i32, Failed>| match result {
        Err(Failed::Call(CallError::Refused(reason))) => reason,
        other => panic!("{other:?}"),
    };
    let call = start(&mut caller, 2);
    let none = refused(next(&mut caller));
    let address = format!("`{}/motor/Half`", proxy.network);
    assert!(
        none.contains("no server at") && none.contains(&address),
        "{none}"
    );
    drop(call);
    let mut server = proxy.server(&*inside, "Half");
    let state = "driving".to_owned();
    let unavailable = Err(Failed::Call(CallError::Unavailable { state }));
    let cases = [(3, Err(Failed::Odd(3))), (BUSY, unavailable), (10, Ok(5))];
    let calls = cases
        .each_ref()
        .map(|(number, _)| start(&mut caller, *number));
    for got in take_until(&mut *server, 3) {
        got.reply();
    }
    let expected = cases.map(|(_, expected)| expected);
    assert_eq!(ends(&mut caller, &calls), expected);
    // The server of the other slot takes the request, and does not reply.
    let mut silent = proxy.server(&*inside, "Hasty");
    let late = start(&mut hasty, 2);
    let held = take_until(&mut *silent, 1);
    let reason = refused(next(&mut hasty));
    assert!(reason.contains("within 300ms"), "{reason}");
    drop((held, late, calls));
    // It leaves with a call.
    let lost = start(&mut caller, 2);
    drop(take_until(&mut *server, 1));
    drop(server);
    let reason = refused(next(&mut caller));
    assert!(reason.contains("died"), "{reason}");
    drop(lost);
}

/// The value of a reply that was there before the call, and a sample, are as old behind the proxy as
/// before it, over shared memory and over DDS.
#[test]
fn values_keep_their_ages() {
    let proxy = of_two_middlewares("forward_ages");
    let inside = proxy.join("motor");
    let mut server = proxy.server(&*inside, "Half");
    let topic = proxy.topic("motor");
    let mut publisher = inside.publisher(&topic).expect("a publisher");
    until("the proxy is subscribed", || publisher.peers() == 1);
    for (middleware, age) in [("iceoryx2", AGE), ("dds", 2 * AGE)] {
        let outside = proxy.join_over(middleware, middleware);
        let mut caller = proxy.caller(&*outside, "Half");
        let mut age_of = |number| {
            let call = start(&mut caller, number);
            take_until(&mut *server, 1).into_iter().for_each(Got::reply);
            let mut age = None;
            until("the call ends", || {
                age = caller.poll_with(|ended| ended.age);
                age.is_some()
            });
            drop(call);
            age.expect("an age")
        };
        let known = age_of(KNOWN);
        assert!(known >= AGE && known < AGE + LIMIT, "{known:?}");
        assert_eq!(age_of(KNOWN + 2), Duration::ZERO);

        let mut subscriber = outside
            .subscriber(&proxy.topic("arm"))
            .expect("a subscriber");
        until("the proxy publishes", || subscriber.peers() == 1);
        let sent = rc_middleware::now() - age.as_nanos() as u64;
        let header = rc_middleware::Header {
            type_hash: 7,
            sequence: 1 + u64::from(middleware == "dds"),
            sent,
            ..rc_middleware::Header::default()
        };
        publisher
            .publish(header, &[42, 0, 0, 0])
            .expect("to publish");
        let mut came = None;
        until("the sample comes", || {
            let woken = wait(&[subscriber.descriptor()], LOOK) != 0;
            subscriber.acknowledge(woken);
            let mut take = |header: rc_middleware::Header, _: &[u8]| came = Some(header.sent);
            while subscriber.receive(&mut take).expect("samples") {}
            came.is_some()
        });
        // DDS counts by the clock of the day, which may be set meanwhile.
        let shift = came.map(|came| came.abs_diff(sent));
        assert!(shift < Some(5_000_000), "{shift:?}");
    }
}
