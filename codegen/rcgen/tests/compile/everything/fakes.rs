//! Fakes of every construct; run by `tests/compile.rs`.

use everything::SpecificWorker;
use everything_generated::network_time::Time;
use everything_generated::testing::{
    Fault, LonelyQueryCall, NewsSample, OtherCall, RaisesCall, TestContext, TinyTopicSample,
    TopicSample,
};
use everything_generated::{
    Annotated, Bare, Bounded, Box_, BoxAnswer, Broken, Call, CallError, CallId, ComponentState,
    Context, Everything, Failed, FailsError, FarAway, Member, Move, MoveError, Numbers, OtherDone,
    OthersDone, RaisesDone, SendError, StateMachine, TryError, VeryBroken, Worker, WorkerError,
};
use std::cell::Cell;
use std::rc::Rc;
use std::time::Duration;

fn context() -> TestContext {
    TestContext::configured().expect("etc/config.toml is right")
}

/// The context as the worker sees it.
fn ctx(test: &mut TestContext) -> &mut Context {
    test
}

#[test]
fn answers_travel_as_the_wire_has_them() {
    let mut test = context();
    test.other.on_implicit_query(|| 7);
    test.other
        .on_matrix(|nested, bounded, text| nested.len() as f32 + bounded[0] + text.len() as f32);
    test.other.on_box(|number| (Box_::Dyn, number, 0.5, None));
    test.third.on_implicit_query(|| 8);
    let ctx = ctx(&mut test);
    assert_eq!(ctx.other.implicit_query(), Ok(7));
    assert_eq!(ctx.third.implicit_query(), Ok(8));
    let nested = [vec!["a".to_owned()], vec![]];
    assert_eq!(ctx.other.matrix(&nested, &[1.5], "abc"), Ok(6.5));
    let answer: BoxAnswer = (Box_::Dyn, 9, 0.5, None);
    assert_eq!(ctx.other.box_(9), Ok(answer));
    // The range of the interface holds: no answer of a real server breaks it, either.
    assert!(
        matches!(ctx.other.box_(10), Err(CallError::Refused(reason)) if reason.contains("0 to 9"))
    );
    let calls = [
        OtherCall::ImplicitQuery,
        OtherCall::Matrix {
            nested: nested.to_vec(),
            bounded: vec![1.5],
            text: "abc".to_owned(),
        },
        OtherCall::Box { box_: 9 },
        OtherCall::Box { box_: 10 },
    ];
    assert_eq!(test.other.take_calls(), calls);
    assert_eq!(test.other.calls(), []);
    assert_eq!(test.third.calls().len(), 1);
}

#[test]
fn exceptions_are_those_of_the_interface() {
    let mut test = context();
    test.other.on_move(|of, as_, ref_| {
        assert_eq!((of.dyn_, as_), (3, Box_::Ref));
        Err(MoveError::FarAway(FarAway {
            result: ref_,
            ..FarAway::default()
        }))
    });
    test.other.on_fails(|b, a| match a.level {
        0 => Err(Broken {
            code: 4,
            ..Broken::default()
        }
        .into()),
        1 => Err(Bare {}.into()),
        2 => Err(VeryBroken {
            how_much: 9,
            ..VeryBroken::default()
        }
        .into()),
        _ => Ok(b),
    });
    let ctx = ctx(&mut test);
    let of = Move {
        dyn_: 3,
        ..Move::default()
    };
    let far = FarAway {
        result: 5,
        ..FarAway::default()
    };
    assert_eq!(
        ctx.other.move_(&of, Box_::Ref, 5),
        Err(MoveError::FarAway(far))
    );
    let mut fails = |level| {
        let annotated = Annotated {
            level,
            ..Annotated::default()
        };
        ctx.other.fails(&Bounded::default(), &annotated)
    };
    assert!(matches!(
        fails(0),
        Err(FailsError::Broken(Broken { code: 4, .. }))
    ));
    assert!(matches!(fails(1), Err(FailsError::Bare(_))));
    assert!(matches!(
        fails(2),
        Err(FailsError::VeryBroken(VeryBroken { how_much: 9, .. }))
    ));
    assert_eq!(fails(3), Ok(Bounded::default()));
    // Operations without a result are answered at once.
    assert_eq!(ctx.raises.try_(1), Ok(()));
    assert_eq!(test.raises.calls(), [RaisesCall::Try { x: 1 }]);
}

#[test]
fn without_an_answer_a_query_says_so_and_defaults_help() {
    let mut test = context();
    let unanswered = ctx(&mut test).lonely_query.get().expect_err("no answer");
    let expected = "the server refused: the test does not answer `get` of test/LonelyQuery; \
                    set an answer with its `on_…`, or call `answer_defaults`";
    assert_eq!(unanswered.to_string(), expected);
    test.other.on_implicit_query(|| 3);
    test.answer_defaults();
    let ctx = ctx(&mut test);
    assert_eq!(ctx.lonely_query.get(), Ok(0));
    // Defaults replace no answer.
    assert_eq!(ctx.other.implicit_query(), Ok(3));
    assert_eq!(ctx.other.outputs(), Ok((0, String::new(), Vec::new())));
    assert_eq!(
        test.lonely_query.calls(),
        [LonelyQueryCall::Get, LonelyQueryCall::Get]
    );
}

#[test]
fn faults_are_those_of_a_middleware() {
    let mut test = context();
    test.answer_defaults();
    let address = || "test/other".to_owned();
    let limit = Duration::from_millis(250);
    for (fault, query, command) in [
        (
            Fault::NoServer,
            CallError::NoServer(address()),
            Err(CallError::NoServer(address())),
        ),
        (
            Fault::Timeout,
            CallError::Deadline {
                address: address(),
                limit,
            },
            Ok(()),
        ),
        (
            Fault::ServerDied,
            CallError::ServerDied(address()),
            Err(CallError::NoServer(address())),
        ),
        (
            Fault::QueueFull,
            CallError::QueueFull(address()),
            Err(CallError::QueueFull(address())),
        ),
    ] {
        test.other.fail(fault);
        for _ in 0..2 {
            assert_eq!(ctx(&mut test).other.implicit_query(), Err(query.clone()));
            assert_eq!(ctx(&mut test).other.no_arguments(), command);
        }
        assert_eq!(
            ctx(&mut test).other.is_connected(),
            fault != Fault::NoServer
        );
        test.other.recover();
        assert_eq!(ctx(&mut test).other.implicit_query(), Ok(0));
        test.other.fail_once(fault);
        assert_eq!(ctx(&mut test).other.implicit_query(), Err(query));
        assert_eq!(ctx(&mut test).other.implicit_query(), Ok(0));
    }
    // An exception travels as an error of the call where the fault is one of the middleware.
    test.raises.fail(Fault::NoServer);
    assert!(matches!(
        ctx(&mut test).raises.try_(1),
        Err(TryError::Call(CallError::NoServer(_)))
    ));
    ctx(&mut test).stop("enough");
    assert_eq!(
        ctx(&mut test).other.implicit_query(),
        Err(CallError::Stopping)
    );
    assert_eq!(ctx(&mut test).other.no_arguments(), Ok(()));
}

#[test]
fn samples_are_kept_in_their_order() {
    let mut test = context();
    let publish = |ctx: &mut Context| -> Result<(), SendError> {
        ctx.news.simple(4)?;
        ctx.news.empty()?;
        ctx.news.many(&Numbers::default(), "text", &[], 3)?;
        ctx.topic.x(&[1, 2])?;
        ctx.tiny_topic.go()
    };
    assert_eq!(publish(&mut test), Ok(()));
    let many = NewsSample::Many {
        numbers: Numbers::default(),
        text: "text".to_owned(),
        outline: Vec::new(),
        level: 3,
    };
    assert_eq!(
        test.news.take_samples(),
        [NewsSample::Simple { x: 4 }, NewsSample::Empty, many]
    );
    assert_eq!(test.topic.samples(), [TopicSample::X { x: vec![1, 2] }]);
    assert_eq!(test.tiny_topic.samples(), [TinyTopicSample::Go]);
    // A value outside of its range is refused as always.
    assert!(matches!(
        ctx(&mut test).news.many(&Numbers::default(), "", &[], 4),
        Err(SendError::Invalid(_))
    ));
    test.news.fail("no memory");
    let failed = ctx(&mut test).news.empty().expect_err("a fault");
    assert_eq!(
        failed.to_string(),
        "the middleware failed at `test/news/empty`: no memory"
    );
    test.news.recover();
    assert_eq!(test.news.samples(), []);
    test.news.set_subscribers(0);
    assert_eq!(ctx(&mut test).news.subscribers(), 0);
    assert_eq!(ctx(&mut test).topic.subscribers(), 1);
}

#[test]
fn handlers_and_hooks_take_the_context() -> Result<(), WorkerError> {
    let mut test = context();
    let mut worker = SpecificWorker::initialize(&mut test)?;
    <SpecificWorker as Everything<Context>>::turn(&mut worker, &mut test, 0.5, 0.5);
    let answer = <SpecificWorker as Everything<Context>>::implicit_query(&mut worker, &mut test);
    assert_eq!(answer, 0);
    worker.params_changed(&mut test, &[])?;
    worker.emergency(&mut test);
    worker.restore(&mut test);
    worker.finalize(&mut test);
    assert_eq!(
        (test.name(), test.network(), test.state()),
        ("everything", "test", ComponentState::Running)
    );
    Ok(())
}

/// Counts what the runtime calls, and when.
struct Counting {
    log: Vec<(u64, &'static str)>,
    other: Rc<Cell<u32>>,
}

impl Worker<Context> for Counting {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        ctx.set_period(Duration::from_millis(10));
        Ok(Self {
            log: Vec::new(),
            other: Rc::default(),
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.log.push((ctx.now().as_nanos() / 1_000_000, "compute"));
        ctx.other.turn(1.0, 1.0)?;
        match self.log.len() {
            2 => ctx.set_period(Duration::from_millis(50)),
            4 => return Err(WorkerError::Emergency("hot".to_owned())),
            6 => ctx.stop("done"),
            _ => {}
        }
        Ok(())
    }

    fn emergency(&mut self, ctx: &mut Context) {
        self.log
            .push((ctx.now().as_nanos() / 1_000_000, "emergency"));
    }
}

impl StateMachine for Counting {}
impl OtherDone for Counting {}
impl RaisesDone for Counting {}
impl OthersDone for Counting {}

#[test]
fn time_is_virtual() -> Result<(), WorkerError> {
    let mut test = context();
    let mut worker: Counting = test.start()?;
    let turned = Rc::clone(&worker.other);
    // An answer may use the fake itself.
    let fake = test.other.clone();
    test.other
        .on_turn(move |_, _| turned.set(fake.calls().len() as u32));
    test.run(&mut worker, Duration::from_millis(175))?;
    assert_eq!(
        worker.log,
        [
            (0, "compute"),
            (10, "compute"),
            (60, "compute"),
            (110, "compute"),
            (160, "emergency")
        ]
    );
    assert_eq!(test.now(), Time::from_nanos(175_000_000));
    assert_eq!(
        (test.state(), worker.other.get()),
        (ComponentState::Emergency, 4)
    );
    test.set_state(ComponentState::Running);
    // It stops itself in the first of many periods.
    test.run(&mut worker, Duration::from_secs(3600))?;
    assert_eq!(worker.log.last(), Some(&(175, "compute")));
    test.set_time(Time::ZERO);
    test.advance(Duration::from_secs(1));
    assert_eq!(test.now(), Time::from_nanos(1_000_000_000));
    // A failed call ends a run.
    let mut test = context();
    let mut worker: Counting = test.start()?;
    test.other.fail(Fault::NoServer);
    let ended = test.run(&mut worker, Duration::from_secs(1));
    assert!(
        matches!(ended, Err(WorkerError::Failed(reason)) if reason.starts_with("no server at `test/other`"))
    );
    assert_eq!(worker.log, [(0, "compute")]);
    Ok(())
}

/// Starts queries of three slots in every period, two of which its handlers end.
#[derive(Default)]
struct Starting {
    left: Vec<Call<i32, CallError>>,
    handled: Vec<(CallId, &'static str)>,
    answers: Vec<(String, CallId, Result<BoxAnswer, CallError>)>,
    raised: Vec<Result<(), TryError>>,
    held: Vec<Call<BoxAnswer, CallError>>,
    tries: Vec<Call<(), TryError>>,
    computes: i32,
}

impl Worker<Context> for Starting {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        ctx.set_period(Duration::from_millis(10));
        ctx.others.open("front")?;
        ctx.others.open("back")?;
        Ok(Self::default())
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.computes += 1;
        let ended = self.left.iter().filter_map(|call| ctx.other.take(call));
        let ended: Vec<_> = ended.collect();
        assert_eq!(ended, vec![Ok(7); self.left.len()]);
        self.left = vec![ctx.other.start_implicit_query()?];
        for (member, client) in ctx.others.iter_mut() {
            let number = member.index() as i32;
            self.held.push(client.start_box(number)?);
        }
        self.tries.push(ctx.raises.start_try(self.computes)?);
        // Forgotten at once.
        drop(ctx.raises.start_try(-1)?);
        Ok(())
    }
}

impl StateMachine for Starting {}

impl OtherDone for Starting {}

impl OthersDone for Starting {
    fn box_done(
        &mut self,
        _: &mut Context,
        member: &Member,
        call: CallId,
        result: Result<BoxAnswer, CallError>,
    ) {
        self.held.retain(|held| held.id() != call);
        self.answers.push((member.name().to_owned(), call, result));
    }
}

impl RaisesDone for Starting {
    fn try_done(&mut self, _: &mut Context, call: CallId, result: Result<(), TryError>) {
        self.handled.push((call, "try"));
        self.tries.retain(|held| held.id() != call);
        self.raised.push(result);
    }
}

#[test]
fn started_queries_end_between_two_periods() -> Result<(), WorkerError> {
    let mut test = context();
    test.answer_defaults();
    test.other.on_implicit_query(|| 7);
    test.others
        .each(|fake| fake.on_box(|number| (Box_::Dyn, number, 0.5, None)));
    test.raises.on_try(|x| match x {
        2 => Err(Failed::default().into()),
        _ => Ok(()),
    });
    let mut worker: Starting = test.start()?;
    test.run(&mut worker, Duration::from_millis(30))?;
    assert_eq!(worker.computes, 3);
    // The members of one array have clients of their own, which number their calls.
    let box_answer =
        |name: &str, number: i32| (name.to_owned(), Ok((Box_::Dyn, number, 0.5, None)));
    let answers = worker.answers.iter();
    let answers: Vec<_> = answers
        .map(|(name, _, result)| (name.clone(), result.clone()))
        .collect();
    let period = [box_answer("front", 0), box_answer("back", 1)];
    assert_eq!(answers, [&period[..]; 3].concat());
    let failed = Err(TryError::from(Failed::default()));
    assert_eq!(worker.raised, [Ok(()), failed, Ok(())]);
    assert_eq!(worker.handled.len(), 3);
    assert_eq!((worker.held.len(), worker.tries.len()), (0, 0));
    // A server that does not reply ends the call by its limit; without one, none is started.
    test.raises.fail(Fault::Timeout);
    let call = ctx(&mut test).raises.start_try(4).expect("to be started");
    assert_eq!(test.end_calls(&mut worker), 1);
    assert!(matches!(
        worker.raised.last(),
        Some(Err(TryError::Call(CallError::Deadline { .. })))
    ));
    drop(call);
    test.raises.fail(Fault::NoServer);
    let none = ctx(&mut test).raises.start_try(4);
    assert!(matches!(none, Err(TryError::Call(CallError::NoServer(_)))));
    // A reply outside of its range is refused by the server.
    let outside = ctx(&mut test).others[0].start_box(10)?;
    assert_eq!(test.end_calls(&mut worker), 1);
    let (name, call, answer) = worker.answers.last().expect("an answer");
    assert_eq!((name.as_str(), *call), ("front", outside.id()));
    assert!(matches!(answer, Err(CallError::Refused(_))), "{answer:?}");
    Ok(())
}

#[test]
fn started_queries_of_a_slot_have_a_limit() {
    let mut test = context();
    test.answer_defaults();
    let ctx = ctx(&mut test);
    let calls: Vec<_> = std::iter::repeat_with(|| ctx.other.start_implicit_query())
        .take(20)
        .collect();
    assert_eq!(calls.iter().filter(|call| call.is_ok()).count(), 8);
    assert_eq!(
        calls.last().and_then(|call| call.as_ref().err()),
        Some(&CallError::TooManyStarted)
    );
    drop(calls);
    assert!(ctx.other.start_implicit_query().is_ok());
    // One that waits is none of them.
    assert_eq!(ctx.other.implicit_query(), Ok(0));
}
