//! The identity beside a sample, in its inline quality of service: whole samples and samples in
//! many fragments, between participants with sockets of their own.

use rc_ddsc::{
    BEFORE_BODY, Domain, Event, Guid, Identity, Listener, Participant, Qos, Reader, Sample, Writer,
};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(30);

struct Quiet;

impl Listener for Quiet {
    fn event(&self, _event: Event) {}
}

/// Joins a domain as the process `number`. The fragments are small, so that samples have many.
/// `more` is further configuration.
fn join(domain: u16, number: u32, more: &str) -> (Domain, Participant) {
    let config = format!(
        "<Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
         <FragmentSize>1000B</FragmentSize></General>\
         <Discovery><ExternalDomainId>{domain}</ExternalDomainId></Discovery>{more}</Domain>"
    );
    let domain = Domain::new(number, &config).expect("a domain");
    let participant = domain.participant(b"").expect("a participant");
    (domain, participant)
}

/// The next sample of at least `size` bytes.
fn taken(reader: &Reader, size: usize) -> Sample {
    let begin = Instant::now();
    let mut found = None;
    while found.is_none() {
        assert!(begin.elapsed() < LIMIT, "nothing is received");
        let take = |sample: Sample| {
            if sample.len() >= size {
                found = Some(sample);
            }
        };
        reader.take(take).expect("samples");
        std::thread::sleep(Duration::from_millis(1));
    }
    found.expect("a sample")
}

/// A writer and a reader that have met, and the number of samples that were written for that.
fn met(here: &Participant, there: &Participant) -> (Writer, Reader, u64) {
    let topic = |participant: &Participant| participant.topic("t", "T").expect("a topic");
    let writer = here.writer(&topic(here), &Qos::LOSSLESS, Box::new(Quiet));
    let writer = writer.expect("a writer");
    let reader = there.reader(&topic(there), &Qos::LOSSLESS, Box::new(Quiet));
    let reader = reader.expect("a reader");
    let (begin, mut sequence, mut count) = (Instant::now(), 0, 0);
    while count == 0 {
        assert!(begin.elapsed() < LIMIT, "they do not meet");
        sequence += 1;
        writer.write(sequence, 1, b"early").expect("to write");
        std::thread::sleep(Duration::from_millis(20));
        count = reader.take(drop).expect("samples");
    }
    (writer, reader, sequence)
}

#[test]
fn an_identity_travels_beside_a_sample() {
    let ((_here, here), (_there, there)) = (join(97, 1, ""), join(97, 2, ""));
    let (writer, reader, mut sequence) = met(&here, &there);
    for (size, number) in [(100, 1), (5000, -7), (70_001, i64::MAX)] {
        let guid = *b"abcdefghijklmnop";
        let related = Identity { guid, number };
        sequence += 1;
        let written = writer.write_related(sequence, 1, &vec![7; size], related);
        written.expect("to write");
        assert_eq!(
            taken(&reader, size).related(),
            Some(related),
            "{size} bytes"
        );
        // A sample without an identity has none.
        sequence += 1;
        writer.write(sequence, 1, &vec![7; size]).expect("to write");
        assert_eq!(taken(&reader, size).related(), None);
    }
}

#[test]
fn a_lent_sample_arrives_with_what_stands_before_its_body() {
    let ((_here, here), (_there, there)) = (join(96, 5, ""), join(96, 6, ""));
    let (writer, reader, mut sequence) = met(&here, &there);
    for size in [101, 5000, 300_003] {
        for before in [0, 16] {
            let mut loan = writer.loan(size).expect("memory");
            assert_eq!(loan.bytes().len(), BEFORE_BODY + size);
            loan.memory().fill(1);
            loan.memory()[BEFORE_BODY..].fill(7);
            sequence += 1;
            let sent = writer.send(loan, (sequence, 1), before, None);
            sent.expect("to send");
            let mut sample = taken(&reader, size);
            let padding = (4 - size % 4) % 4;
            assert_eq!(sample[..4], [0, 1, 0, padding as u8]);
            let (head, body) = sample[4..].split_at(before);
            assert_eq!(
                (head, &body[..size]),
                (&vec![1; before][..], &vec![7; size][..])
            );
            assert_eq!(body.len(), size + padding);
            // Its only owner may put an envelope before it.
            let length = sample.len();
            let memory = sample.unique().expect("no other reader");
            assert_eq!(memory.len(), BEFORE_BODY - 4 + length);
            memory[..BEFORE_BODY].fill(9);
            assert_eq!(sample[..4], [9; 4]);
            assert_eq!(sample[4 + before..][..size], vec![7; size]);
        }
    }
    // One that is not sent is given back.
    drop(writer.loan(300_000).expect("memory"));
    let loan = writer.loan(8).expect("memory");
    let refused = writer.send(loan, (sequence, 1), 7, None);
    assert_eq!(refused, Err(rc_ddsc::Error::BAD_PARAMETER));
}

/// Bytes before the submessages of a packet that the library records (`PacketCaptureFile`): the
/// headers of IPv4 and UDP, and that of RTPS.
const HEADERS: usize = 20 + 8 + 20;

/// The submessages with user data of one writer in a recording: the flags, and the inline quality
/// of service with all that follows.
fn submessages(recording: &[u8], writer: &Guid) -> Vec<(u8, Vec<u8>)> {
    const DATA: u8 = 0x15;
    const DATA_FRAG: u8 = 0x16;
    let number = |bytes: &[u8]| {
        bytes
            .iter()
            .rev()
            .fold(0, |n, byte| n << 8 | usize::from(*byte))
    };
    let mut found = Vec::new();
    // The header of the file (24), then for each packet its own header (16), with its length.
    let mut packets = &recording[24..];
    while let Some((head, rest)) = packets.split_at_checked(16) {
        let (packet, rest) = rest.split_at(number(&head[8..12]));
        packets = rest;
        let is_ours = packet.len() > HEADERS && packet[HEADERS - 12..HEADERS] == writer[..12];
        let mut left = if is_ours { &packet[HEADERS..] } else { &[][..] };
        while left.len() >= 4 {
            let (kind, flags) = (left[0], left[1]);
            assert_eq!(flags & 1, 1, "little endian");
            let length = match number(&left[2..4]) {
                0 => left.len() - 4,
                length => length,
            };
            let (body, rest) = left[4..].split_at(length);
            left = rest;
            // Extra flags (2), distance from behind itself to the inline QoS (2), reader (4),
            // writer (4).
            if [DATA, DATA_FRAG].contains(&kind) && body[8..12] == writer[12..] {
                let distance = number(&body[2..4]);
                found.push((flags, body[4 + distance..].to_vec()));
            }
        }
    }
    found
}

/// Both numbers of the parameter are on the wire, in each fragment: RTPS 2.5 has 0x0083, and Fast
/// DDS reads 0x800f. A reader that misses the first fragment gets the identity with another one.
#[test]
fn each_submessage_carries_the_identity_as_rtps_and_fast_dds_write_it() {
    let name = format!("rc-ddsc-related-{}.pcap", std::process::id());
    let path = std::env::temp_dir().join(name);
    let file = path.display();
    let record = format!("<Tracing><PacketCaptureFile>{file}</PacketCaptureFile></Tracing>");
    let ((here_domain, here), (_there, there)) = (join(98, 3, &record), join(98, 4, ""));
    let (writer, reader, mut sequence) = met(&here, &there);
    let guid = writer.guid().expect("an identity");
    let related = Identity {
        guid: *b"abcdefghijklmnop",
        number: 0x0102_0304_0506_0708,
    };
    for size in [100, 70_001] {
        sequence += 1;
        let written = writer.write_related(sequence, 1, &vec![7; size], related);
        written.expect("to write");
        assert_eq!(taken(&reader, size).related(), Some(related));
    }
    // The library writes the rest of the recording when the domain ends.
    drop((writer, here, here_domain));
    let recording = std::fs::read(&path).expect("a recording");
    std::fs::remove_file(&path).expect("to remove it");
    let mut expected = Vec::new();
    for parameter in [0x0083_u16, 0x800f] {
        expected.extend(parameter.to_le_bytes());
        expected.extend(24_u16.to_le_bytes());
        expected.extend(related.guid);
        expected.extend(0x0102_0304_u32.to_le_bytes());
        expected.extend(0x0506_0708_u32.to_le_bytes());
    }
    // The sentinel.
    expected.extend([1, 0, 0, 0]);
    let all = submessages(&recording, &guid);
    // Samples without an identity have no inline QoS (flag 2).
    let (with, without): (Vec<_>, Vec<_>) = all.iter().partition(|(flags, _)| flags & 2 != 0);
    assert!(!without.is_empty());
    // One sample of one submessage, and one with a fragment in each of at least five packets.
    assert!(with.len() >= 6, "{} submessages", with.len());
    for (_, content) in with {
        assert_eq!(content.get(..expected.len()), Some(&expected[..]));
    }
}
