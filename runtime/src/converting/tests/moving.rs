//! Samples that change their frame.

use super::*;
use crate::clock::{Clock, SimulatedClock, Time};
use rc_middleware::WakeEvent;

/// A tree in which `lidar` is 2 m ahead of `map`, turned to the left by a quarter about the axis up,
/// and `camera` 1 m ahead. It knows no other frame.
struct World {
    asked: Rc<RefCell<Vec<i64>>>,
    /// The limits of the calls.
    limits: Rc<RefCell<Vec<Duration>>>,
}

impl Client for World {
    fn guid(&self) -> [u8; 16] {
        [7; 16]
    }

    fn send(&mut self, _: Header, _: &dyn RequestBody) -> Result<(), CallError> {
        Ok(())
    }

    fn call(
        &mut self,
        _: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        self.limits.borrow_mut().push(limit);
        let bytes = buffer(request)?;
        let id = rpc::request_id(&bytes).expect("an envelope");
        let mut reader = Reader::new(&bytes);
        let _ = rpc::open_request(&mut reader)?;
        rpc::open_body(&mut reader, Profile::Rpc);
        let [to, from] = [reader.get::<String>()?, reader.get::<String>()?];
        self.asked.borrow_mut().push(reader.get()?);
        let mut writer = Writer::default();
        let quarter = -std::f64::consts::FRAC_PI_2;
        let pose = match (to.as_str(), from.as_str()) {
            ("map", "lidar") => Some([0.0, 0.0, 2000.0, 0.0, quarter, 0.0]),
            ("map", "camera") => Some([0.0, 0.0, 1000.0, 0.0, 0.0, 0.0]),
            _ => None,
        };
        if let Some(pose) = pose {
            rpc::begin_reply(&mut writer, id, QUERY[0].id, 0);
            writer.put(&pose);
        } else {
            rpc::begin_reply(&mut writer, id, QUERY[0].id, rc_conversion::EXCEPTION);
            writer.put(&0_i32);
            cdr::text("no\u{7} node", &mut writer);
        }
        let bytes = writer.finish()?.to_vec();
        take(Header::default(), &bytes);
        Ok(())
    }

    fn start(&mut self, _: Header, _: &dyn RequestBody, _: Duration) -> Result<(), CallError> {
        Err(CallError::TooManyStarted)
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
}

static QUERY: [Operation; 1] = [Operation::query(
    rc_conversion::QUERY.0,
    77,
    rc_conversion::QUERY.1,
    &[ReplyVariant::of::<[f64; 6]>(0)],
)];

/// Client of a [`World`], and the requests that arrive there.
struct Asking {
    frames: Frames,
    asked: Rc<RefCell<Vec<i64>>>,
    limits: Rc<RefCell<Vec<Duration>>>,
    idle: IdleFlag,
    stop: WakeEvent,
}

const LIMIT: Duration = Duration::from_secs(1);

fn asking(clock: &Arc<dyn Clock>, waits: bool) -> Asking {
    let (asked, limits) = (Rc::default(), Rc::default());
    let world = World {
        asked: Rc::clone(&asked),
        limits: Rc::clone(&limits),
    };
    let tree = Tree::new(TypedClient::new(Box::new(world), LIMIT), &QUERY).expect("the query");
    let idle = IdleFlag::default();
    let stop = WakeEvent::new().expect("an event");
    let waiting = (clock, waits.then(|| stop.clone()));
    Asking {
        frames: Frames::new(Source::Tree(Box::new(tree)), LIMIT, waiting, &idle),
        stop,
        asked,
        limits,
        idle,
    }
}

/// Points in a frame that the message names become those in the map.
const MOVING: &str = "0i^$0>map@0*1000000:q?s?[{3f!|m^0&@0;m^1&@1;m^2&@2;a$0&$1;a$3&$2;a$4&^3;m^4&@0;m^5&@1;m^6&@2;a$6&$7;a$9&$8;a$10&^7;=$5&$11&@2}]";

/// A scan at this time in milliseconds.
fn scan(time: i64, frame: &str, point: [f32; 3]) -> (Header, Vec<u8>) {
    sample(|writer| {
        writer.put(&time);
        cdr::text(frame, writer);
        writer.put(&vec![point]);
    })
}

#[test]
fn samples_change_their_frame_at_their_time() {
    let plan: Plan = MOVING.parse().expect("a plan");
    let samples = [
        scan(5, "lidar", [1.0, 0.5, 3.0]),
        scan(6, "li\u{7}dar", [1.0, 0.5, 3.0]),
        scan(9000, "lidar", [1.0, 0.5, 3.0]),
        scan(7, "lidar", [0.0, 0.0, 0.0]),
        // The name changes while the component runs.
        scan(7, "camera", [1.0, 0.5, 3.0]),
        scan(8, "lidar", [0.0, 0.0, 0.0]),
    ];
    let samples = samples.iter().rev().cloned().collect();
    let port = Samples(File::open("/dev/null").expect("a descriptor"), samples);
    let counts = ConversionCounts::default();
    let clock = SimulatedClock::default();
    clock.set(Time::from_nanos(8_000_000));
    let clock: Arc<dyn Clock> = Arc::new(clock);
    let Asking { frames, asked, .. } = asking(&clock, false);
    let open = || Ok(frames);
    let plan = (&plan, 0, &OPERATIONS[0]);
    let port =
        ConvertingSubscriber::over(plan, "n/Topic".to_owned(), &counts, open, Box::new(port));
    let mut port = port.expect("a port");
    let (mut received, mut errors) = (Vec::new(), Vec::new());
    loop {
        match port.receive(&mut |_, body| received.push(body.to_vec())) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => errors.push(error.to_string()),
        }
    }
    // Ahead in the lidar is to the left in the map, and its left is behind.
    assert_eq!(received[0], scan(5, "lidar", [1.5, 1.0, 3.0]).1);
    assert_eq!(received[1], scan(7, "lidar", [2.0, 0.0, 0.0]).1);
    assert_eq!(received[2], scan(7, "camera", [2.0, 0.5, 3.0]).1);
    assert_eq!(received[3], scan(8, "lidar", [2.0, 0.0, 0.0]).1);
    assert_eq!(
        errors,
        [
            "a message at `n/Topic` cannot be received: no transform from `li\\u{7}dar` to `map` at 6000000 ns: the server refused: no\\u{7} node",
            "a message at `n/Topic` cannot be received: no transform from `lidar` to `map` at 9000000000 ns: the clock of the network is at 0.008 s",
        ]
    );
    let times = [5_000_000, 6_000_000, 7_000_000, 7_000_000, 8_000_000];
    assert_eq!(*asked.borrow(), times);
    let counted = (counts.converted(), counts.refused(), counts.unplaced());
    assert_eq!(counted, (4, 0, 2));
}

/// A clock that runs.
#[derive(Debug)]
struct Running(std::time::Instant);

impl Clock for Running {
    fn now(&self) -> Time {
        Time::ZERO + self.0.elapsed()
    }
}

#[test]
fn a_sample_waits_for_its_time_to_come() {
    let clock: Arc<dyn Clock> = Arc::new(Running(std::time::Instant::now()));
    let Asking {
        mut frames,
        asked,
        stop,
        ..
    } = asking(&clock, true);
    let of = |time: Time| rc_conversion::Needed {
        from: "lidar".to_owned(),
        to: "map",
        time: i64::try_from(time.as_nanos()).expect("a time"),
    };
    let soon = clock.now() + LIMIT / 20;
    assert!(frames.transforms(&[of(soon)]).is_ok());
    assert!(clock.now() >= soon);
    // The first wait leaves too little time for the second one.
    let ahead = |part: u32| of(clock.now() + LIMIT / 20 * part);
    let late = frames.transforms(&[ahead(3), ahead(22)]);
    let (at, reason) = late.expect_err("beyond the limit");
    assert!(
        matches!((at, &reason), (1, NoTransform::NotYet(_))),
        "{reason}"
    );
    let far = of(clock.now() + LIMIT * 100);
    let (at, reason) = frames.transforms(&[far]).expect_err("it has not come");
    assert!(
        matches!((at, &reason), (0, NoTransform::NotYet(_))),
        "{reason}"
    );
    stop.stop();
    let soon = clock.now() + LIMIT / 2;
    let (_, reason) = frames.transforms(&[of(soon)]).expect_err("a stop");
    assert!(
        matches!(&reason, NoTransform::NotYet(now) if *now < soon),
        "{reason}"
    );
    assert_eq!(asked.borrow().len(), 2);
}

#[test]
fn equal_transforms_of_a_message_are_asked_once_and_have_one_deadline() {
    let clock: Arc<dyn Clock> = Arc::new(Running(std::time::Instant::now()));
    let Asking {
        mut frames,
        asked,
        limits,
        ..
    } = asking(&clock, true);
    let of = |time: i64| rc_conversion::Needed {
        from: "lidar".to_owned(),
        to: "map",
        time,
    };
    let known = frames.transforms(&[of(1), of(2), of(1), of(2)]);
    let known = known.unwrap_or_else(|(at, reason)| panic!("{at}: {reason}"));
    assert_eq!(known.len(), 4);
    assert_eq!(*asked.borrow(), [1, 2]);
    let limits = limits.borrow();
    assert!(limits[0] <= LIMIT && limits[1] < limits[0], "{limits:?}");
}

#[test]
fn a_component_that_is_not_active_asks_no_tree() {
    let samples = (1..=3).rev().map(|sequence| {
        let (header, body) = scan(5, "lidar", [1.0, 0.5, 3.0]);
        let header = Header {
            sequence,
            sender: 5,
            ..header
        };
        (header, body)
    });
    let port = Samples(
        File::open("/dev/null").expect("a descriptor"),
        samples.collect(),
    );
    let clock: Arc<dyn Clock> = Arc::new(Running(std::time::Instant::now()));
    let Asking {
        frames,
        asked,
        idle,
        ..
    } = asking(&clock, true);
    let counts = ConversionCounts::default();
    let plan: Plan = MOVING.parse().expect("a plan");
    let plan = (&plan, 0, &OPERATIONS[0]);
    let address = "n/Topic".to_owned();
    let open = || Ok(frames);
    let port = ConvertingSubscriber::over(plan, address, &counts, open, Box::new(port));
    let mut port = port.expect("a port");
    let mut gaps = Gaps::default();
    let (mut taken, mut lost) = (0, 0);
    for is_idle in [false, true, false] {
        idle.set(is_idle);
        let received = port.receive(&mut |header, _| {
            taken += 1;
            lost += gaps.note(&header);
        });
        assert_eq!(received, Ok(true));
    }
    assert_eq!((taken, lost, asked.borrow().len()), (2, 0, 2));
    assert_eq!((counts.converted(), counts.unplaced()), (2, 0));
}

#[test]
fn the_query_is_that_of_the_interface() {
    let generated =
        include_str!("../../../../components/interfaces/generated/src/rc_inner_model.rs");
    let (name, hash) = rc_conversion::QUERY;
    let own = format!("\"name\":\"{name}\",");
    let line = generated.lines().find(|line| line.contains(&own));
    let line = line.expect("the query");
    assert!(
        line.contains(&format!("\"hash\":\"{hash:016x}\"")),
        "{line}"
    );
    let thrown = format!(
        "\"throws\":[[\"RcInnerModel::InnerModelError\",{}]]",
        rc_conversion::EXCEPTION
    );
    assert!(line.contains(&thrown), "{line}");
}

#[test]
fn the_transforms_are_those_of_the_interface() {
    let generated = include_str!("../../../../components/interfaces/generated/src/transforms.rs");
    let (name, hash) = rc_conversion::TRANSFORMS;
    let own = format!("{{\"name\":\"{name}\",\"id\":1271285859,\"hash\":\"{hash:016x}\"");
    assert!(generated.contains(&own));
}
