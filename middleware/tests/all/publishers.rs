//! Publishers over several middlewares, and what a publisher that lends memory is asked for.

use super::small::Pair;
use rc_middleware::typed::{Gate, Operation, TypedPublisher};
use rc_middleware::{
    Counter, Encoding, Header, LoanedSample, Publisher, Reader, SendError, fan_out, now,
};
use std::cell::RefCell;
use std::rc::Rc;

const OPERATION: Operation = Operation::one_way("pair", 1, 7);

/// The sent messages: the middleware, the header and the body of each.
type Sent = Rc<RefCell<Vec<(&'static str, Header, Vec<u8>)>>>;

/// A middleware in memory.
struct Port {
    name: &'static str,
    sent: Sent,
    lends: &'static [Encoding],
    fails: bool,
    peers: usize,
}

impl Publisher for Port {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let sample = (self.name, header, body.to_vec());
        self.sent.borrow_mut().push(sample);
        if self.fails {
            Err(broken(self.name))
        } else {
            Ok(())
        }
    }

    fn can_loan(&self, encoding: Encoding) -> bool {
        self.lends.contains(&encoding)
    }

    fn loan(&mut self, length: usize) -> Result<Box<dyn LoanedSample + '_>, SendError> {
        // Whole words, so that the memory is aligned.
        assert_eq!(length % 4, 0);
        Ok(Box::new(Memory {
            words: vec![u32::MAX; length / 4],
            port: self,
        }))
    }

    fn loan_image(&mut self, length: usize) -> Result<Option<Box<dyn LoanedSample>>, SendError> {
        if !self.can_loan(Encoding::Image) {
            return Ok(None);
        }
        Ok(Some(Box::new(Kept {
            bytes: vec![0; length],
            name: self.name,
            sent: self.sent.clone(),
        })))
    }

    fn senders(&self) -> Vec<u128> {
        vec![self.peers as u128]
    }

    fn peers(&self) -> usize {
        self.peers
    }
}

struct Memory<'p> {
    words: Vec<u32>,
    port: &'p mut Port,
}

impl LoanedSample for Memory<'_> {
    fn memory(&self) -> &[u8] {
        rc_middleware::in_place::IntoBytes::as_bytes(self.words.as_slice())
    }

    fn memory_mut(&mut self) -> &mut [u8] {
        rc_middleware::in_place::IntoBytes::as_mut_bytes(self.words.as_mut_slice())
    }

    fn send(self: Box<Self>, header: Header) -> Result<(), SendError> {
        let Self { words, port } = *self;
        let body = rc_middleware::in_place::IntoBytes::as_bytes(words.as_slice()).to_vec();
        port.publish(header, &body)
    }
}

/// An image that does not borrow its publisher.
struct Kept {
    bytes: Vec<u8>,
    name: &'static str,
    sent: Sent,
}

impl LoanedSample for Kept {
    fn memory(&self) -> &[u8] {
        &self.bytes
    }

    fn memory_mut(&mut self) -> &mut [u8] {
        &mut self.bytes
    }

    fn send(self: Box<Self>, header: Header) -> Result<(), SendError> {
        let sample = (self.name, header, self.bytes);
        self.sent.borrow_mut().push(sample);
        Ok(())
    }
}

/// A middleware that leaves everything to the defaults of the trait.
struct Plain;

impl Publisher for Plain {
    fn publish(&mut self, _: Header, _: &[u8]) -> Result<(), SendError> {
        Ok(())
    }

    fn peers(&self) -> usize {
        0
    }
}

fn broken(name: &str) -> SendError {
    SendError::Backend {
        address: name.to_owned(),
        reason: "broken".to_owned(),
    }
}

const BOTH: &[Encoding] = &[Encoding::Cdr, Encoding::Image];

/// The first port has one peer, the second one two, and so on.
fn over(ports: &[(&'static str, &'static [Encoding], bool)]) -> (Box<dyn Publisher>, Sent) {
    let sent = Sent::default();
    let ports = ports.iter().zip(1..).map(|(&(name, lends, fails), peers)| {
        let sent = sent.clone();
        Box::new(Port {
            name,
            sent,
            lends,
            fails,
            peers,
        }) as Box<dyn Publisher>
    });
    let ports = ports.map(|port| (port, Counter::default()));
    (fan_out::over(ports.collect()), sent)
}

/// The names of the middlewares, and that all carried the same.
fn carried(sent: &Sent) -> Vec<&'static str> {
    let sent = sent.take();
    for (_, header, body) in &sent {
        assert_eq!((header, body), (&sent[0].1, &sent[0].2));
    }
    sent.iter().map(|(name, ..)| *name).collect()
}

#[test]
fn a_sample_goes_over_all_middlewares_and_the_first_error_counts() {
    let (mut port, sent) = over(&[("a", &[], false), ("b", &[], true), ("c", &[], true)]);
    let header = Header {
        sequence: 5,
        ..Header::default()
    };
    assert_eq!(port.publish(header, b"body"), Err(broken("b")));
    assert_eq!(carried(&sent), ["a", "b", "c"]);
    assert_eq!((port.peers(), port.senders()), (6, vec![1, 2, 3]));
    let (mut port, sent) = over(&[("a", &[], false), ("b", &[], false)]);
    assert_eq!(port.publish(header, b"body"), Ok(()));
    assert_eq!(carried(&sent), ["a", "b"]);
}

#[test]
fn memory_is_lent_by_the_last_one_that_lends_and_copied_by_the_others() {
    use Encoding::{Cdr, Image};
    for (lends, expected, can) in [
        // In the order of sending: the lender is the last one.
        ([BOTH, BOTH, BOTH], ["a", "b", "c"], [true, true]),
        ([BOTH, BOTH, &[Cdr]], ["a", "c", "b"], [true, true]),
        ([&[Cdr], &[Cdr], &[]], ["a", "c", "b"], [true, false]),
        ([&[Image], &[], &[Cdr]], ["b", "c", "a"], [true, true]),
    ] {
        let ports = [
            ("a", lends[0], false),
            ("b", lends[1], false),
            ("c", lends[2], false),
        ];
        let (mut port, sent) = over(&ports);
        assert_eq!([port.can_loan(Cdr), port.can_loan(Image)], can);
        let mut loan = port.loan(8).expect("memory");
        loan.memory_mut().copy_from_slice(b"12345678");
        assert_eq!(loan.memory(), b"12345678");
        assert_eq!(loan.send(Header::default()), Ok(()));
        assert_eq!(carried(&sent), expected);
    }
    let (mut none, _) = over(&[("a", &[], false), ("b", &[], false)]);
    assert!(!none.can_loan(Cdr) && none.loan(8).is_err());
    // One alone is itself.
    let (one, sent) = over(&[("a", BOTH, false)]);
    assert!(one.can_loan(Image));
    assert_eq!((one.peers(), carried(&sent)), (1, vec![]));
}

#[test]
fn an_image_that_is_kept_goes_over_all_middlewares() {
    let ports = [("dds", &[][..], false), ("shared", BOTH, false)];
    let (port, sent) = over(&[ports[0], ports[1], ("own", BOTH, false)]);
    let mut topic = TypedPublisher::new(port, OPERATION);
    let loan = topic.loan_image(4).expect("memory");
    let mut loan = loan.expect("a middleware that lends images");
    // Others may be sent meanwhile.
    topic.publish_parts((&7_i32,)).expect("to be sent");
    assert_eq!(carried(&sent), ["dds", "shared", "own"]);
    loan.memory_mut().copy_from_slice(b"1234");
    let backwards = |image: &[u8]| Ok(image.iter().rev().copied().collect());
    topic.send_image(loan, &backwards).expect("to be sent");
    let sent = sent.take().into_iter();
    let sent: Vec<_> = sent
        .map(|(name, header, body)| (name, header.encoding, body, header.sequence))
        .collect();
    let expected = [
        ("shared", Encoding::Image, b"1234".to_vec(), 2),
        ("dds", Encoding::Cdr, b"4321".to_vec(), 2),
        ("own", Encoding::Image, b"1234".to_vec(), 2),
    ];
    assert_eq!(sent, expected);
    // None of these lends memory for images.
    let (port, _) = over(&[("dds", &[], false), ("ros2", &[], false)]);
    let none = TypedPublisher::new(port, OPERATION).loan_image(4);
    assert!(none.is_ok_and(|loan| loan.is_none()));
}

#[test]
fn a_failed_copy_of_lent_memory_is_reported() {
    for (fails, expected) in [
        ([true, false], "a"),
        ([false, true], "b"),
        ([true, true], "b"),
    ] {
        let (mut port, sent) = over(&[("a", BOTH, fails[0]), ("b", BOTH, fails[1])]);
        let sent_loan = port.loan(4).expect("memory").send(Header::default());
        assert_eq!(sent_loan, Err(broken(expected)));
        assert_eq!(carried(&sent), ["a", "b"]);
    }
}

#[test]
fn a_middleware_lends_nothing_unless_it_says_so() {
    let mut plain = Plain;
    for encoding in [Encoding::Cdr, Encoding::Image] {
        assert!(!plain.can_loan(encoding));
    }
    assert!(plain.loan(8).is_err());
    assert!(plain.loan_image(8).is_ok_and(|loan| loan.is_none()));
    assert!(plain.senders().is_empty());
}

#[test]
fn a_value_in_place_is_sent_with_its_header_or_not_at_all() {
    for (lends, encoding) in [(BOTH, Encoding::Image), (&[], Encoding::Cdr)] {
        let (port, sent) = over(&[("a", lends, false)]);
        let gate = Gate::default();
        let mut topic = TypedPublisher::new(port, OPERATION).behind(gate.clone());
        let begin = now();
        let mut loan = topic.loan::<Pair>().expect("memory");
        assert_eq!(loan.numbers, [0, 0], "its defaults");
        loan.numbers = [-5, 9];
        loan.send().expect("to be sent");
        let (_, header, body) = sent.borrow_mut().pop().expect("a sample");
        let mut reader = Reader::of(&body, header.encoding);
        assert_eq!(reader.value::<Pair>(), Ok(vec![-5, 9]));
        assert_eq!(
            (header.encoding, header.type_hash, header.sequence),
            (encoding, 7, 1)
        );
        assert!(begin <= header.sent && header.sent <= now());
        // A value outside its range takes no number.
        let mut loan = topic.loan::<Pair>().expect("memory");
        loan.numbers = [0, 10];
        loan.send().expect_err("it is out of range");
        drop(topic.loan::<Pair>().expect("memory"));
        gate.set_open(false);
        topic
            .loan::<Pair>()
            .expect("memory")
            .send()
            .expect("withheld");
        assert_eq!((topic.sent().get(), topic.withheld().get()), (1, 1));
        assert!(sent.borrow().is_empty());
    }
}

#[test]
fn what_goes_over_each_middleware_is_counted() {
    let counters = [Counter::default(), Counter::default()];
    let port = |name, lends, fails| {
        let (sent, peers) = (Sent::default(), 1);
        Box::new(Port {
            name,
            sent,
            lends,
            fails,
            peers,
        }) as Box<dyn Publisher>
    };
    let ports = vec![
        (port("a", &[], true), counters[0].clone()),
        (port("b", BOTH, false), counters[1].clone()),
    ];
    let mut port = fan_out::over(ports);
    let counts = || counters.each_ref().map(Counter::get);
    assert!(port.publish(Header::default(), b"body").is_err());
    assert_eq!(counts(), [0, 1]);
    let loan = port.loan(4).expect("memory");
    assert!(loan.send(Header::default()).is_err());
    assert_eq!(counts(), [0, 2]);
}

#[test]
fn a_middleware_without_images_gets_the_value_encoded() {
    let (port, sent) = over(&[("a", BOTH, false), ("b", &[], false), ("c", BOTH, false)]);
    let mut topic = TypedPublisher::new(port, OPERATION);
    let mut loan = topic.loan::<Pair>().expect("memory");
    loan.numbers = [-5, 9];
    loan.send().expect("to be sent");
    let sent = sent.take();
    let encodings: Vec<_> = sent
        .iter()
        .map(|(name, of, _)| (*name, of.encoding))
        .collect();
    let (image, cdr) = (Encoding::Image, Encoding::Cdr);
    assert_eq!(encodings, [("a", image), ("b", cdr), ("c", image)]);
    for (_, header, body) in sent {
        assert_eq!(header.sequence, 1);
        let mut reader = Reader::of(&body, header.encoding);
        assert_eq!(reader.value::<Pair>(), Ok(vec![-5, 9]));
    }
}
