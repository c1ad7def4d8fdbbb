//! Slow handlers: while messages wait, `compute()` and everything else of a turn come in between.

use rc_middleware::qos::Qos;
use rc_middleware::typed::{HandlerError, Operation, Request, TypedClient};
use rc_middleware::{
    Address, Endpoint, Environment, Reader, RunDirectory, Settings, TypeIdentity, WakeEvent,
};
use rc_runtime::{
    Component, Core, Description, Member, Ports, Role, Slot, StartError, Values, WorkerError, embed,
};
use std::sync::Mutex;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(20);
/// The work of a handler: three of them are as long as a turn may last with messages alone.
const WORK: Duration = Duration::from_millis(40);
/// Fewer than handlers that run in a turn if each is short.
const COMMANDS: i32 = 16;

const WORK_ON: Operation = Operation {
    name: "workOn",
    id: 5,
    type_hash: 6,
    two_way: false,
    replies: &[],
};

static DESCRIPTION: Description = Description {
    name: "busy",
    model_hash: 1,
    middleware: "local",
    period: Duration::from_millis(5),
    parameters: None,
    folder: "/nowhere",
    slots: &[Slot {
        name: "Work",
        role: Role::Implements,
        interface: "Work",
        type_name: "Test::Work",
        type_hash: 7,
        backend: "local",
        qos: Qos::CALL,
        operations: &[WORK_ON],
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

/// What ran, in order: the number of a command, or `None` for `compute()`.
static RAN: Mutex<Vec<Option<i32>>> = Mutex::new(Vec::new());

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
        RAN.lock().expect("what ran").push(None);
        Ok(())
    }

    fn serve(
        &mut self,
        _: usize,
        _: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        let number = request.arguments(&WORK_ON, Reader::get::<i32>)?;
        RAN.lock().expect("what ran").push(Some(number));
        std::thread::sleep(WORK);
        Ok(())
    }
}

#[test]
fn slow_handlers_leave_turns_to_compute() {
    let network = format!("busy_{}", std::process::id());
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
        address: Address::parse(&format!("{network}/Work")).expect("an address"),
        types: TypeIdentity {
            name: "Test::Work".to_owned(),
            hash: 7,
        },
        qos: Qos::CALL,
        external_types: Vec::new(),
    };
    let mut caller = TypedClient::new(backend.client(&endpoint).expect("a client"), LIMIT);
    for number in 0..COMMANDS {
        let sent = caller.send_with(&WORK_ON, |writer| writer.put(&number));
        assert_eq!(sent, Ok(()));
    }
    let end = Instant::now() + LIMIT;
    let done = || RAN.lock().expect("what ran").contains(&Some(COMMANDS - 1));
    while !done() {
        assert!(Instant::now() < end, "the commands are done");
        std::thread::sleep(Duration::from_millis(1));
    }
    component.stop();
    component.join().expect("an orderly end");
    let ran = RAN.lock().expect("what ran");
    let commands: Vec<i32> = ran.iter().copied().flatten().collect();
    assert_eq!(commands, (0..COMMANDS).collect::<Vec<_>>(), "in order");
    let of = |number: i32| ran.iter().position(|one| *one == Some(number));
    let between = &ran[of(0).expect("the first")..of(COMMANDS - 1).expect("the last")];
    let computes = between.iter().filter(|one| one.is_none()).count();
    // A turn for every three commands, and some that a busy machine takes.
    assert!(computes >= 4, "{ran:?}");
}
