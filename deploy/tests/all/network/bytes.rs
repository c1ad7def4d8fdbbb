//! The attacks of the tests over DDS and ROS 2: invalid samples and packets are counted, logged at
//! most once a second, and change nothing. The attacker uses the C functions of Cyclone DDS.

use crate::network::dds::Domain;
use rc_ddsc::{Event, Listener, Participant, Qos, Reader, Writer};
use rc_test_site::site::Site;
use std::net::{Ipv4Addr, UdpSocket};
use std::sync::Mutex;
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

/// Number of invalid samples.
const REPORTS: usize = 50_000;
const REQUESTS: usize = 30_000;
const REPLIES: usize = 20_000;
/// Number of invalid packets to each socket of the component.
const PACKETS: usize = 5_000;
/// Longest wait for an event.
const LIMIT: Duration = Duration::from_secs(20);

/// A topic and its type.
pub(crate) type Topic = (String, String);

/// The component under attack.
pub(crate) struct Target {
    /// The topics that the component receives from and publishes on.
    pub(crate) reports: Topic,
    pub(crate) echoes: Topic,
    /// A slot of the component, with the topics of its requests and replies.
    pub(crate) slot: &'static str,
    pub(crate) requests: Topic,
    pub(crate) replies: Topic,
    /// The topic of replies to the component.
    pub(crate) answers: Topic,
    /// The bodies of a valid report and a valid request.
    pub(crate) report: Vec<u8>,
    pub(crate) request: Vec<u8>,
    /// Most samples under way: fewer than a queue holds, so that the component counts each.
    pub(crate) at_once: usize,
    /// Rounds of half of the samples before memory is compared.
    pub(crate) warm_up: usize,
    /// Largest growth of memory in bytes: reserves of the allocator and the library.
    pub(crate) flat: u64,
}

/// Pseudo-random numbers with a fixed seed.
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

    /// An invalid sample, made from the valid `right` or from `other`. Its encapsulation may be
    /// wrong.
    fn sample(&mut self, right: &[u8], other: &[u8]) -> Vec<u8> {
        const CDR: [u8; 4] = [0, 1, 0, 0];
        let behind = |head: [u8; 4], body: &[u8]| [&head[..], body].concat();
        match self.below(10) {
            // Truncated, by more than the padding that the library adds.
            0..3 => behind(CDR, &right[..self.below(right.len() - 3)]),
            // A length beyond the end. The first length of each is in its first 32 bytes.
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
            // Rarely, a sample of several fragments.
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

    /// A packet with the header of RTPS, from the participant `prefix`, and mostly invalid
    /// contents.
    fn packet(&mut self, prefix: &[u8]) -> Vec<u8> {
        // RTPS 2.5, 9.4.5: DATA, DATA_FRAG, HEARTBEAT, ACKNACK, GAP and others.
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
            // Sometimes the length is wrong.
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

/// Forwards events.
struct EventSender(Mutex<Sender<Event>>);

impl Listener for EventSender {
    fn event(&self, event: Event) {
        let _ = self.0.lock().expect("no holder panics").send(event);
    }
}

/// The attacker.
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
        // Messages of the library about this process are not tested.
        rc_ddsc::set_log(|_, _| {});
        let domain = rc_ddsc::Domain::new(domain.id, &config).expect("the domain");
        let member = domain.participant(b"").expect("a participant");
        Self {
            member,
            _domain: domain,
        }
    }

    /// An endpoint that has matched a peer, and its events.
    fn end<T>(
        &self,
        (topic, kind): &Topic,
        open: impl FnOnce(&rc_ddsc::Topic, &Qos<'_>, Box<dyn Listener>) -> Result<T, rc_ddsc::Error>,
    ) -> (T, std::sync::mpsc::Receiver<Event>) {
        let topic = self.member.topic(topic, kind);
        let (tell, events) = channel();
        let listener = Box::new(EventSender(Mutex::new(tell)));
        let end = open(&topic.expect("a topic"), &Qos::LOSSLESS, listener).expect("an end");
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

/// Writes `bytes` as a sample.
fn send(writer: &Writer, bytes: &[u8]) {
    writer.write_raw(1, 0, bytes).expect("to write");
}

fn arrived(writer: &Writer) {
    writer.wait_for_acks(LIMIT).expect("all of it arrives");
}

/// The private memory of a process, in bytes.
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

/// Shortest attack, from `RC_ATTACK_SECONDS`: half of it before memory is compared. A long attack
/// prints the memory, to show that growth ends.
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
    // Warm-up: buffers are reserved once.
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

    // Samples without a valid encapsulation, each by a writer of its own: the library drops later
    // samples of that writer.
    for bytes in [&[][..], &[0], &[0, 1], &[0, 1, 0], &[0xff; 64]] {
        let writer = attacker.writer(&target.reports);
        send(&writer, bytes);
    }
    // Invalid packets with the identity of a known participant.
    let known = attacker.member.guid().expect("its identity");
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a socket");
    let ports = ports(component.pid());
    assert!(ports.len() > 1, "{ports:?}");
    for number in 0..PACKETS {
        for port in &ports {
            let peer = random.bytes(16);
            let from = if number % 2 == 0 { &known[..] } else { &peer };
            let packet = random.packet(from);
            // A full socket buffer is not an error here.
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
    // Two ports and the backend each log on their own.
    let told = log.lines().count();
    assert!(told > 0 && told <= 4 * (seconds + 2), "{seconds} s: {log}");

    assert!(
        log.contains("Oracle` sent a sample that is not a reply"),
        "{log}"
    );

    // A new publisher is received.
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
    // The count changes at the end of the handler, after the echo.
    Site::until("just this one is not an error", || {
        let handlers = &domain.slot("Reports")["handlers"];
        let (count, errors) = (handlers["count"].as_u64(), handlers["errors"].as_u64());
        count == errors.map(|errors| errors + 1)
    });
    assert_eq!(domain.slot("Orders")["handlers"]["count"], 0);
}
