//! Whatever bytes come from the network are counted, told at most once a second, and change nothing: what the tests of
//! DDS and of ROS 2 share. Who attacks is a program on the C calls of Cyclone DDS alone.

use crate::network::dds::Domain;
use crate::network::site::Site;
use rc_ddsc::{Event, Listener, Participant, Qos, Reader, Writer};
use std::net::{Ipv4Addr, UdpSocket};
use std::sync::Mutex;
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

/// So many samples are no sample, in all.
const REPORTS: usize = 50_000;
const REQUESTS: usize = 30_000;
const REPLIES: usize = 20_000;
/// So many packets are no packet of RTPS, or a spoilt one, to each socket of the component.
const PACKETS: usize = 5_000;
/// For everything that is waited for.
const LIMIT: Duration = Duration::from_secs(20);

/// A topic and its type.
pub(crate) type Topic = (String, String);

/// What is attacked.
pub(crate) struct Target {
    /// What the component repeats, and where.
    pub(crate) reports: Topic,
    pub(crate) echoes: Topic,
    /// What it is asked, at this slot, and what it answers.
    pub(crate) slot: &'static str,
    pub(crate) requests: Topic,
    pub(crate) replies: Topic,
    /// What its oracle answers.
    pub(crate) answers: Topic,
    /// A right report and a right request, as bodies.
    pub(crate) report: Vec<u8>,
    pub(crate) request: Vec<u8>,
    /// So many samples are under way at most: fewer than a component keeps, so that it has to count each.
    pub(crate) at_once: usize,
    /// So often half of all is sent before it is looked how much memory there is.
    pub(crate) warm_up: usize,
    /// What the allocator and the library may keep.
    pub(crate) flat: u64,
}

/// The same numbers every time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }

    fn bytes(&mut self, length: usize) -> Vec<u8> {
        (0..length).map(|_| self.next() as u8).collect()
    }

    /// A sample that is none of those that `right` is one of; it has an encapsulation, which may be wrong.
    fn sample(&mut self, right: &[u8], other: &[u8]) -> Vec<u8> {
        const CDR: [u8; 4] = [0, 1, 0, 0];
        let behind = |head: [u8; 4], body: &[u8]| [&head[..], body].concat();
        match self.below(10) {
            // Truncated, by more than the library fills up again with zeros.
            0..3 => behind(CDR, &right[..self.below(right.len() - 3)]),
            // A length that goes beyond the end; the first one of each is within its first 32 bytes.
            3..5 => {
                let mut body = right.to_vec();
                for at in (0..body.len().min(32)).step_by(4) {
                    body[at..at + 4].copy_from_slice(&0xffff_fff0_u32.to_le_bytes());
                }
                behind(CDR, &body)
            }
            // Of another type.
            5 => behind(CDR, other),
            6 | 7 => {
                let length = self.below(300);
                behind(CDR, &self.bytes(length))
            }
            // Another representation: big endian, parameter lists, XCDR2.
            8 => {
                let kind = [0, 2, 3, 6, 7, 8, 9][self.below(7)];
                behind([0, kind, 0, self.next() as u8], right)
            }
            // Large enough for several fragments, seldom.
            _ if self.below(100) == 0 => {
                let length = 65_000 + self.below(200_000);
                behind(CDR, &self.bytes(length))
            }
            _ => {
                let length = 4 + self.below(100);
                behind(CDR, &self.bytes(length)[4..])
            }
        }
    }

    /// A packet that begins as one of RTPS, from `prefix`; what is in it is seldom right.
    fn packet(&mut self, prefix: &[u8]) -> Vec<u8> {
        // RTPS 2.5, 9.4.5: what is told of data, of fragments, of what is there, of what is missing.
        const KINDS: [u8; 12] = [
            0x01, 0x06, 0x07, 0x08, 0x09, 0x0c, 0x0e, 0x12, 0x13, 0x15, 0x16, 0x80,
        ];
        if self.below(4) == 0 {
            let length = self.below(1400);
            return self.bytes(length);
        }
        let mut packet = b"RTPS\x02\x05\x01\x10".to_vec();
        packet.extend_from_slice(&prefix[..12]);
        for _ in 0..=self.below(4) {
            let kind = KINDS[self.below(KINDS.len())];
            let length = self.below(80);
            // Now and then the length is a lie.
            let told = if self.below(5) == 0 {
                self.next() as u16
            } else {
                length as u16
            };
            packet.extend_from_slice(&[kind, self.next() as u8 | 1]);
            packet.extend_from_slice(&told.to_le_bytes());
            packet.extend(self.bytes(length));
        }
        packet
    }
}

/// Tells that something happened.
struct EventSender(Mutex<Sender<Event>>);

impl Listener for EventSender {
    fn event(&self, event: Event) {
        let _ = self.0.lock().expect("nobody panics here").send(event);
    }
}

/// A program on the C calls alone.
struct Attacker {
    member: Participant,
    _domain: rc_ddsc::Domain,
}

impl Attacker {
    fn new(domain: &Domain) -> Self {
        let config = format!(
            "<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>\
             <Discovery><ExternalDomainId>{}</ExternalDomainId></Discovery>\
             <Internal><Watermarks><WhcAdaptive>false</WhcAdaptive><WhcHighInit>1GiB</WhcHighInit>\
             <WhcHigh>1GiB</WhcHigh></Watermarks></Internal>",
            domain.id
        );
        // What the component's complaints look like here is not of interest.
        rc_ddsc::set_log(|_, _| {});
        let domain = rc_ddsc::Domain::new(domain.id, &config).expect("the domain");
        let member = domain.participant(b"").expect("a participant");
        Self {
            member,
            _domain: domain,
        }
    }

    /// An end that has met another one, and what happens to it.
    fn end<T>(
        &self,
        (topic, kind): &Topic,
        open: impl FnOnce(&rc_ddsc::Topic, &Qos<'_>, Box<dyn Listener>) -> Result<T, rc_ddsc::Error>,
    ) -> (T, std::sync::mpsc::Receiver<Event>) {
        let topic = self.member.topic(topic, kind);
        let qos = Qos {
            reliable: true,
            ..Qos::default()
        };
        let (tell, events) = channel();
        let listener = Box::new(EventSender(Mutex::new(tell)));
        let end = open(&topic.expect("a topic"), &qos, listener).expect("an end");
        while !matches!(
            events.recv_timeout(LIMIT).expect("another end"),
            Event::Matched(_)
        ) {}
        (end, events)
    }

    fn writer(&self, topic: &Topic) -> Writer {
        self.end(topic, |topic, qos, listener| {
            self.member.writer(topic, qos, listener)
        })
        .0
    }

    fn reader(&self, topic: &Topic) -> (Reader, std::sync::mpsc::Receiver<Event>) {
        self.end(topic, |topic, qos, listener| {
            self.member.reader(topic, qos, listener)
        })
    }
}

/// Sends these bytes as a sample.
fn send(writer: &Writer, bytes: &[u8]) {
    writer.write_raw(1, 0, bytes).expect("to write");
}

fn arrived(writer: &Writer) {
    writer.wait_for_acks(LIMIT).expect("all of it arrives");
}

/// The memory of a process that it has written to.
fn memory(pid: rustix::process::Pid) -> u64 {
    let path = format!("/proc/{}/smaps_rollup", pid.as_raw_nonzero());
    let text = std::fs::read_to_string(path).expect("its memory");
    let line = text.lines().find_map(|line| line.strip_prefix("Pss_Anon:"));
    let number = line.and_then(|line| line.trim().strip_suffix(" kB"));
    1024 * number
        .and_then(|n| n.parse::<u64>().ok())
        .expect("a number")
}

/// The UDP ports of a process.
fn ports(pid: rustix::process::Pid) -> Vec<u16> {
    let pid = pid.as_raw_nonzero();
    let folder = std::fs::read_dir(format!("/proc/{pid}/fd")).expect("its descriptors");
    let sockets: Vec<String> = folder
        .filter_map(|entry| std::fs::read_link(entry.ok()?.path()).ok())
        .filter_map(|link| {
            let link = link.to_string_lossy().into_owned();
            Some(link.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned())
        })
        .collect();
    let table = std::fs::read_to_string(format!("/proc/{pid}/net/udp")).expect("all sockets");
    let port = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (_, port) = words.get(1)?.split_once(':')?;
        let inode = (*words.get(9)?).to_owned();
        sockets.contains(&inode).then_some(())?;
        u16::from_str_radix(port, 16).ok()
    };
    let mut ports: Vec<u16> = table.lines().filter_map(port).collect();
    ports.sort_unstable();
    ports.dedup();
    ports
}

/// How long to attack at least, half of it before memory is compared: `RC_ATTACK_SECONDS`, for people who want to see that
/// it levels off. Then it is told all the time.
fn lasting() -> Duration {
    let seconds = std::env::var("RC_ATTACK_SECONDS").ok();
    let seconds = seconds.and_then(|text| text.parse().ok());
    seconds.map_or(Duration::ZERO, Duration::from_secs)
}

/// Attacks the component of `domain`.
pub(crate) fn change_nothing(domain: &Domain, settings: &[&str], target: &Target) {
    let component = domain.start(settings);
    let begin = Instant::now();
    let random = &mut Random(0x9e37_79b9_7f4a_7c15);
    let attacker = Attacker::new(domain);
    let reports = attacker.writer(&target.reports);
    let (_replies, _) = attacker.reader(&target.replies);
    let requests = attacker.writer(&target.requests);
    let answers = attacker.writer(&target.answers);
    let (report, note) = (&target.report, &target.request);
    // `sent` samples to a slot, each of which is counted as an error.
    let flood = |random: &mut Random,
                 writer: &Writer,
                 slot: &str,
                 sent: usize,
                 right: &[u8],
                 other: &[u8]| {
        let counted = || domain.slot(slot)["handlers"]["errors"].as_u64();
        let before = counted().expect("a number");
        for from in (0..sent).step_by(target.at_once) {
            for _ in from..sent.min(from + target.at_once) {
                send(writer, &random.sample(right, other));
            }
            let all = before + sent.min(from + target.at_once) as u64;
            Site::until("each is counted", || counted() == Some(all));
        }
    };
    let mut half = || {
        flood(random, &reports, "Reports", REPORTS / 2, report, note);
        flood(random, &requests, target.slot, REQUESTS / 2, note, report);
        for _ in 0..REPLIES / 2 {
            send(&answers, &random.sample(note, report));
        }
        arrived(&answers);
    };
    let lasting = lasting();
    let mut attack = |least: usize| {
        let begin = Instant::now();
        let mut halves = 0;
        while halves < least || begin.elapsed() < lasting / 2 {
            half();
            halves += 1;
            if !lasting.is_zero() {
                let (seconds, kib) = (begin.elapsed().as_secs(), memory(component.pid()) >> 10);
                eprintln!("{seconds:5} s {kib:8} KiB");
            }
        }
    };
    // For what is reserved once.
    attack(target.warm_up);
    let before = memory(component.pid());
    attack(1);
    for slot in ["Reports", target.slot, "Orders"] {
        let slot = domain.slot(slot);
        assert_eq!(slot["lost"], 0, "an error is not a loss as well: {slot}");
        assert_eq!(
            slot["handlers"]["count"], slot["handlers"]["errors"],
            "{slot}"
        );
    }

    // What has no room for an encapsulation or none that exists, each by a writer of its own: the library lets nothing
    // pass behind it.
    for bytes in [&[][..], &[0], &[0, 1], &[0, 1, 0], &[0xff; 64]] {
        let writer = attacker.writer(&target.reports);
        send(&writer, bytes);
    }
    // What is not even a sample, as if it came from somebody who is known.
    let known = attacker.member.guid().expect("its identity");
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a socket");
    let ports = ports(component.pid());
    assert!(ports.len() > 1, "{ports:?}");
    for number in 0..PACKETS {
        for port in &ports {
            let stranger = random.bytes(16);
            let from = if number % 2 == 0 {
                &known[..]
            } else {
                &stranger
            };
            let packet = random.packet(from);
            // A full queue is no error of this test.
            let _ = socket.send_to(&packet, (Ipv4Addr::LOCALHOST, *port));
        }
    }

    let after = memory(component.pid());
    let seconds = begin.elapsed().as_secs() as usize;
    assert!(
        after < before + target.flat,
        "{before} bytes before, {after} bytes after"
    );
    let log = component.log();
    // Each of two ports and the backend complain for themselves.
    let told = log.lines().count();
    assert!(told > 0 && told <= 4 * (seconds + 2), "{seconds} s: {log}");

    assert!(
        log.contains("Oracle` sent a sample that is no reply"),
        "{log}"
    );

    // Who comes now is heard.
    drop((reports, requests, answers, attacker));
    let attacker = Attacker::new(domain);
    let (echoes, events) = attacker.reader(&target.echoes);
    let reports = attacker.writer(&target.reports);
    send(&reports, &[&[0, 1, 0, 0], &report[..]].concat());
    let mut echoed = Vec::new();
    while echoed.is_empty() {
        events.recv_timeout(LIMIT).expect("an echo");
        echoes
            .take(|echo| echoed.push(echo[4..].to_vec()))
            .expect("to take");
    }
    assert_eq!(echoed, std::slice::from_ref(report));
    // It is counted when its handler has ended, which is after the echo.
    Site::until("just this one is no error", || {
        let handlers = &domain.slot("Reports")["handlers"];
        let (count, errors) = (handlers["count"].as_u64(), handlers["errors"].as_u64());
        count == errors.map(|errors| errors + 1)
    });
    assert_eq!(domain.slot("Orders")["handlers"]["count"], 0);
}
