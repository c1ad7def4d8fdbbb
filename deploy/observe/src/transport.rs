//! How long messages need from one process to another one of this machine.

use crate::backends::Backends;
use crate::error::Error;
use rc_middleware::{
    Address, Endpoint, ExternalType, Header, Qos, Reliability, RunDirectory, TypeIdentity, now,
    wait,
};
use std::collections::BTreeMap;
use std::os::fd::AsFd as _;
use std::time::{Duration, Instant};

/// The network of both processes. It has the same name in each run, so that a run removes what an
/// interrupted one has left in shared memory. The name is reserved: no other network has it.
const NETWORK: &str = "rcdeploy-transport";
/// The bytes of a message.
const BYTES: usize = 1024;
/// The messages before those that count: the first ones open connections and touch memory.
const WARM_UP: u32 = 100;
/// The time between two messages.
const PERIOD: Duration = Duration::from_millis(1);
/// How long a process may take to find the other one, or a message to arrive.
const LIMIT: Duration = Duration::from_secs(20);
/// The longest wait for a descriptor before the queue is looked into.
const CYCLE: Duration = Duration::from_millis(50);

/// The end of the topic that two processes have.
struct End {
    backends: Backends,
    endpoint: Endpoint,
    middleware: &'static str,
}

impl End {
    /// `run`: a name that no other run has, also on other machines.
    fn open(run: &str, middleware: &'static str, depth: u32) -> Result<Self, Error> {
        let address = Address::parse(&format!("{run}/Transport/message"));
        let address = address.map_err(|reason| Error::system("the address", &reason))?;
        Ok(Self {
            backends: Backends::of_peer(NETWORK)?,
            endpoint: Endpoint {
                address,
                types: TypeIdentity {
                    name: "Transport/message".to_owned(),
                    hash: 1,
                },
                qos: Qos {
                    reliability: Reliability::Reliable,
                    depth,
                    ..Qos::PUBLISHER
                },
                // Nodes of ROS 2 have messages of their own types only.
                external_types: vec![ExternalType {
                    slot: "Transport".to_owned(),
                    operation: "message".to_owned(),
                    id: 1,
                    type_name: "std_msgs/msg/String".to_owned(),
                }],
            },
            middleware,
        })
    }
}

/// Sends so many messages to [`receive_transport`] in another process, and some before.
pub fn send_transport(run: &str, middleware: &'static str, messages: u32) -> Result<(), Error> {
    let mut end = End::open(run, middleware, 100)?;
    let backend = end.backends.joined(end.middleware, &BTreeMap::new())?;
    let mut publisher = backend.publisher(&end.endpoint)?;
    let begun = Instant::now();
    while publisher.peers() == 0 {
        if begun.elapsed() > LIMIT {
            return Err(missing(middleware));
        }
        std::thread::sleep(PERIOD);
    }
    // A string: its length, letters, and the end.
    let mut body = vec![b'x'; BYTES];
    let length = u32::try_from(BYTES - 4).unwrap_or_default();
    body[..4].copy_from_slice(&length.to_le_bytes());
    body[BYTES - 1] = 0;
    for sequence in 1..=u64::from(WARM_UP) + u64::from(messages) {
        let header = Header {
            type_hash: 1,
            sequence,
            sent: now(),
            ..Header::default()
        };
        let sent = publisher.publish(header, &body);
        sent.map_err(|error| Error::system("send a message", &error))?;
        std::thread::sleep(PERIOD);
    }
    end.backends.linger(LIMIT);
    Ok(())
}

/// Receives so many messages of [`send_transport`], and returns how long each was on its way, in
/// nanoseconds.
pub fn receive_transport(
    run: &str,
    middleware: &'static str,
    messages: u32,
) -> Result<Vec<u64>, Error> {
    let mut end = End::open(run, middleware, 100)?;
    let backend = end.backends.joined(end.middleware, &BTreeMap::new())?;
    let mut subscriber = backend.subscriber(&end.endpoint)?;
    let last = u64::from(WARM_UP) + u64::from(messages);
    let (mut times, mut is_done, mut heard) = (Vec::new(), false, Instant::now());
    while !is_done {
        if heard.elapsed() > LIMIT {
            return Err(missing(middleware));
        }
        let woken = wait(&[subscriber.descriptor().as_fd()], CYCLE) > 0;
        subscriber.acknowledge(woken);
        let mut take = |header: Header, _: &[u8]| {
            heard = Instant::now();
            is_done |= header.sequence >= last;
            if header.sequence > u64::from(WARM_UP) && header.sent > 0 {
                times.push(now().saturating_sub(header.sent));
            }
        };
        loop {
            let received = subscriber.receive(&mut take);
            if !received.map_err(|error| Error::system("receive a message", &error))? {
                break;
            }
        }
    }
    Ok(times)
}

/// Removes the run directory. No other process measures meanwhile.
pub fn remove_transport() {
    // The next run uses a directory that is left.
    let _ = RunDirectory::of(NETWORK).remove();
}

fn missing(middleware: &str) -> Error {
    let reason = format!(
        "no message over `{middleware}` within {} s",
        LIMIT.as_secs()
    );
    Error::system("measure the transport", &reason)
}
