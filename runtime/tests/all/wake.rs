//! `wake spin`: a slot polls after a message, replies meanwhile, and sleeps when its time has
//! passed.

use rc_middleware::qos::Qos;
use rc_middleware::typed::{HandlerError, Operation, Request, TypedClient};
use rc_middleware::{
    Address, CallError, Endpoint, Environment, Reader, RunDirectory, Settings, TypeIdentity,
    WakeEvent,
};
use rc_runtime::{
    Component, Core, Description, Member, Ports, Role, Slot, StartError, Values, WorkerError, embed,
};
use rustix::time::{ClockId, clock_gettime};
use std::sync::Mutex;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(10);
/// The time for which the slot polls.
const SPIN: Duration = Duration::from_millis(10);

const DOUBLE: Operation = Operation {
    name: "double",
    id: 5,
    type_hash: 6,
    two_way: true,
    replies: &[],
};

static DESCRIPTION: Description = Description {
    name: "wake",
    model_hash: 1,
    middleware: "local",
    period: Duration::from_millis(5),
    parameters: None,
    folder: "/nowhere",
    slots: &[Slot {
        name: "Numbers",
        role: Role::Implements,
        interface: "Numbers",
        type_name: "Test::Numbers",
        type_hash: 7,
        backend: "local",
        qos: Qos {
            spin: SPIN,
            ..Qos::CALL
        },
        operations: &[DOUBLE],
        is_array: false,
        external_types: &[],
    }],
    backends: &[rc_local::LINKED],
    types: &[],
    simulates_time: false,
    managed: false,
    converter: None,
    note: b"",
};

/// The times of `compute()`, each with the processor time of its thread until then.
static TURNS: Mutex<Vec<(Instant, Duration)>> = Mutex::new(Vec::new());

struct Worker(Core);

impl Worker {
    #[expect(clippy::unnecessary_wraps, reason = "the runtime expects a `Result`")]
    fn start(core: Core, _: &Ports, _: &Values) -> Result<Self, StartError> {
        Ok(Self(core))
    }
}

impl Component for Worker {
    fn core(&mut self) -> &mut Core {
        &mut self.0
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        let used = clock_gettime(ClockId::ThreadCPUTime);
        let used = Duration::new(used.tv_sec as u64, used.tv_nsec as u32);
        TURNS
            .lock()
            .expect("the turns")
            .push((Instant::now(), used));
        Ok(())
    }

    fn serve(
        &mut self,
        _: usize,
        _: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        let number = request.arguments(&DOUBLE, Reader::get::<i32>)?;
        request.reply_with(0, |writer| writer.put(&(2 * number)))
    }
}

/// Waits until `compute()` has run `more` times. Returns the last entry.
fn turns(more: usize) -> (Instant, Duration) {
    let count = |wanted: usize| {
        let turns = TURNS.lock().expect("the turns");
        (turns.len() >= wanted).then(|| (turns.len(), turns[turns.len() - 1]))
    };
    let wanted = count(1).map_or(0, |(length, _)| length) + more;
    let end = Instant::now() + LIMIT;
    loop {
        if let Some((_, last)) = count(wanted) {
            return last;
        }
        assert!(Instant::now() < end, "compute() runs");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_polling_slot_replies_and_sleeps_afterwards() {
    let network = format!("wake_{}", std::process::id());
    let component = embed(&DESCRIPTION, Worker::start, &["--network", &network]);
    let component = component.expect("a component");
    let backend = rc_local::connect(&Environment {
        network: network.clone(),
        instance: "caller".to_owned(),
        directory: RunDirectory::of(&network),
        wake_event: WakeEvent::new().expect("a wake event"),
        settings: Settings::default(),
    });
    let backend = backend.expect("the network");
    let endpoint = Endpoint {
        address: Address::parse(&format!("{network}/Numbers")).expect("an address"),
        types: TypeIdentity {
            name: "Test::Numbers".to_owned(),
            hash: 7,
        },
        qos: Qos::CALL,
        external_types: Vec::new(),
    };
    let mut caller = TypedClient::new(backend.client(&endpoint).expect("a client"), LIMIT);
    for number in 0..100 {
        let doubled = caller.call_with(
            &DOUBLE,
            |writer| writer.put(&number),
            |case, reader| Ok::<_, CallError>((case, reader.get::<i32>()?)),
        );
        assert_eq!(doubled, Ok((0, 2 * number)));
    }
    // compute() keeps its period. No calls follow; the slot may still poll during the first turns.
    let (start, used) = turns(4);
    let (end, used_at_end) = turns(60);
    let (passed, used) = (end - start, used_at_end.saturating_sub(used));
    assert!(
        used < passed / 2,
        "{used:?} of {passed:?}, with nothing to do"
    );
    component.stop();
    component.join().expect("an orderly end");
}
