use super::*;
use crate::clock::{SimulatedClock, Time};
use rc_middleware::Writer;
use rc_middleware::freshness::Made;
use rc_middleware::typed::{ReplyVariant, TypedClient};
use std::cell::Cell;
use std::rc::Rc;

const DOUBLE: Operation = Operation::query("double", 5, 9, &[]);
const RESET: Operation = Operation::one_way("reset", 6, 10);
/// A query without results.
const MOVE: Operation = Operation::query("move", 7, 11, &[ReplyVariant::of::<i32>(FAULT)]);
const FAULT: i32 = 77;
const OPERATIONS: &[Operation] = &[DOUBLE, RESET, MOVE];

/// State of a server that a test reads and sets.
#[derive(Default)]
struct Server {
    calls: Cell<u64>,
    number: Cell<u128>,
    takes: Cell<u64>,
    refuses: Cell<bool>,
    throws: Cell<bool>,
    fails: Cell<bool>,
    /// How old its values are, in milliseconds.
    age: Cell<u64>,
    /// Whether it does not say so.
    is_silent: Cell<bool>,
}

/// A port whose server doubles a number and adds the number of calls, in some time.
struct Port(Rc<Server>, Arc<SimulatedClock>);

impl Client for Port {
    fn guid(&self) -> [u8; 16] {
        [7; 16]
    }

    fn send(&mut self, _: Header, _: &dyn RequestBody) -> Result<(), CallError> {
        Ok(())
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        _: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let server = &self.0;
        if server.fails.get() {
            return Err(CallError::NoServer("home/Double".to_owned()));
        }
        server.calls.set(server.calls.get() + 1);
        let passed = Duration::from_millis(server.takes.get());
        self.1.set(self.1.now() + passed);
        let bytes = buffer(request).expect("a request");
        let id = rpc::request_id(&bytes).expect("an envelope");
        let mut reader = rc_middleware::Reader::new(&bytes);
        rpc::open_request(&mut reader).expect("an envelope");
        let mut writer = Writer::default();
        if server.refuses.get() {
            rpc::refuse(&mut writer, id, rpc::Outcome::OutOfResources, "no");
        } else {
            let (operation, _) = rpc::request_values(&bytes, Profile::Rpc).expect("an envelope");
            let is_thrown = server.throws.get();
            let case = if is_thrown { FAULT } else { 0 };
            rpc::begin_reply(&mut writer, id, operation, case);
            let number: i32 = reader.get().expect("a number");
            if is_thrown || operation == DOUBLE.id {
                writer.put(&(2 * number + 100 * server.calls.get() as i32));
            }
        }
        let age = Duration::from_millis(server.age.get());
        let sent = if server.is_silent.get() {
            0
        } else {
            header.sent - nanoseconds(age)
        };
        take(Header { sent, ..header }, &writer.into_bytes());
        Ok(())
    }

    fn replies_have_ages(&self) -> bool {
        true
    }

    fn start(&mut self, _: Header, _: &dyn RequestBody, _: Duration) -> Result<(), CallError> {
        Ok(())
    }

    fn poll(
        &mut self,
        _: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        None
    }

    fn forget(&mut self, _: u64) {}

    fn peers(&self) -> usize {
        1
    }

    fn server(&self) -> u128 {
        self.0.number.get()
    }
}

struct Bench {
    client: TypedClient,
    server: Rc<Server>,
    clock: Arc<SimulatedClock>,
    counts: FreshCounts,
}

impl Bench {
    fn new(cache: u64, fresh: u64, stale: Stale) -> Self {
        let (server, clock) = (Rc::<Server>::default(), Arc::<SimulatedClock>::default());
        clock.set(Time::from_nanos(1_000_000_000));
        server.number.set(1);
        let counts = FreshCounts::new(None);
        let simulated: Arc<dyn Clock> = Arc::clone(&clock) as Arc<dyn Clock>;
        let time = |ms: u64| (ms > 0).then(|| Duration::from_millis(ms));
        let port = CachingClient {
            port: Box::new(Port(Rc::clone(&server), Arc::clone(&clock))),
            operations: OPERATIONS,
            cache: 1_000_000 * cache,
            fresh: time(fresh),
            stale,
            simulated: Some(simulated),
            kept: VecDeque::new(),
            bytes: 0,
            server: 0,
            looked: 0,
            last: None,
            counts: counts.clone(),
        };
        Self {
            client: TypedClient::new(Box::new(port), Duration::from_secs(1)),
            server,
            clock,
            counts,
        }
    }

    fn call(&mut self, number: i32) -> Result<i32, CallError> {
        self.client.call(&DOUBLE, (&number,))
    }

    fn pass(&self, milliseconds: u64) {
        self.clock
            .set(self.clock.now() + Duration::from_millis(milliseconds));
    }

    /// Origin of the last reply, and its age in milliseconds.
    fn last(&self) -> Option<(Made, u128, bool)> {
        let last = self.client.freshness()?;
        Some((last.made, last.age.as_millis(), last.is_fresh))
    }
}

#[test]
fn a_reply_answers_the_same_query_while_it_is_young() {
    let mut bench = Bench::new(50, 0, Stale::Inform);
    assert_eq!(bench.last(), None);
    assert_eq!(bench.call(1), Ok(102));
    assert_eq!(bench.last(), Some((Made::Computed, 0, true)));
    bench.pass(50);
    assert_eq!(bench.call(1), Ok(102));
    assert_eq!(bench.last(), Some((Made::Cached, 50, true)));
    // Other arguments are another query.
    assert_eq!(bench.call(2), Ok(204));
    bench.pass(1);
    assert_eq!(bench.call(1), Ok(302));
    assert_eq!(bench.call(2), Ok(204));
    let status = bench.counts.status(bench.clock.now().as_nanos());
    assert_eq!((status.uses, status.cached), (5, 2));
}

#[test]
fn replies_are_forgotten_with_their_server_and_after_commands() {
    let mut bench = Bench::new(50, 0, Stale::Inform);
    assert_eq!(bench.call(1), Ok(102));
    bench.client.send(&RESET, ()).expect("a command");
    assert_eq!(bench.call(1), Ok(202));
    // Another server; the middleware is asked once in a millisecond.
    bench.server.number.set(2);
    let begun = rc_middleware::now();
    while rc_middleware::now() < begun + LOOK {}
    assert_eq!(bench.call(1), Ok(302));
    bench.server.fails.set(true);
    assert_eq!(bench.call(1), Ok(302));
    assert!(matches!(bench.call(2), Err(CallError::NoServer(_))));
    assert!(matches!(bench.call(1), Err(CallError::NoServer(_))));
}

#[test]
fn a_query_without_results_is_always_sent_and_changes_its_server() {
    let mut bench = Bench::new(50, 30, Stale::Last);
    let go = |bench: &mut Bench| {
        let went: Result<(), CallError> = bench.client.call(&MOVE, (&7,));
        went.expect("an end");
        bench.server.calls.get()
    };
    assert_eq!((go(&mut bench), go(&mut bench)), (1, 2));
    assert_eq!(bench.last(), None);
    assert_eq!(bench.call(1), Ok(302));
    // A slow one has no age.
    bench.server.takes.set(31);
    assert_eq!(go(&mut bench), 4);
    bench.server.takes.set(0);
    assert_eq!(bench.call(1), Ok(502));
}

#[test]
fn a_reply_of_ros_without_members_has_no_values() {
    let bare = |body: &[u8]| {
        let id = rpc::RequestId {
            writer: [7; 16],
            sequence: 1,
        };
        let mut request = Writer::default();
        rpc::begin_request(&mut request, id, RESET.id);
        rpc::begin_body(&mut request, Profile::Bare);
        let mut reply = Writer::default();
        rpc::begin_reply(&mut reply, id, RESET.id, 0);
        rpc::begin_body(&mut reply, Profile::Bare);
        let reply = [&reply.into_bytes()[..], body].concat();
        let header = Header::default();
        let request = request.into_bytes();
        Content::of(
            OPERATIONS,
            Profile::Bare,
            &request,
            (header, &Message::Bytes(&reply)),
        )
    };
    assert!(bare(&[]) == Content::Nothing && bare(&[0]) == Content::Nothing);
    assert!(bare(&[1]) == Content::Values && bare(&[0, 0]) == Content::Values);
}

#[test]
fn a_late_exception_or_refusal_is_handed_over() {
    for stale in [Stale::Refuse, Stale::Last] {
        let mut bench = Bench::new(0, 30, stale);
        assert_eq!(bench.call(1), Ok(102), "{stale}");
        bench.server.takes.set(31);
        bench.server.refuses.set(true);
        let refused = Err(CallError::Refused("no".to_owned()));
        assert_eq!(bench.call(1), refused, "{stale}");
        bench.server.refuses.set(false);
        bench.server.throws.set(true);
        let thrown = bench.call(1);
        let is_told = !matches!(thrown, Ok(_) | Err(CallError::Stale { .. }));
        assert!(is_told, "{stale}: {thrown:?}");
    }
}

#[test]
fn a_clock_that_is_set_back_leaves_no_reply_of_the_future() {
    let mut bench = Bench::new(50, 0, Stale::Inform);
    assert_eq!(bench.call(1), Ok(102));
    bench.clock.set(Time::from_nanos(5));
    assert_eq!(bench.call(1), Ok(202));
    assert_eq!(bench.call(1), Ok(202));
}

#[test]
fn a_refusal_is_not_kept() {
    let mut bench = Bench::new(50, 0, Stale::Inform);
    bench.server.refuses.set(true);
    assert_eq!(bench.call(1), Err(CallError::Refused("no".to_owned())));
    bench.server.refuses.set(false);
    assert_eq!(bench.call(1), Ok(202));
}

#[test]
fn kept_replies_are_bounded() {
    let mut bench = Bench::new(50, 0, Stale::Inform);
    for number in 0..=MOST_REPLIES as i32 {
        bench.call(number).expect("a reply");
    }
    let before = bench.server.calls.get();
    bench.call(1).expect("a kept reply");
    assert_eq!(bench.server.calls.get(), before);
    bench.call(0).expect("a new reply");
    assert_eq!(bench.server.calls.get(), before + 1);
}

#[test]
fn a_slow_reply_is_told_refused_or_replaced_by_the_last_one() {
    for (stale, expected) in [
        (Stale::Inform, Ok(202)),
        (
            Stale::Refuse,
            Err(CallError::Stale {
                age: Duration::from_millis(31),
            }),
        ),
        (Stale::Last, Ok(102)),
    ] {
        let mut bench = Bench::new(0, 30, stale);
        assert_eq!(bench.call(1), Ok(102), "{stale}");
        bench.server.takes.set(31);
        assert_eq!(bench.call(1), expected, "{stale}");
        let last = match stale {
            Stale::Inform => (Made::Computed, 31, false),
            // That of the last reply that was used.
            Stale::Refuse => (Made::Computed, 0, true),
            Stale::Last => (Made::Cached, 31, false),
        };
        assert_eq!(bench.last(), Some(last), "{stale}");
        bench.server.takes.set(30);
        assert_eq!(bench.call(1), Ok(302), "{stale}");
    }
    // Nothing was fresh yet.
    let mut bench = Bench::new(0, 30, Stale::Last);
    bench.server.takes.set(31);
    assert_eq!(bench.call(1), Ok(102));
}

#[test]
fn what_counts_as_fresh_bounds_what_is_kept_for_those_who_refuse() {
    let mut bench = Bench::new(50, 30, Stale::Refuse);
    assert_eq!(bench.call(1), Ok(102));
    bench.pass(30);
    assert_eq!(bench.call(1), Ok(102));
    bench.pass(1);
    assert_eq!(bench.call(1), Ok(202));
}

#[test]
fn a_value_that_was_there_before_its_call_is_older() {
    let mut bench = Bench::new(50, 80, Stale::Refuse);
    bench.server.age.set(40);
    assert_eq!(bench.call(1), Ok(102));
    assert_eq!(bench.last(), Some((Made::Computed, 40, true)));
    bench.pass(20);
    assert_eq!(bench.call(1), Ok(102));
    assert_eq!(bench.last(), Some((Made::Cached, 60, true)));
    // The kept one is too old, and that of the server is older.
    bench.pass(25);
    bench.server.age.set(90);
    let age = Duration::from_millis(90);
    assert_eq!(bench.call(1), Err(CallError::Stale { age }));
}

#[test]
fn a_reply_that_says_nothing_is_as_old_as_its_call() {
    let mut bench = Bench::new(0, 80, Stale::Refuse);
    bench.server.is_silent.set(true);
    assert_eq!(bench.call(1), Ok(102));
    assert_eq!(bench.last(), Some((Made::Computed, 0, true)));
}
