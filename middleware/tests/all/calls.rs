//! Requests and replies in both ways of writing them, between a client and a server in memory.

use super::small::Pair;
use rc_middleware::in_place::BEHIND_ENVELOPE;
use rc_middleware::typed::{
    HandlerError, Operation, ReplyVariant, Request, Throws, TypedClient, reply_values,
};
use rc_middleware::{
    CallError, Client, DecodeError, Encoding, Header, Profile, Reader, Reply, RequestBody,
    request_body, rpc,
};
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

const NEGATIVE: i32 = 77;
const LARGE: i32 = 78;

/// `long root(long number)`, which throws `Negative` with a text or `Large` with two numbers. The
/// variants stand in the order of the declaration, and the result last.
const ROOT: Operation = Operation::query(
    "root",
    5,
    9,
    &[
        ReplyVariant::of::<String>(NEGATIVE),
        ReplyVariant::of::<[i64; 2]>(LARGE),
        ReplyVariant::of::<i32>(0),
    ],
);
const NOTE: Operation = Operation::one_way("note", 6, 8);

#[derive(Debug, PartialEq)]
enum RootError {
    Negative(String),
    Large([i64; 2]),
    Call(CallError),
}

impl From<CallError> for RootError {
    fn from(error: CallError) -> Self {
        Self::Call(error)
    }
}

impl Throws for RootError {
    fn read(case: i32, reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match case {
            NEGATIVE => reader.get().map(Self::Negative),
            LARGE => reader.get().map(Self::Large),
            _ => Err(DecodeError::Unknown("exception")),
        }
    }

    fn refuse(self, request: &mut Request<'_>) -> Result<(), HandlerError> {
        match self {
            Self::Negative(text) => request.reply_with(NEGATIVE, |writer| writer.put(&text)),
            Self::Large(numbers) => request.reply_with(LARGE, |writer| writer.put(&numbers)),
            Self::Call(error) => request.fail(&error),
        }
    }
}

fn root(number: i32) -> Result<i32, RootError> {
    match number {
        ..0 => Err(RootError::Negative("no".to_owned())),
        0..100 => Ok((0..=number)
            .rfind(|root| root * root <= number)
            .unwrap_or(0)),
        _ => Err(RootError::Large([i64::from(number), 100])),
    }
}

/// The reply of a server, in its own memory or in lent memory of a certain length.
#[derive(Default)]
struct Answer {
    body: Vec<u8>,
    profile: Profile,
    lends: bool,
    lent: Vec<u128>,
    length: usize,
    is_lent: bool,
}

impl Reply for Answer {
    fn body(&mut self) -> &mut Vec<u8> {
        &mut self.body
    }

    fn profile(&self) -> Profile {
        self.profile
    }

    fn can_loan(&self, _: Encoding) -> bool {
        self.lends
    }

    fn loan(&mut self, length: usize, _: Encoding) -> Option<&mut [u8]> {
        self.length = length;
        self.lent = vec![u128::MAX; length.div_ceil(16)];
        let bytes = rc_middleware::in_place::IntoBytes::as_mut_bytes(self.lent.as_mut_slice());
        self.lends.then_some(&mut bytes[..length])
    }

    fn send_loan(&mut self) {
        self.is_lent = true;
    }
}

/// A server of [`ROOT`] and [`NOTE`] at the other end of a client.
struct Server {
    profile: Profile,
    notes: Rc<RefCell<Vec<String>>>,
    is_dead: bool,
}

impl Server {
    fn serve(&self, header: Header, request: &dyn RequestBody) -> Result<Vec<u8>, CallError> {
        if self.is_dead {
            return Err(CallError::ServerDied("root".to_owned()));
        }
        let bytes = request_body::buffer(request)?;
        let mut answer = Answer {
            profile: self.profile,
            ..Answer::default()
        };
        let mut request = Request::open(header, &bytes, &mut answer)?;
        let read = |reader: &mut Reader<'_>| reader.get::<i32>();
        let _ = match request.operation {
            5 => request.try_answer(&ROOT, read, |root, writer| writer.put(root), root),
            6 => request.command(&NOTE, Reader::get, |note: String| {
                self.notes.borrow_mut().push(note);
            }),
            _ => request.unknown(),
        };
        request.close();
        Ok(answer.body)
    }
}

impl Client for Server {
    fn guid(&self) -> [u8; 16] {
        [3; 16]
    }

    fn profile(&self) -> Profile {
        self.profile
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        let reply = self.serve(header, request)?;
        assert!(reply.is_empty(), "a command has none");
        Ok(())
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        _: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let reply = self.serve(header, request)?;
        take(Header::default(), &reply);
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
        usize::from(!self.is_dead)
    }
}

fn client(profile: Profile, is_dead: bool) -> (TypedClient, Rc<RefCell<Vec<String>>>) {
    let notes = Rc::<RefCell<Vec<String>>>::default();
    let server = Server {
        profile,
        notes: notes.clone(),
        is_dead,
    };
    (
        TypedClient::new(Box::new(server), Duration::from_secs(9)),
        notes,
    )
}

#[test]
fn results_and_exceptions_arrive_with_and_without_an_envelope() {
    for profile in [Profile::Rpc, Profile::Bare] {
        let (mut client, notes) = client(profile, false);
        for number in [-1, 0, 17, 99, 100] {
            assert_eq!(client.call(&ROOT, (&number,)), root(number), "{number}");
        }
        let unknown = Operation::query("nothing", 7, 1, &[]);
        let refused = client.call::<i32, RootError>(&unknown, (&1_i32,));
        let reason = "there is no operation with the hash 00000007 here".to_owned();
        assert_eq!(refused, Err(RootError::Call(CallError::Refused(reason))));
        client.send(&NOTE, ("first",)).expect("sent");
        client.send(&NOTE, ("second",)).expect("sent");
        assert_eq!(notes.take(), ["first", "second"]);
        assert_eq!(client.sent().get(), 8);
        let started = client.start_with::<i32, CallError>(&ROOT, |writer| writer.put(&1_i32));
        assert_eq!(started.err(), Some(CallError::TooManyStarted));
    }
    let (mut client, _) = client(Profile::Rpc, true);
    let died = CallError::ServerDied("root".to_owned());
    assert_eq!(client.send(&NOTE, ("lost",)), Err(died.clone()));
    assert_eq!(client.call::<i32, CallError>(&ROOT, (&1_i32,)), Err(died));
}

/// The request for `root(number)`.
fn request(number: i32) -> Vec<u8> {
    let mut writer = rc_middleware::Writer::default();
    rpc::begin_request(&mut writer, rpc::RequestId::default(), ROOT.id);
    writer.put(&number);
    writer.into_bytes()
}

#[test]
fn the_values_of_a_recorded_reply_are_found() {
    for profile in [Profile::Rpc, Profile::Bare] {
        for (number, expected) in [(16, 0), (-1, NEGATIVE), (200, LARGE)] {
            let server = Server {
                profile,
                notes: Rc::default(),
                is_dead: false,
            };
            let mut bytes = request(number);
            if profile == Profile::Bare {
                let mut writer = rc_middleware::Writer::default();
                rpc::begin_request(&mut writer, rpc::RequestId::default(), ROOT.id);
                rpc::begin_body(&mut writer, Profile::Bare);
                writer.put(&number);
                bytes = writer.into_bytes();
            }
            let reply = server.serve(Header::default(), &bytes).expect("a reply");
            let found = reply_values(&ROOT, server.profile(), Header::default(), &reply);
            let (case, at) = found.expect("a reply").expect("values");
            assert_eq!(case, expected);
            // In a bare reply, the values of other variants lie before and behind.
            let mut reader = Reader::new(&reply);
            reader.raw(at).expect("a place");
            match case {
                NEGATIVE => assert_eq!(reader.get::<String>().as_deref(), Ok("no")),
                LARGE => assert_eq!(reader.get::<[i64; 2]>(), Ok([200, 100])),
                _ => assert_eq!(reader.get::<i32>(), Ok(4)),
            }
            let image = Header {
                encoding: Encoding::Image,
                ..Header::default()
            };
            let found = reply_values(&ROOT, server.profile(), image, &reply);
            assert_eq!(
                found.map(|of| of.map(|(_, at)| at)),
                Ok(Some(BEHIND_ENVELOPE))
            );
            let other = Operation { id: 4, ..ROOT };
            assert!(reply_values(&other, server.profile(), Header::default(), &reply).is_err());
        }
    }
}

/// A bare reply holds all variants, those that were not chosen with their defaults.
#[test]
fn a_bare_reply_has_the_other_variants_with_their_defaults() {
    let server = Server {
        profile: Profile::Bare,
        notes: Rc::default(),
        is_dead: false,
    };
    let reply_to = |number: i32| {
        let mut writer = rc_middleware::Writer::default();
        rpc::begin_request(&mut writer, rpc::RequestId::default(), ROOT.id);
        rpc::begin_body(&mut writer, Profile::Bare);
        writer.put(&number);
        server
            .serve(Header::default(), &writer.into_bytes())
            .expect("a reply")
    };
    for (number, expected) in [
        (16, (0, String::new(), [0_i64, 0], Some(4))),
        (-1, (1, "no".to_owned(), [0, 0], Some(0))),
        (200, (2, String::new(), [200, 100], Some(0))),
    ] {
        let reply = reply_to(number);
        let mut reader = Reader::new(&reply);
        reader.raw(rpc::ENVELOPE).expect("an envelope");
        let (code, text) = (reader.get(), reader.get());
        let (numbers, result) = (reader.get(), reader.get().ok());
        assert_eq!(
            (
                code.expect("a code"),
                text.expect("a text"),
                numbers.expect("numbers"),
                result
            ),
            expected
        );
        assert!(reader.rest().is_empty());
    }
}

#[test]
fn a_reply_in_place_lies_behind_its_envelope() {
    let pair = Operation::query("pair", 5, 9, &[]);
    let serve = |lends: bool, type_hash: u64, number: i32| {
        let bytes = request(number);
        let header = Header {
            type_hash,
            ..Header::default()
        };
        let mut answer = Answer {
            lends,
            ..Answer::default()
        };
        let mut request = Request::open(header, &bytes, &mut answer).expect("a request");
        let read = |reader: &mut Reader<'_>| reader.get::<i32>();
        let answered = request.answer_in_place(&pair, read, |number, pair: &mut Pair| {
            assert_eq!(pair.numbers, [0, 0], "its defaults");
            pair.numbers = [1, number];
        });
        request.close();
        (answered, answer)
    };
    let (answered, answer) = serve(true, 9, 7);
    assert_eq!((answered, answer.is_lent), (Ok(()), true));
    assert_eq!(answer.length, BEHIND_ENVELOPE + size_of::<Pair>());
    let bytes = rc_middleware::in_place::IntoBytes::as_bytes(answer.lent.as_slice());
    let mut reader = Reader::of(&bytes[BEHIND_ENVELOPE..answer.length], Encoding::Image);
    assert_eq!(reader.in_place::<Pair>().expect("a pair").numbers, [1, 7]);
    let mut reader = Reader::new(bytes);
    let reply = rpc::open_reply(&mut reader, 5).expect("an envelope").1;
    assert_eq!(reply, rpc::ReplyKind::Case(0));
    // A value outside its range is not a reply, and another program gets CDR.
    let (answered, answer) = serve(true, 9, 10);
    assert!(answered.is_err() && !answer.is_lent);
    for (lends, type_hash) in [(true, 0), (false, 9)] {
        let (answered, answer) = serve(lends, type_hash, 7);
        assert_eq!((answered, answer.is_lent), (Ok(()), false));
        let found = reply_values(&pair, Profile::Rpc, Header::default(), &answer.body);
        let (_, at) = found.expect("a reply").expect("values");
        let mut reader = Reader::new(&answer.body);
        reader.raw(at).expect("a place");
        assert_eq!(reader.get::<Vec<i32>>(), Ok(vec![1, 7]));
    }
}
