//! A hostile peer of DDS: it sends what no participant sends to the ports of the components.
//!
//! Some of its messages announce participants that do not exist and are silent afterwards, so that
//! each costs memory and heartbeats until its lease ends. The others are damaged announcements, and
//! submessages of random bytes.

use super::Dice;
use std::io;
use std::net::{Ipv4Addr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// The domain of the attacked components.
pub(super) const DOMAIN: u16 = 97;
/// How many messages are sent at once, and the pause afterwards.
const BURST: usize = 10;
const PAUSE: Duration = Duration::from_millis(20);
/// How many participants of the domain are attacked.
const PARTICIPANTS: u16 = 2;
/// After this many seconds of silence a participant that was announced counts as dead.
const LEASE: u32 = 2;

/// The kinds of submessages, of section 9.4.5 of the RTPS specification.
const KINDS: [u8; 12] = [
    0x01, 0x06, 0x07, 0x08, 0x09, 0x0c, 0x0d, 0x0e, 0x0f, 0x12, 0x15, 0x16,
];
/// The longest body of a random submessage.
const BODY: usize = 1200;

/// The peer. It ends when it is dropped.
pub(super) struct Hostile {
    sent: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Hostile {
    /// Starts to send. The seed determines the messages.
    pub(super) fn start(seed: u64) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        socket.set_nonblocking(true)?;
        let (sent, stop) = (Arc::<AtomicU64>::default(), Arc::<AtomicBool>::default());
        let (count, stopped) = (Arc::clone(&sent), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let mut dice = Dice(seed);
            let ports = ports();
            while !stopped.load(Ordering::Relaxed) {
                for _ in 0..BURST {
                    let port = ports[dice.below(ports.len())];
                    let message = message(&mut dice);
                    // A component that is down at the moment has no port.
                    if socket
                        .send_to(&message, (Ipv4Addr::LOCALHOST, port))
                        .is_ok()
                    {
                        count.fetch_add(1, Ordering::Relaxed);
                    }
                }
                std::thread::sleep(PAUSE);
            }
        });
        Ok(Self {
            sent,
            stop,
            thread: Some(thread),
        })
    }

    /// How many messages were sent.
    pub(super) fn sent(&self) -> u64 {
        self.sent.load(Ordering::Relaxed)
    }
}

impl Drop for Hostile {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The unicast ports of discovery and of data: section 9.6.2.1 of the RTPS specification.
fn ports() -> Vec<u16> {
    let first = 7400 + 250 * DOMAIN;
    let each = (0..PARTICIPANTS).map(|participant| 2 * participant);
    each.flat_map(|offset| [first + 10 + offset, first + 11 + offset])
        .collect()
}

fn message(dice: &mut Dice) -> Vec<u8> {
    let mut prefix = [0; 12];
    prefix[..8].copy_from_slice(&dice.next().to_le_bytes());
    let mut message = header(prefix);
    match dice.below(100) {
        // More would be a test of the processor: each is answered by a discovery of its endpoints.
        0..2 => announcement(&mut message, prefix),
        2..50 => {
            announcement(&mut message, prefix);
            for _ in 0..=dice.below(8) {
                let at = dice.below(message.len());
                message[at] = dice.next() as u8;
            }
            message.truncate(1 + dice.below(message.len()));
        }
        _ => {
            for _ in 0..=dice.below(4) {
                submessage(&mut message, dice);
            }
        }
    }
    message
}

/// The header of a message: version 2.3, the vendor of Cyclone DDS.
fn header(prefix: [u8; 12]) -> Vec<u8> {
    [&b"RTPS\x02\x03\x01\x10"[..], &prefix].concat()
}

/// A submessage of a known kind with random flags and a random body. Its length is wrong at times.
fn submessage(message: &mut Vec<u8>, dice: &mut Dice) {
    let length = 4 * dice.below(BODY / 4);
    let told = if dice.falls(30) {
        dice.next() as u16
    } else {
        length as u16
    };
    // Mostly little endian, as its length is.
    let flags = dice.next() as u8 | u8::from(dice.falls(90));
    message.extend([KINDS[dice.below(KINDS.len())], flags]);
    message.extend(told.to_le_bytes());
    message.extend((0..length).map(|_| dice.next() as u8));
}

/// Announces a participant with this prefix: the data of section 8.5.3.2 of the RTPS specification.
fn announcement(message: &mut Vec<u8>, prefix: [u8; 12]) {
    let mut data = vec![0, 3, 0, 0];
    let mut parameter = |number: u16, value: &[u8]| {
        data.extend(number.to_le_bytes());
        data.extend((value.len() as u16).to_le_bytes());
        data.extend(value);
    };
    let guid = [&prefix[..], &[0, 0, 1, 0xc1]].concat();
    // Nobody listens at the discard port of this machine.
    let mut locator = [0; 24];
    locator[0] = 1;
    locator[4] = 9;
    locator[20..].copy_from_slice(&[127, 0, 0, 1]);
    let lease = [LEASE.to_le_bytes(), [0; 4]].concat();
    parameter(0x15, &[2, 3, 0, 0]);
    parameter(0x16, &[1, 16, 0, 0]);
    parameter(0x50, &guid);
    parameter(0x02, &lease);
    parameter(0x58, &0x0c3f_u32.to_le_bytes());
    parameter(0x31, &locator);
    parameter(0x32, &locator);
    parameter(0x01, &[]);
    // DATA, little endian, with data; from the writer of announcements to any reader.
    let body = [
        &[
            0, 0, 16, 0, 0, 0, 0, 0, 0, 1, 0, 0xc2, 0, 0, 0, 0, 1, 0, 0, 0,
        ][..],
        &data,
    ]
    .concat();
    message.extend([0x15, 0x05]);
    message.extend((body.len() as u16).to_le_bytes());
    message.extend(body);
}
