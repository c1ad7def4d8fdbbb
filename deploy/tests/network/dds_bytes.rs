//! Whatever bytes come from the network are counted, told at most once a second, and change nothing.

use crate::dds::Domain;
use crate::site::Site;
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
/// So many are under way at most: fewer than a component keeps, so that it has to count each.
const AT_ONCE: usize = 200;
/// For everything that is waited for.
const LIMIT: Duration = Duration::from_secs(20);
/// What the allocator and the library may keep.
const FLAT: u64 = 2 << 20;

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
struct Ear(Mutex<Sender<Event>>);

impl Listener for Ear {
    fn event(&self, event: Event) {
        let _ = self.0.lock().expect("nobody panics here").send(event);
    }
}

/// A program on the C calls alone.
struct Attacker {
    member: Participant,
    _domain: rc_ddsc::Domain,
    network: String,
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
        let network = domain.site.network.clone();
        // What the component's complaints look like here is not of interest.
        rc_ddsc::set_log(|_, _| {});
        let domain = rc_ddsc::Domain::new(domain.id, &config).expect("the domain");
        let member = domain.participant().expect("a participant");
        Self {
            member,
            _domain: domain,
            network,
        }
    }

    /// An end that has met another one, and what happens to it.
    fn end<T>(
        &self,
        (topic, kind): (&str, &str),
        open: impl FnOnce(&rc_ddsc::Topic, &Qos<'_>, Box<dyn Listener>) -> Result<T, rc_ddsc::Error>,
    ) -> (T, std::sync::mpsc::Receiver<Event>) {
        let topic = format!("{}/{topic}", self.network);
        let topic = self.member.topic(&topic, &format!("RcHerald::{kind}"));
        let qos = Qos {
            reliable: true,
            ..Qos::default()
        };
        let (tell, events) = channel();
        let ear = Box::new(Ear(Mutex::new(tell)));
        let end = open(&topic.expect("a topic"), &qos, ear).expect("an end");
        while !matches!(
            events.recv_timeout(LIMIT).expect("another end"),
            Event::Matched(_)
        ) {}
        (end, events)
    }

    fn writer(&self, topic: (&str, &str)) -> Writer {
        self.end(topic, |topic, qos, ear| self.member.writer(topic, qos, ear))
            .0
    }

    fn reader(&self, topic: (&str, &str)) -> (Reader, std::sync::mpsc::Receiver<Event>) {
        self.end(topic, |topic, qos, ear| self.member.reader(topic, qos, ear))
    }
}

/// Sends these bytes as a sample.
fn send(writer: &Writer, bytes: &[u8]) {
    writer.write_raw(1, 0, bytes).expect("to write");
}

fn arrived(writer: &Writer) {
    writer.wait_for_acks(LIMIT).expect("all of it arrives");
}

/// The body of a right report.
fn report(number: i64) -> Vec<u8> {
    let mut writer = rc_middleware::Writer::default();
    writer.put(&number);
    writer.put(&"right".to_owned());
    writer.put(&vec![0.5, 1.5]);
    writer.put(&7_i32);
    writer.put(&1.5_f32);
    writer.put(&2.5_f64);
    writer.put(&1_u32);
    writer.put(&"mark".to_owned());
    writer.put(&0.5_f32);
    writer.put(&0.25_f64);
    writer.into_bytes()
}

/// The body of a request that notes something.
fn note(number: u32, text: &str) -> Vec<u8> {
    let mut writer = rc_middleware::Writer::default();
    let id = rc_middleware::rpc::RequestId {
        writer: [7; 16],
        sequence: number.into(),
    };
    rc_middleware::rpc::begin_request(&mut writer, id, -900_475_222);
    writer.put(&text.to_owned());
    writer.into_bytes()
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

#[test]
fn bytes_that_are_none_change_nothing() {
    let domain = Domain::new("dds_bytes", 224);
    let herald = domain.herald(&[]);
    let begin = Instant::now();
    let random = &mut Random(0x9e37_79b9_7f4a_7c15);
    let attacker = Attacker::new(&domain);
    let reports = attacker.writer(("Reports/report", "Reports_report"));
    let (_replies, _) = attacker.reader(("Herald_Reply", "Herald_Reply"));
    let requests = attacker.writer(("Herald_Request", "Herald_Request"));
    let answers = attacker.writer(("Oracle_Reply", "Oracle_Reply"));
    let (report, note) = (report(1), note(1, "never"));
    // `sent` samples to a slot, each of which is counted as an error.
    let mut flood = |writer: &Writer, slot: &str, sent: usize, right: &[u8], other: &[u8]| {
        let counted = || domain.slot(slot)["handlers"]["errors"].as_u64();
        let before = counted().expect("a number");
        for from in (0..sent).step_by(AT_ONCE) {
            for _ in from..sent.min(from + AT_ONCE) {
                send(writer, &random.sample(right, other));
            }
            let all = before + sent.min(from + AT_ONCE) as u64;
            Site::until("each is counted", || counted() == Some(all));
        }
    };
    let mut all = |part: usize| {
        flood(&reports, "Reports", REPORTS / part, &report, &note);
        flood(&requests, "Herald", REQUESTS / part, &note, &report);
    };
    // Half of it first, for what is reserved once.
    all(2);
    let before = memory(herald.pid());
    all(2);
    for _ in 0..REPLIES {
        send(&answers, &random.sample(&note, &report));
    }
    arrived(&answers);
    for slot in ["Reports", "Herald", "Orders"] {
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
        let writer = attacker.writer(("Reports/report", "Reports_report"));
        send(&writer, bytes);
    }
    // What is not even a sample, as if it came from somebody who is known.
    let known = attacker.member.guid().expect("its identity");
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a socket");
    let ports = ports(herald.pid());
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

    let after = memory(herald.pid());
    let seconds = begin.elapsed().as_secs() as usize;
    assert!(
        after < before + FLAT,
        "{before} bytes before, {after} bytes after"
    );
    let log = herald.log();
    // Each of two ports and the backend complain for themselves.
    let told = log.lines().count();
    assert!(told > 0 && told <= 4 * (seconds + 2), "{seconds} s: {log}");

    assert!(log.contains("Oracle` sent what is no reply"), "{log}");

    // Who comes now is heard.
    drop((reports, requests, answers, attacker));
    let attacker = Attacker::new(&domain);
    let (echoes, events) = attacker.reader(("Echoes/echo", "Echoes_echo"));
    let reports = attacker.writer(("Reports/report", "Reports_report"));
    send(&reports, &[&[0, 1, 0, 0], &report[..]].concat());
    let mut echoed = Vec::new();
    while echoed.is_empty() {
        events.recv_timeout(LIMIT).expect("an echo");
        echoes
            .take(|echo| echoed.push(echo[4..].to_vec()))
            .expect("to take");
    }
    assert_eq!(echoed, [report]);
    let slot = domain.slot("Reports");
    let handlers = &slot["handlers"];
    let (count, errors) = (handlers["count"].as_u64(), handlers["errors"].as_u64());
    assert_eq!(count, errors.map(|errors| errors + 1), "{slot}");
    assert_eq!(domain.slot("Orders")["handlers"]["count"], 0);
}
