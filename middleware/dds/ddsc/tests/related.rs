//! The identity beside a sample, in its inline quality of service: whole samples and samples in many
//! fragments, between participants with sockets of their own.

use rc_ddsc::{Domain, Event, Identity, Listener, Participant, Qos, Reader};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(30);
const DOMAIN: u16 = 97;

struct Quiet;

impl Listener for Quiet {
    fn event(&self, _event: Event) {}
}

/// Joins the domain. The fragments are small, so that samples have many.
fn join(number: u32) -> (Domain, Participant) {
    let config = format!(
        "<Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
         <FragmentSize>1000B</FragmentSize></General>\
         <Discovery><ExternalDomainId>{DOMAIN}</ExternalDomainId></Discovery></Domain>"
    );
    let domain = Domain::new(number, &config).expect("a domain");
    let participant = domain.participant(b"").expect("a participant");
    (domain, participant)
}

fn qos() -> Qos<'static> {
    Qos {
        reliable: true,
        ..Qos::default()
    }
}

/// The identity beside the next sample of at least `size` bytes.
fn taken(reader: &Reader, size: usize) -> Option<Identity> {
    let begin = Instant::now();
    let mut found = None;
    while found.is_none() {
        assert!(begin.elapsed() < LIMIT, "nothing is received");
        let take = |sample: rc_ddsc::Sample| {
            if sample.len() >= size {
                found = Some(sample.related());
            }
        };
        reader.take(take).expect("samples");
        std::thread::sleep(Duration::from_millis(1));
    }
    found.flatten()
}

#[test]
fn an_identity_travels_beside_a_sample() {
    let ((_here, here), (_there, there)) = (join(1), join(2));
    let topic = |participant: &Participant| participant.topic("t", "T").expect("a topic");
    let writer = here.writer(&topic(&here), &qos(), Box::new(Quiet));
    let writer = writer.expect("a writer");
    let reader = there.reader(&topic(&there), &qos(), Box::new(Quiet));
    let reader = reader.expect("a reader");
    let (begin, mut sequence, mut count) = (Instant::now(), 0, 0);
    while count == 0 {
        assert!(begin.elapsed() < LIMIT, "they do not meet");
        sequence += 1;
        writer.write(sequence, 1, b"early").expect("to write");
        std::thread::sleep(Duration::from_millis(20));
        count = reader.take(drop).expect("samples");
    }
    for (size, number) in [(100, 1), (5000, -7), (70_001, i64::MAX)] {
        let guid = *b"abcdefghijklmnop";
        let related = Identity { guid, number };
        sequence += 1;
        let written = writer.write_related(sequence, 1, &vec![7; size], related);
        written.expect("to write");
        assert_eq!(taken(&reader, size), Some(related), "{size} bytes");
        // A sample without an identity has none.
        sequence += 1;
        writer.write(sequence, 1, &vec![7; size]).expect("to write");
        assert_eq!(taken(&reader, size), None);
    }
}
