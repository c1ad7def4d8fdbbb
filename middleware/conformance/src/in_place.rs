//! Samples that are written and read in place, also on a backend that lends no memory.

use crate::Subject;
use crate::network::{LIMIT, Network, endpoint, receive};
use rc_middleware::in_place::{self, FromBytes, Immutable, InPlace, IntoBytes, KnownLayout};
use rc_middleware::typed::{Operation, ReplyVariant, Request, TypedClient, TypedPublisher};
use rc_middleware::{
    CallError, DecodeError, EncodeError, Header, Reader, SendError, Subscriber, Writer, wait,
};
use std::time::Instant;

/// `struct Scan { int number; sequence<short, 1000000> beams; }`
#[derive(FromBytes, Immutable, IntoBytes, KnownLayout)]
#[zerocopy(crate = "rc_middleware::in_place::zerocopy")]
#[repr(C)]
struct ScanInPlace {
    number: i32,
    beams_length: u32,
    beams: [i16; 1_000_000],
}

impl ScanInPlace {
    fn beams(&self) -> &[i16] {
        in_place::filled(&self.beams, self.beams_length)
    }

    fn resize_beams(&mut self, length: usize) -> Result<&mut [i16], EncodeError> {
        in_place::resize(
            "Scan.beams",
            &mut self.beams,
            &mut self.beams_length,
            length,
        )
    }
}

impl InPlace for ScanInPlace {
    type Value = Vec<i16>;

    const NAME: &'static str = "Scan";

    fn reset(&mut self) {
        (self.number, self.beams_length) = (0, 0);
    }

    fn set(&mut self, value: &Vec<i16>) -> Result<(), EncodeError> {
        self.resize_beams(value.len())?.copy_from_slice(value);
        Ok(())
    }

    fn value(&self) -> Result<Vec<i16>, DecodeError> {
        Ok(self.beams().to_vec())
    }

    fn check(&self) -> Result<(), DecodeError> {
        Reader::new(&[]).range(
            "Scan.number",
            f64::from(self.number),
            (0.0, 99.0),
            "0 to 99",
        )
    }
}

/// The hash of the exception.
const BAD: i32 = 5;

const SCAN: Operation = Operation {
    name: "scan",
    id: 21,
    type_hash: 7,
    two_way: true,
    replies: &[
        ReplyVariant::of::<i32>(BAD),
        ReplyVariant::of::<Vec<i16>>(0),
    ],
};

/// Receives one sample, in either encoding.
fn take(subscriber: &mut dyn Subscriber) -> Vec<i16> {
    let end = Instant::now() + LIMIT;
    let mut value = None;
    while value.is_none() {
        assert!(Instant::now() < end, "no value came");
        let woken = wait(&[subscriber.descriptor()], crate::network::CYCLE) != 0;
        subscriber.acknowledge(woken);
        let received = subscriber.receive(&mut |header, body| {
            assert_eq!(header.type_hash, SCAN.type_hash);
            let mut reader = Reader::of(body, header.encoding);
            let scan = reader.in_place::<ScanInPlace>().expect("a scan");
            value = Some(scan.beams().to_vec());
        });
        received.expect("to receive");
    }
    value.unwrap_or_default()
}

/// A sample that was written in place and one that was not reach three subscribers, which read both
/// in either way.
pub fn samples_are_written_in_place(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Laser/scan");
    let backend = network.join_bare("both");
    let mut subscribers: Vec<_> = (0..3)
        .map(|_| backend.subscriber(&address).expect("a subscriber"))
        .collect();
    let port = backend.publisher(&address).expect("a publisher");
    network.meet(|| port.peers() == 3 && subscribers.iter().all(|one| one.peers() == 1));
    let mut topic = TypedPublisher::new(port, SCAN);
    for length in [0, 1, 1000, 1_000_000, 3] {
        let beams: Vec<i16> = (0..length).map(|at| at as i16).collect();
        let mut scan = topic.loan::<ScanInPlace>().expect("a loan");
        assert!(scan.beams().is_empty(), "earlier content is not visible");
        scan.set(&beams).expect("to fit");
        scan.send().expect("to be sent");
        for subscriber in &mut subscribers {
            assert_eq!(take(&mut **subscriber), beams);
        }
        topic
            .publish_with(|writer| writer.put(&beams))
            .expect("to be sent");
        for subscriber in &mut subscribers {
            assert_eq!(take(&mut **subscriber), beams);
        }
    }
    // A dropped loan is not sent, nor is an invalid value. Neither counts as lost.
    drop(topic.loan::<ScanInPlace>().expect("a loan"));
    let mut scan = topic.loan::<ScanInPlace>().expect("a loan");
    assert!(scan.resize_beams(1_000_001).is_err());
    scan.number = 100;
    assert!(matches!(scan.send(), Err(SendError::Invalid(_))));
    for subscriber in &mut subscribers {
        assert_eq!(subscriber.receive(&mut |_, _| {}), Ok(false));
    }
    topic
        .loan::<ScanInPlace>()
        .expect("a loan")
        .send()
        .expect("to be sent");
    let received = receive(&mut *subscribers[0], 1);
    assert_eq!(
        received[0].0.sequence, 11,
        "five of each kind were sent before"
    );
}

/// Replies in place and in CDR, read in place and copied, and both kinds of failure.
pub fn replies_are_written_in_place(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Laser");
    // A request: the number of beams, and whether to reply in place. -1 raises an exception, too
    // many beams an error.
    let handler = |header: Header, body: &[u8], reply: &mut dyn rc_middleware::Reply| {
        let mut request = Request::open(header, body, reply).expect("an envelope");
        let read = |reader: &mut Reader<'_>| Ok((reader.get::<i32>()?, reader.get::<bool>()?));
        let (length, placed) = request.arguments(&SCAN, read).expect("arguments");
        if placed {
            let outcome = request.in_place(|scan: &mut ScanInPlace| {
                let length = usize::try_from(length).map_err(|_| BAD)?;
                match scan.resize_beams(length) {
                    Ok(beams) => beams.fill(7),
                    Err(_) => scan.number = -1,
                }
                Ok::<_, i32>(())
            });
            match outcome.expect("memory") {
                Ok(()) => {
                    let _ = request.finish_in_place();
                }
                Err(case) => {
                    request
                        .reply_with(case, |writer| writer.put(&case))
                        .expect("a reply");
                }
            }
        } else {
            let beams = vec![7_i16; usize::try_from(length).expect("a length")];
            request
                .reply_with(0, |writer| writer.put(&beams))
                .expect("a reply");
        }
        request.close();
    };
    network.serving_bare(&address, handler, || {
        let backend = network.join_bare("client");
        let port = network.client(&*backend, &address);
        let mut caller = TypedClient::new(port, LIMIT);
        let parameters = |length: i32, placed: bool| {
            move |writer: &mut Writer<'_>| {
                writer.put(&length);
                writer.put(&placed);
            }
        };
        for length in [0, 1, 1000, 1_000_000, 3] {
            let beams = vec![7_i16; length as usize];
            for placed in [true, false] {
                let read = caller.call_with(&SCAN, parameters(length, placed), |case, reader| {
                    assert_eq!(case, 0);
                    Ok::<_, CallError>(reader.in_place::<ScanInPlace>()?.beams().to_vec())
                });
                assert_eq!(read.as_ref(), Ok(&beams));
                let copied = caller.call_with(&SCAN, parameters(length, placed), |case, reader| {
                    assert_eq!(case, 0);
                    Ok::<_, CallError>(reader.value::<ScanInPlace>()?)
                });
                assert_eq!(copied.as_ref(), Ok(&beams));
            }
        }
        let thrown = caller.call_with(&SCAN, parameters(-1, true), |case, reader| {
            Ok::<_, CallError>((case, reader.get::<i32>()?))
        });
        assert_eq!(thrown, Ok((BAD, BAD)));
        let case = |case, _: &mut Reader<'_>| Ok::<_, CallError>(case);
        let refused = caller.call_with(&SCAN, parameters(1_000_001, true), case);
        assert!(
            matches!(&refused, Err(CallError::Refused(why)) if why.contains("Scan.number")),
            "{refused:?}"
        );
        assert_eq!(caller.call_with(&SCAN, parameters(2, true), case), Ok(0));
    });
}
