//! A component whose values know their age: it hears what it publishes, collects it, asks a server in
//! this process and answers that one. What it publishes depends on ages.

use rc_middleware::qos::Qos;
use rc_middleware::typed::{self, HandlerError, Operation, Request, TypedClient, TypedPublisher};
use rc_middleware::{CallError, Cdr, DecodeError, Member, Reader, Writer};
use rc_runtime::{
    Collect, Collected, Component, Core, Description, FreshSlot, LatestSlot, Ports, Role, Sample,
    Slot, StartError, Values, WorkerError, embed, run_with,
};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

const LEFT: Operation = Operation::one_way("left", 1, 11);
const RIGHT: Operation = Operation::one_way("right", 2, 12);
const OUT: Operation = Operation::one_way("out", 3, 13);
const DOUBLE: Operation = Operation::query("double", 4, 14, &[]);
const LAST: Operation = Operation::query("last", 5, 15, &[]);
/// How often each of them computes.
const PERIODS: i32 = 100;

/// A number that counts how often it is read from bytes.
#[derive(Clone, Debug)]
struct Number(i32);

static DECODED: AtomicU64 = AtomicU64::new(0);

impl Cdr for Number {
    fn encode(&self, writer: &mut Writer<'_>) {
        writer.put(&self.0);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        DECODED.fetch_add(1, Ordering::Relaxed);
        reader.get().map(Self)
    }
}

const fn slot(
    name: &'static str,
    role: Role,
    interface: &'static str,
    qos: Qos,
    operations: &'static [Operation],
) -> Slot {
    Slot {
        name,
        role,
        interface,
        type_name: interface,
        type_hash: 7,
        backend: "local",
        qos,
        is_array: false,
        operations,
        external_types: &[],
    }
}

const fn description(name: &'static str, slots: &'static [Slot]) -> Description {
    Description {
        name,
        model_hash: 1,
        middleware: "local",
        period: Duration::from_millis(2),
        parameters: None,
        folder: "/nowhere",
        slots,
        backends: &[rc_local::LINKED],
        types: &[],
        simulates_time: false,
        managed: false,
        converter: None,
        note: b"",
    }
}

const FRESH: Qos = Qos {
    fresh: Some(Duration::from_millis(1)),
    ..Qos::SUBSCRIBER
};
const CACHED: Qos = Qos {
    cache: Some(Duration::from_millis(5)),
    ..Qos::CALL
};
const LATEST: Qos = Qos {
    latest: Some(Duration::from_secs(9)),
    ..Qos::CALL
};

static PAIRS: [Collect; 1] = [Collect {
    name: "pair",
    topics: &[(2, 0), (3, 0)],
    within: Duration::from_millis(3),
}];

static AGED: Description = description(
    "aged",
    &[
        slot("Left", Role::Publishes, "Left", Qos::PUBLISHER, &[LEFT]),
        slot("Right", Role::Publishes, "Right", Qos::PUBLISHER, &[RIGHT]),
        slot("left", Role::SubscribesTo, "Left", FRESH, &[LEFT]),
        slot("right", Role::SubscribesTo, "Right", FRESH, &[RIGHT]),
        slot("Out", Role::Publishes, "Out", Qos::PUBLISHER, &[OUT]),
        slot("Double", Role::Requires, "Double", CACHED, &[DOUBLE]),
        slot("Last", Role::Implements, "Last", LATEST, &[LAST]),
    ],
);

static GIVER: Description = description(
    "giver",
    &[
        slot("Double", Role::Implements, "Double", Qos::CALL, &[DOUBLE]),
        slot("Last", Role::Requires, "Last", Qos::CALL, &[LAST]),
    ],
);

struct Aged {
    core: Core,
    left: TypedPublisher,
    right: TypedPublisher,
    out: TypedPublisher,
    double: TypedClient,
    newest: FreshSlot,
    last: LatestSlot,
    number: i32,
    pairs: i32,
}

impl Aged {
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        Ok(Self {
            left: ports.publisher(0, 0)?,
            right: ports.publisher(1, 0)?,
            out: ports.publisher(4, 0)?,
            double: ports.client(5)?,
            newest: FreshSlot::new(&core, 2),
            last: LatestSlot::new(&core, 6),
            core,
            number: 0,
            pairs: 0,
        })
    }

    /// Publishes a number, and a time in nanoseconds.
    fn tell(&mut self, number: i32, time: Duration) {
        let time = time.as_nanos() as i64;
        let _ = self.out.publish_parts((&number, &time));
    }
}

impl Component for Aged {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.number += 1;
        let number = self.number;
        // The right one comes every second time, and later.
        let _ = self.left.publish_parts((&Number(number),));
        if number % 2 == 0 {
            let _ = self.right.publish_parts((&Number(number - 1),));
        }
        let newest = self.newest.newest(0, typed::read::<(Number,)>);
        if let Ok(newest) = newest {
            self.tell(newest.value.0.0, newest.age());
        }
        let asked: Result<Number, CallError> = self.double.call(&DOUBLE, (&Number(number / 4),));
        if let (Ok(Number(double)), Some(how)) = (asked, self.double.freshness()) {
            self.tell(
                double + 1000 * i32::from(how.made == rc_middleware::Made::Cached),
                how.age,
            );
        }
        let _ = self.last.set(0, Number(number), typed::reply);
        if number == PERIODS {
            println!("{} pairs", self.pairs);
            println!("{} decoded", DECODED.load(Ordering::Relaxed));
            self.core.stop("done");
        }
        Ok(())
    }

    fn serve(
        &mut self,
        _: usize,
        _: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        self.tell(-1, Duration::ZERO);
        request.answer(&LAST, typed::read::<()>, typed::reply, |()| Number(0))
    }

    fn receive(
        &mut self,
        _: usize,
        _: Option<&Member>,
        _: usize,
        _: Sample<'_>,
    ) -> Result<(), HandlerError> {
        self.tell(-2, Duration::ZERO);
        Ok(())
    }

    fn collects(&self) -> &'static [Collect] {
        &PAIRS
    }

    fn collected(&mut self, _: usize, samples: &[Collected]) -> Result<(), HandlerError> {
        for sample in samples {
            let sample = sample.read(typed::read::<(Number,)>)?;
            self.tell(sample.value.0.0, sample.age());
        }
        self.pairs += 1;
        Ok(())
    }
}

struct Giver {
    core: Core,
    last: TypedClient,
}

impl Component for Giver {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        let _: Result<Number, CallError> = self.last.call(&LAST, ());
        Ok(())
    }

    fn serve(
        &mut self,
        _: usize,
        _: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        request.answer(
            &DOUBLE,
            typed::read::<(Number,)>,
            typed::reply,
            |(number,)| Number(2 * number.0),
        )
    }
}

/// Runs it with a command line, beside its server if it is not repeated. Returns the exit code.
pub(super) fn main(arguments: &[&str]) -> u8 {
    let mut rest = arguments.iter().skip_while(|one| **one != "--network");
    let network = rest.nth(1);
    let is_repeated = arguments.contains(&"--replay");
    let giver = network.filter(|_| !is_repeated).map(|network| {
        let start = |core, ports: &Ports, _: &Values| {
            let last = ports.client(1)?;
            Ok(Giver { core, last })
        };
        embed(&GIVER, start, &["--network", network]).expect("a component")
    });
    let arguments = arguments.iter().map(Into::into);
    let code = run_with(&AGED, Aged::start, arguments, PathBuf::new());
    drop(giver);
    code
}
