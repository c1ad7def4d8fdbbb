//! Messages through the ports of slots that convert.

mod moving;

use super::*;
use rc_middleware::typed::{HandlerError, ReplyVariant, Request, Throws, TypedClient};
use rc_middleware::{Cdr, DecodeError, Gaps, Reader, Writer, cdr};
use std::cell::RefCell;
use std::fs::File;
use std::os::fd::AsFd;
use std::rc::Rc;
use std::sync::Arc;

const THROWN: i32 = 77;

static OPERATIONS: [Operation; 1] = [Operation {
    name: "measure",
    id: 5,
    type_hash: 9,
    two_way: true,
    replies: &[
        ReplyVariant::of::<f64>(THROWN),
        ReplyVariant::of::<String>(0),
        ReplyVariant::of::<f32>(0),
    ],
}];

/// A request in m that becomes one in mm; a reply and an exception in mm that become m.
const PLAN: &str = "0i:f{1000},0o:sf{1/1000},0e0:d{1/1000}";

fn plan() -> Plan {
    PLAN.parse().expect("a plan")
}

/// A server that notes the number of a request, and replies in mm.
struct Server {
    profile: Profile,
    case: i32,
    seen: Rc<RefCell<Vec<f32>>>,
    /// The replies to started calls.
    started: Vec<(Header, Vec<u8>)>,
}

impl Client for Server {
    fn guid(&self) -> [u8; 16] {
        [7; 16]
    }

    fn profile(&self) -> Profile {
        self.profile
    }

    fn send(&mut self, _: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        let bytes = buffer(request)?;
        let mut reader = Reader::new(&bytes);
        let _ = rpc::open_request(&mut reader)?;
        rpc::open_body(&mut reader, self.profile);
        self.seen.borrow_mut().push(reader.get()?);
        Ok(())
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        _: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        self.send(header, request)?;
        let id = rpc::request_id(request.begin()).expect("an envelope");
        let mut writer = Writer::default();
        match self.profile {
            Profile::Rpc => rpc::begin_reply(&mut writer, id, 5, self.case),
            Profile::Bare => {
                rpc::begin_reply(&mut writer, id, 5, 0);
                rpc::begin_body(&mut writer, self.profile);
                // The code, then every exception, then the result.
                writer.put(&i32::from(self.case != 0));
                writer.put(&if self.case == 0 { 0.0 } else { 2500.0_f64 });
            }
        }
        if self.case == 0 || self.profile == Profile::Bare {
            cdr::text("base", &mut writer);
            writer.put(&1500.0_f32);
        } else {
            writer.put(&2500.0_f64);
        }
        let bytes = writer.finish()?.to_vec();
        take(Header::default(), &bytes);
        Ok(())
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        let mut reply = Vec::new();
        self.call(header, request, limit, &mut |_, body| reply = body.to_vec())?;
        self.started.push((header, reply));
        Ok(())
    }

    fn forget(&mut self, sequence: u64) {
        self.started
            .retain(|(header, _)| header.sequence != sequence);
    }

    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        let (Header { sequence, .. }, reply) = self.started.pop()?;
        take(sequence, Header::default(), &reply);
        Some((sequence, Ok(())))
    }

    fn peers(&self) -> usize {
        1
    }
}

/// The reply to a call: the exception, or the result.
fn call(profile: Profile, case: i32, request: f32) -> (Result<(i32, f64), CallError>, Vec<f32>) {
    let seen = Rc::default();
    let port = Server {
        profile,
        case,
        seen: Rc::clone(&seen),
        started: Vec::new(),
    };
    let counts = ConversionCounts::default();
    let port = ConvertingClient::over(&plan(), &OPERATIONS, &counts, Box::new(port));
    let mut client = TypedClient::new(port, Duration::from_secs(1));
    let result = client.call_with(
        &OPERATIONS[0],
        |writer| writer.put(&request),
        |case, reader| {
            if case == THROWN {
                return Ok::<_, CallError>((case, reader.get()?));
            }
            let _: String = reader.get()?;
            Ok((case, f64::from(reader.get::<f32>()?)))
        },
    );
    let expected = if result.is_ok() { (2, 0) } else { (0, 1) };
    assert_eq!((counts.converted(), counts.refused()), expected);
    let seen = seen.take();
    (result, seen)
}

#[test]
fn a_call_is_converted_there_and_back_in_both_profiles() {
    for profile in [Profile::Rpc, Profile::Bare] {
        assert_eq!(call(profile, 0, 0.25), (Ok((0, 1.5)), vec![250.0]));
        assert_eq!(
            call(profile, THROWN, 2.0),
            (Ok((THROWN, 2.5)), vec![2000.0])
        );
    }
}

/// Reply in `started_calls_are_converted_there_and_back`.
#[derive(Debug, PartialEq)]
enum Failed {
    Thrown(f64),
    Call(CallError),
}

impl From<CallError> for Failed {
    fn from(error: CallError) -> Self {
        Self::Call(error)
    }
}

impl Throws for Failed {
    fn read(_: i32, reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Ok(Self::Thrown(reader.get()?))
    }

    fn refuse(self, request: &mut Request<'_>) -> Result<(), HandlerError> {
        request.fail(&format!("{self:?}"))
    }
}

#[test]
fn started_calls_are_converted_there_and_back() {
    for profile in [Profile::Rpc, Profile::Bare] {
        for (case, expected) in [
            (0, Ok(("base".to_owned(), 1.5_f32))),
            (THROWN, Err(Failed::Thrown(2.5))),
        ] {
            let seen: Rc<RefCell<Vec<f32>>> = Rc::default();
            let port = Server {
                profile,
                case,
                seen: Rc::clone(&seen),
                started: Vec::new(),
            };
            let counts = ConversionCounts::default();
            let port = ConvertingClient::over(&plan(), &OPERATIONS, &counts, Box::new(port));
            let mut client = TypedClient::new(port, Duration::from_secs(1));
            let started = client.start::<(String, f32), Failed>(&OPERATIONS[0], (&0.25_f32,));
            let call = started.expect("to be started");
            let ended = client.poll_with(|ended| (ended.id, ended.result()));
            assert_eq!(ended, Some((call.id(), expected)));
            assert_eq!(seen.take(), [250.0]);
            assert_eq!((counts.converted(), counts.refused()), (2, 0));
        }
    }
}

#[test]
fn a_request_that_does_not_fit_is_not_sent() {
    let (result, seen) = call(Profile::Rpc, 0, 1e38);
    let error = result.expect_err("an error").to_string();
    let expected = "the argument cannot be sent: the number at byte 36 does not fit its type in the unit of the receiver";
    assert_eq!((error.as_str(), seen), (expected, Vec::new()));
}

/// A subscriber that has these samples.
struct Samples(File, Vec<(Header, Vec<u8>)>);

struct Kept(Vec<u8>);

impl KeptSample for Kept {
    fn memory(&self) -> &[u8] {
        &self.0
    }
}

impl Subscriber for Samples {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }

    fn acknowledge(&mut self, _: bool) {}

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        let next = self.1.pop();
        if let Some((header, body)) = &next {
            take(*header, body);
        }
        Ok(next.is_some())
    }

    fn can_keep(&self) -> bool {
        true
    }

    fn receive_kept(
        &mut self,
        take: &mut dyn FnMut(Header, Box<dyn KeptSample>),
    ) -> Result<bool, ReceiveError> {
        let next = self.1.pop();
        let any = next.is_some();
        if let Some((header, body)) = next {
            take(header, Box::new(Kept(body)));
        }
        Ok(any)
    }

    fn peers(&self) -> usize {
        1
    }
}

fn subscriber(samples: &[(Header, Vec<u8>)]) -> (Box<dyn Subscriber>, ConversionCounts) {
    let samples = samples.iter().rev().cloned().collect();
    let port = Samples(File::open("/dev/null").expect("a descriptor"), samples);
    let counts = ConversionCounts::default();
    let plan: Plan = "0i:sf{1000},0I:4x2<0,4:f{1000}>".parse().expect("a plan");
    let address = "n/Topic".to_owned();
    let plan = (&plan, 0, &OPERATIONS[0]);
    let none = || -> Result<Frames, OpenError> { panic!("no frame changes") };
    let port = ConvertingSubscriber::over(plan, address, &counts, none, Box::new(port));
    (port.expect("a port"), counts)
}

fn sample(values: impl Fn(&mut Writer<'_>)) -> (Header, Vec<u8>) {
    let mut writer = Writer::default();
    values(&mut writer);
    (Header::default(), writer.into_bytes())
}

#[test]
fn samples_are_converted_and_bad_ones_are_counted() {
    let named = |value: f32| {
        sample(|writer| {
            cdr::text("ab", writer);
            writer.put(&value);
        })
    };
    let strange = Header {
        type_hash: 8,
        ..Header::default()
    };
    let samples = [named(1.5), named(1e38), (strange, vec![1]), named(f32::NAN)];
    let (mut port, counts) = subscriber(&samples);
    assert_eq!(counts.last_refused(), None);
    let mut received = Vec::new();
    let mut errors = Vec::new();
    loop {
        match port.receive(&mut |_, body| received.push(body.to_vec())) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => errors.push(error.to_string()),
        }
    }
    assert_eq!(received[0], named(1500.0).1);
    assert_eq!(received[1], [1], "of another type");
    let last = &received[2][8..];
    assert!(f32::decode(&mut Reader::new(last)).is_ok_and(f32::is_nan));
    let expected = "a message at `n/Topic` cannot be received: the number at byte 8 does not fit its type in the unit of the receiver";
    assert_eq!(errors, [expected]);
    assert_eq!((counts.converted(), counts.refused()), (2, 1));
    let last =
        "from its provider: the number at byte 8 does not fit its type in the unit of the receiver";
    assert_eq!(counts.last_refused().as_deref(), Some(last));
}

#[test]
fn a_refused_sample_is_not_lost_as_well() {
    let numbered = |sequence: u64, value: f32| {
        let (header, body) = sample(|writer| {
            cdr::text("ab", writer);
            writer.put(&value);
        });
        let header = Header {
            sequence,
            sender: 5,
            ..header
        };
        (header, body)
    };
    let samples = [numbered(1, 1.0), numbered(2, 1e38), numbered(3, 2.0)];
    for is_kept in [false, true] {
        let (mut port, counts) = subscriber(&samples);
        let mut gaps = Gaps::default();
        let mut lost = 0;
        for _ in &samples {
            // The second one is an error, which the event loop reports.
            let _ = if is_kept {
                port.receive_kept(&mut |header, _| lost += gaps.note(&header))
            } else {
                port.receive(&mut |header, _| lost += gaps.note(&header))
            };
        }
        assert_eq!((counts.converted(), counts.refused(), lost), (2, 1, 0));
    }
}

#[test]
fn a_kept_image_is_an_aligned_copy() {
    let image = [
        9_u32.to_le_bytes(),
        1_u32.to_le_bytes(),
        2_f32.to_le_bytes(),
        5_f32.to_le_bytes(),
    ];
    let header = Header {
        type_hash: 9,
        encoding: Encoding::Image,
        ..Header::default()
    };
    let (mut port, _) = subscriber(&[(header, image.concat())]);
    assert!(port.can_keep());
    let mut kept = None;
    let taken = port.receive_kept(&mut |_, sample| kept = Some(sample));
    assert_eq!(taken, Ok(true));
    let kept = kept.expect("a sample");
    let converted = [image[0], image[1], 2000_f32.to_le_bytes(), image[3]];
    assert_eq!(kept.memory(), converted.concat());
    assert_eq!(kept.memory().as_ptr().addr() % 16, 0);
}
