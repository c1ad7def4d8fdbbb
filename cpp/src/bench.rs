//! The bench of a test in C++: a component with fake peers and virtual time, those of
//! `rc_runtime::testing`. A thread has one at a time; its session is that of the thread while no function
//! of the worker runs, so a test calls handlers of the worker itself.

use crate::call::{Call, Function, Guest};
use crate::component::{self, Component};
use crate::context;
use crate::parameters;
use crate::status::{Answer, INTERNAL};
use rc_configuration::Parameters;
use rc_host::{Operation, Program, Session, bodies, read, session, undecodable, write};
use rc_middleware::typed::Request;
use rc_middleware::{Reader, Writer};
use rc_runtime::adapter::{self, Joined as _};
use rc_runtime::lifecycle::Transition;
use rc_runtime::testing::{self, FakeServer, FakeSubscriber, Fault, Parts, TestBed};
use rc_runtime::{ComponentState, Ports, Time};
use rc_values::{Value, ValueError, default, encode_body};
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// Actions of a test with its bench, `enum rc_test_what` of `abi.h`. A fake peer is named by its slot and
/// the name of a member.
#[derive(Clone, Copy)]
pub(crate) enum Act {
    /// Ends the worker and the bench.
    Close,
    /// Runs the worker for this many nanoseconds.
    Run,
    /// Takes a transition of the life cycle. The answer is the state afterwards.
    Transition,
    EndCalls,
    Advance,
    SetTime,
    SetState,
    /// Lists the members of a slot array: the name of the array and those of the members, in lines.
    ListMembers,
    /// Opens a fake server.
    Server,
    /// Lets the program answer this operation of a fake server.
    Answer,
    /// Takes the calls of a fake server: numbers of operations, and bodies.
    Calls,
    /// Lets the calls of a fake server fail by this fault, `enum rc_test_fault`; the next one only, if 16 is
    /// added to it.
    Fail,
    /// Ends the faults of a fake server or subscriber.
    Recover,
    /// Opens a fake subscriber.
    Subscriber,
    /// Takes the samples of a fake subscriber, as calls.
    Samples,
    /// Lets publishing fail.
    FailPublishing,
    /// Sets the number of subscribers.
    Subscribers,
    /// Answers the queries of a fake server that have no answer yet with default values.
    AnswerDefaults,
    /// Takes the changes of parameters that the worker has requested: paths, and values in TOML.
    Parameters,
}

impl Act {
    pub(crate) const ALL: [Self; 19] = [
        Self::Close,
        Self::Run,
        Self::Transition,
        Self::EndCalls,
        Self::Advance,
        Self::SetTime,
        Self::SetState,
        Self::ListMembers,
        Self::Server,
        Self::Answer,
        Self::Calls,
        Self::Fail,
        Self::Recover,
        Self::Subscriber,
        Self::Samples,
        Self::FailPublishing,
        Self::Subscribers,
        Self::AnswerDefaults,
        Self::Parameters,
    ];
}

/// `enum rc_test_fault`.
const FAULTS: [Fault; 4] = [
    Fault::NoServer,
    Fault::Timeout,
    Fault::ServerDied,
    Fault::QueueFull,
];
/// Added to a fault that only the next call has.
const ONCE: i64 = 16;

/// A call or a sample: the number of its operation, and its arguments.
type Record = (usize, Value);

#[derive(Clone)]
enum Fake {
    Server(FakeServer<Record>),
    Subscriber(FakeSubscriber<Record>),
}

struct Bench {
    bed: TestBed,
    ports: Ports,
    program: Arc<Program>,
    /// Answers for the fake servers.
    answers: Rc<Guest>,
    fakes: HashMap<(usize, String), Fake>,
    /// Not here while a function of the worker runs.
    component: Option<Component>,
}

thread_local! {
    static BENCH: RefCell<Option<Bench>> = const { RefCell::new(None) };
}

fn wrong(error: impl std::fmt::Display) -> Answer {
    Answer::new(INTERNAL, 0, error.to_string())
}

fn with<T>(use_it: impl FnOnce(&mut Bench) -> Result<T, Answer>) -> Result<T, Answer> {
    BENCH.with_borrow_mut(|bench| match bench {
        Some(bench) => use_it(bench),
        None => Err(wrong("this thread has no TestContext")),
    })
}

/// Opens the bench of this thread. The answer has the values of the configuration.
pub(crate) fn open(program: Arc<Program>, answers: Guest) -> Result<Answer, Answer> {
    if BENCH.with_borrow(Option::is_some) {
        return Err(wrong(
            "this thread has a TestContext already; end it before the next one begins",
        ));
    }
    let configured = testing::configured(program.description).map_err(wrong)?;
    let schema = program.description.parameters;
    let schema = schema.and_then(|json| Parameters::from_json(json).ok());
    let values = parameters::encode(schema.as_ref(), &configured.values);
    let Parts { bed, core, ports } = TestBed::parts(program.description).map_err(wrong)?;
    let mut session = component::open(&program, core, &ports).map_err(wrong)?;
    if let (Some(period), Some(core)) = (configured.period, &mut session.core) {
        core.set_period(period);
    }
    context::enter(&program);
    let answers = Rc::new(answers);
    for (number, slot) in program.slots.iter().enumerate() {
        if slot.is_array {
            let answers = Rc::clone(&answers);
            bed.prepare_members(number, move |_, name| {
                answers(&Call {
                    numbers: (number, 0),
                    name,
                    ..Call::of(Function::Opened)
                });
            });
        }
    }
    session.begin();
    BENCH.set(Some(Bench {
        bed,
        ports,
        program,
        answers,
        fakes: HashMap::new(),
        component: None,
    }));
    Ok(Answer::new(0, 0, values))
}

/// Makes the worker, initializes it, and starts its state machine.
pub(crate) fn start(guest: Guest, parameters: &[u8]) -> Result<Answer, Answer> {
    let (program, ports) = with(|bench| {
        if bench.component.is_some() {
            return Err(wrong("the test has started its worker already"));
        }
        Ok((Arc::clone(&bench.program), Ports::clone(&bench.ports)))
    })?;
    let mut session = None;
    session::swap(&mut session);
    let session = session.ok_or_else(|| wrong("the session of the test is in use"))?;
    let is_managed = program.description.managed;
    let made = Component::initialize(program, guest, session, parameters);
    // The test may start another worker with the session.
    let failed = |answer: Answer, mut session: Option<Box<Session>>| {
        session::swap(&mut session);
        Err(answer)
    };
    let mut component = match made {
        Ok(component) => component,
        Err((error, session)) => return failed(Answer::of_worker(&error), session),
    };
    if let Err(error) = adapter::begin(&mut component, is_managed, &ports) {
        return failed(wrong(error), component.end());
    }
    keep(component)?;
    Ok(Answer::number(0))
}

/// Gives the thread the session, and the bench the component.
fn keep(mut component: Component) -> Result<(), Answer> {
    session::swap(component.session());
    with(|bench| {
        bench.component = Some(component);
        Ok(())
    })
}

/// Passes the component, with its session, to `use_it`.
fn with_component<T>(use_it: impl FnOnce(&mut Component, &TestBed) -> T) -> Result<T, Answer> {
    let (mut component, bed) = with(|bench| {
        let component = bench.component.take();
        let component = component.ok_or_else(|| {
            wrong("the test has no worker that could run: call start() first, and no function of the test from the worker")
        })?;
        Ok((component, bench.bed.clone()))
    })?;
    session::swap(component.session());
    let result = use_it(&mut component, &bed);
    keep(component)?;
    Ok(result)
}

fn nanoseconds(value: i64) -> Duration {
    Duration::from_nanos(u64::try_from(value).unwrap_or(0))
}

/// Does something with the bench of this thread.
pub(crate) fn act(act: Act, slot: usize, value: i64, text: &str) -> Result<Answer, Answer> {
    match act {
        Act::Close => close(),
        Act::Run => {
            let ran = with_component(|component, bed| {
                bed.run(
                    component,
                    nanoseconds(value),
                    Component::emergency,
                    |component, slot, member| component.end_call(slot, member).is_some(),
                )
            })?;
            ran.map_err(|error| Answer::of_worker(&error))?;
        }
        Act::Transition => return transition(text),
        Act::EndCalls => {
            let ended = with_component(|component, bed| {
                bed.end_calls(|slot, member| component.end_call(slot, member).is_some())
            })?;
            return Ok(Answer::number(i64::try_from(ended).unwrap_or(i64::MAX)));
        }
        Act::Advance => with(|bench| {
            bench.bed.advance(nanoseconds(value));
            Ok(())
        })?,
        Act::SetTime => with(|bench| {
            let time = u64::try_from(value).unwrap_or(0);
            bench.bed.set_time(Time::from_nanos(time));
            Ok(())
        })?,
        Act::SetState => set_state(text)?,
        Act::ListMembers => list_members(text)?,
        Act::Server => open_fake(slot, text, |bench| server(bench, slot, text))?,
        Act::Subscriber => open_fake(slot, text, |bench| Ok(subscriber(bench, slot, text)))?,
        Act::AnswerDefaults => answer_defaults(slot, text)?,
        Act::Parameters => {
            let requested = session::with_core(rc_runtime::Core::take_requested_parameters)?;
            let mut writer = Writer::default();
            writer.length(requested.len());
            for (path, value) in &requested {
                writer.put(path);
                writer.put(&value.to_toml());
            }
            return Ok(Answer::new(0, 0, writer.into_bytes()));
        }
        Act::Answer => answer(slot, usize::try_from(value).unwrap_or(usize::MAX), text)?,
        Act::Calls | Act::Samples => {
            return records(match fake(slot, text)? {
                Fake::Server(server) => server.take_calls(),
                Fake::Subscriber(subscriber) => subscriber.take_samples(),
            });
        }
        Act::Fail => {
            let fault = usize::try_from(value % ONCE).ok();
            let fault = fault.and_then(|fault| FAULTS.get(fault));
            let fault = fault.ok_or_else(|| wrong("there is no such fault"))?;
            match fake(slot, text)? {
                Fake::Server(server) if value >= ONCE => server.fail_once(*fault),
                Fake::Server(server) => server.fail(*fault),
                Fake::Subscriber(_) => {}
            }
        }
        Act::FailPublishing => {
            let (member, reason) = text.split_once('\n').unwrap_or(("", text));
            if let Fake::Subscriber(subscriber) = fake(slot, member)? {
                subscriber.fail(reason);
            }
        }
        Act::Recover => match fake(slot, text)? {
            Fake::Server(server) => server.recover(),
            Fake::Subscriber(subscriber) => subscriber.recover(),
        },
        Act::Subscribers => {
            if let Fake::Subscriber(subscriber) = fake(slot, text)? {
                subscriber.set_subscribers(usize::try_from(value).unwrap_or(0));
            }
        }
    }
    Ok(Answer::number(0))
}

fn close() {
    let component = with(|bench| Ok(bench.component.take()));
    if let Ok(Some(mut component)) = component {
        session::swap(component.session());
        drop(component);
    }
    Session::end();
    // Not while it is borrowed: answers may be objects of the test.
    let bench = BENCH.take();
    drop(bench);
}

fn transition(word: &str) -> Result<Answer, Answer> {
    let found = Transition::ALL.into_iter().find(|of| of.word() == word);
    let transition = found.ok_or_else(|| wrong(format!("there is no transition `{word}`")))?;
    let mut failed = None;
    let taken = with_component(|component, bed| {
        bed.take(transition, |hook| {
            let ran = adapter::run_hook(component, hook);
            if let Err(error) = &ran {
                failed.get_or_insert_with(|| Answer::of_worker(error));
            }
            ran
        })
    })?;
    match (taken, failed) {
        (Ok(state), _) => Ok(Answer::text(&state.to_string())),
        (Err(_), Some(failed)) => Err(failed),
        (Err(missed), None) => Err(wrong(missed)),
    }
}

fn set_state(word: &str) -> Result<(), Answer> {
    let all = [
        ComponentState::Starting,
        ComponentState::Running,
        ComponentState::Emergency,
        ComponentState::Stopping,
    ];
    let found = all.into_iter().find(|known| known.word() == word);
    let found = found.ok_or_else(|| {
        let words = all.map(ComponentState::word).join(", ");
        wrong(format!("there is no state `{word}`; there are {words}"))
    })?;
    with(|bench| {
        bench.bed.set_state(found);
        Ok(())
    })
}

fn list_members(text: &str) -> Result<(), Answer> {
    let mut lines = text.lines();
    let array = lines.next().unwrap_or_default();
    let members: Vec<&str> = lines.collect();
    with(|bench| {
        let mut slots = bench.program.description.slots.iter();
        if !slots.any(|slot| slot.is_array && slot.name == array) {
            return Err(wrong(format!("the component has no slot array `{array}`")));
        }
        bench.bed.list_members(array, &members);
        Ok(())
    })
}

/// The fake peer of a slot, or of a member of this array.
fn fake(slot: usize, member: &str) -> Result<Fake, Answer> {
    with(|bench| {
        let fake = bench.fakes.get(&(slot, member.to_owned()));
        fake.cloned().ok_or_else(|| wrong("there is no such fake"))
    })
}

fn named(member: &str) -> Option<&str> {
    (!member.is_empty()).then_some(member)
}

/// Opens the fake peer of a slot, or of a member of this array, unless it is open.
fn open_fake(
    slot: usize,
    member: &str,
    fake: impl FnOnce(&Bench) -> Result<Fake, Answer>,
) -> Result<(), Answer> {
    with(|bench| {
        if bench.program.slots.get(slot).is_none() {
            return Err(wrong("the component has no such slot"));
        }
        let key = (slot, member.to_owned());
        if !bench.fakes.contains_key(&key) {
            let fake = fake(bench)?;
            bench.fakes.insert(key, fake);
        }
        Ok(())
    })
}

fn server(bench: &Bench, slot: usize, member: &str) -> Result<Fake, Answer> {
    let program = Arc::clone(&bench.program);
    let reader = move |request: &mut Request<'_>| {
        let mut operations = program.slots[slot].operations.iter().enumerate();
        let found = operations.find(|(_, operation)| operation.wire.id == request.operation);
        let Some((at, operation)) = found else {
            return Err(testing::unknown(request));
        };
        let value = request.arguments(&operation.wire, |reader| {
            read(&operation.request, reader).map_err(undecodable)
        })?;
        Ok((at, value))
    };
    let server = FakeServer::reading(&bench.bed, slot, named(member), reader);
    // An operation without a result needs no answer.
    for operation in &bench.program.slots[slot].operations {
        if operation.wire.two_way && operation.reply.members.is_empty() {
            answer_default(&server, operation).map_err(wrong)?;
        }
    }
    Ok(Fake::Server(server))
}

fn subscriber(bench: &Bench, slot: usize, member: &str) -> Fake {
    let program = Arc::clone(&bench.program);
    let reader = move |at: usize, reader: &mut Reader<'_>| {
        let operation = &program.slots[slot].operations[at];
        let value = read(&operation.request, reader).map_err(undecodable)?;
        Ok((at, value))
    };
    Fake::Subscriber(FakeSubscriber::reading(
        &bench.bed,
        slot,
        named(member),
        reader,
    ))
}

/// Answers the queries of a fake server that have no answer yet with default values.
fn answer_defaults(slot: usize, member: &str) -> Result<(), Answer> {
    let Fake::Server(server) = fake(slot, member)? else {
        return Err(wrong("the fake is a subscriber"));
    };
    let program = with(|bench| Ok(Arc::clone(&bench.program)))?;
    for operation in &program.slots[slot].operations {
        if operation.wire.two_way {
            answer_default(&server, operation).map_err(wrong)?;
        }
    }
    Ok(())
}

/// Answers a query with default values, if it has no answer yet.
fn answer_default(server: &FakeServer<Record>, operation: &Operation) -> Result<(), ValueError> {
    let (wire, reply) = (operation.wire, default(&operation.reply)?);
    server.or_default(&operation.wire, move |request| {
        request.arguments(&wire, |_| Ok(()))?;
        request.reply_with(0, |writer| write(&reply, writer))
    });
    Ok(())
}

/// Lets the program answer an operation of a fake server.
fn answer(slot: usize, number: usize, member: &str) -> Result<(), Answer> {
    let Fake::Server(server) = fake(slot, member)? else {
        return Err(wrong("the fake is a subscriber"));
    };
    let (program, answers) =
        with(|bench| Ok((Arc::clone(&bench.program), Rc::clone(&bench.answers))))?;
    let operation = program.operation(slot, number);
    let wire = operation
        .ok_or_else(|| wrong("the slot has no such operation"))?
        .wire;
    let member = member.to_owned();
    server.on(&wire, move |request| {
        let operation = &program.slots[slot].operations[number];
        let mut room = Vec::new();
        let body = request.arguments(&wire, |reader| {
            bodies::read(&operation.request, reader, &mut room)
        })?;
        let answer = answers(&Call {
            numbers: (slot, number),
            name: &member,
            body,
            has_reply: true,
            ..Call::of(Function::Answer)
        });
        if let Some(Err(error)) = answer.outcome() {
            let reason = format!("the answer of the test failed: {error}");
            return request.fail(&reason);
        }
        if !wire.two_way {
            return Ok(());
        }
        match component::reply(operation, &answer) {
            Ok((case, ty)) => request.reply_with(case, |writer| {
                let what = format!("the answer of the test to {}", operation.name);
                bodies::write(ty, &answer.bytes, &what, writer);
            }),
            Err(reason) => {
                let name = &operation.name;
                request.fail(&format!("the answer of the test to {name}(): {reason}"))
            }
        }
    });
    Ok(())
}

/// Numbers of operations, and bodies.
fn records(records: Vec<Record>) -> Result<Answer, Answer> {
    let mut writer = Writer::default();
    writer.length(records.len());
    for (operation, arguments) in records {
        writer.put(&u64::try_from(operation).unwrap_or(u64::MAX));
        writer.put(&encode_body(&arguments).map_err(wrong)?);
    }
    Ok(Answer::new(0, 0, writer.into_bytes()))
}
