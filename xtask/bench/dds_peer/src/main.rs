//! `ping` and `pong`, written by hand over the C library Cyclone DDS: the reference for generated
//! components over DDS.
//!
//! `bench_dds_peer ping|pong DOMAIN`. The endpoints have the configuration and the quality of
//! service of our backend. A listener takes samples on the library's thread and wakes the main
//! thread, which runs the handlers, by an eventfd. Messages have the same length as ours. The
//! program omits what only our backend does: values in CDR, envelopes, type hashes, discovery, a
//! deadline for each call, the loop of a component.

use bench_protocol::{Kind, LARGEST, next_command, now, pause, ready, report};
use rc_ddsc::{Domain, Event, Listener, Participant, Qos, Reader, Sample, Topic, Writer};
use rc_middleware::{Environment, RunDirectory, Settings, WakeEvent};
use rc_vocabulary::Value;
use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec, eventfd, poll};
use std::collections::VecDeque;
use std::os::fd::OwnedFd;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Any error ends the program.
type Failure = Box<dyn std::error::Error>;

/// The limit of each wait.
const LIMIT: Timespec = Timespec {
    tv_sec: 1,
    tv_nsec: 0,
};
/// The limit until the other program is discovered.
const START: Duration = Duration::from_secs(10);
/// The pause after discovery, in which the other program discovers this one.
const FOUND: Duration = Duration::from_millis(300);
/// The header of a sample in bytes: encapsulation, time of sending, length.
const SAMPLE: usize = 4 + 8 + 4;
/// The header of a request and of a reply in bytes: as long as the envelope of DDS-RPC.
const REQUEST: usize = 4 + 36 + 4;
const REPLY: usize = 4 + 36 + 4;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["ping", domain] => ping(domain),
        ["pong", domain] => pong(domain),
        _ => Err("usage: bench_dds_peer ping|pong DOMAIN".into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bench_dds_peer: error: {error}");
            ExitCode::from(3)
        }
    }
}

/// Received samples, and the eventfd that wakes the main thread.
struct Inbox {
    bell: OwnedFd,
    came: [Mutex<VecDeque<Sample>>; 2],
    matched: AtomicUsize,
}

impl Inbox {
    fn new() -> Result<Arc<Self>, Failure> {
        Ok(Arc::new(Self {
            bell: eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?,
            came: Default::default(),
            matched: AtomicUsize::new(0),
        }))
    }

    /// Sleeps until the eventfd is readable, at most for a second, and clears it.
    fn wait(&self) -> Result<(), Failure> {
        poll(&mut [PollFd::new(&self.bell, PollFlags::IN)], Some(&LIMIT))?;
        let _ = rustix::io::read(&self.bell, &mut [0; 8]);
        Ok(())
    }

    fn next(&self, at: usize) -> Option<Sample> {
        let mut came = self.came[at].lock().unwrap_or_else(PoisonError::into_inner);
        came.pop_front()
    }

    /// Waits until `ends` endpoints are matched.
    fn meet(&self, ends: usize) -> Result<(), Failure> {
        let end = Instant::now() + START;
        while self.matched.load(Ordering::Relaxed) < ends {
            if Instant::now() > end {
                return Err("the other program does not come".into());
            }
            self.wait()?;
        }
        Ok(())
    }
}

/// The listener of an endpoint. A reader's listener takes samples into one of the two queues.
struct Endpoint {
    inbox: Arc<Inbox>,
    reader: Arc<OnceLock<Reader>>,
    queue: usize,
}

impl Listener for Endpoint {
    fn event(&self, event: Event) {
        match event {
            Event::Data => {
                let Some(reader) = self.reader.get() else {
                    return;
                };
                let came = &self.inbox.came[self.queue];
                let taken = reader.take(|sample| {
                    came.lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .push_back(sample);
                });
                if !matches!(taken, Ok(1..)) {
                    return;
                }
            }
            Event::Matched(_) => {
                self.inbox.matched.fetch_add(1, Ordering::Relaxed);
            }
            _ => return,
        }
        let _ = rustix::io::write(&self.inbox.bell, &1_u64.to_ne_bytes());
    }
}

/// The participant of the program.
struct Part {
    inbox: Arc<Inbox>,
    participant: Participant,
    _domain: Domain,
}

impl Part {
    fn new(domain: &str) -> Result<Self, Failure> {
        let mut environment = Environment {
            network: "bench".to_owned(),
            instance: "peer".to_owned(),
            directory: RunDirectory::of("bench"),
            wake_event: WakeEvent::new()?,
            settings: Settings::default(),
        };
        let settings = &mut environment.settings;
        settings.set(rc_dds::NAME, "domain", Value::Int(domain.parse()?));
        let interfaces = Value::Texts(vec!["lo".to_owned()]);
        settings.set(rc_dds::NAME, "interfaces", interfaces);
        let xml = rc_dds::configuration(&environment)?;
        let domain = Domain::new(domain.parse()?, &xml)?;
        Ok(Self {
            inbox: Inbox::new()?,
            participant: domain.participant(b"")?,
            _domain: domain,
        })
    }

    fn topic(&self, name: &str) -> Result<Topic, Failure> {
        Ok(self.participant.topic(name, "bench::Bytes")?)
    }

    fn endpoint(&self, queue: usize) -> (Box<Endpoint>, Arc<OnceLock<Reader>>) {
        let reader = Arc::new(OnceLock::new());
        let endpoint = Endpoint {
            inbox: Arc::clone(&self.inbox),
            reader: Arc::clone(&reader),
            queue,
        };
        (Box::new(endpoint), reader)
    }

    fn writer(&self, topic: &str, qos: &Qos<'_>) -> Result<Writer, Failure> {
        let (endpoint, _) = self.endpoint(0);
        Ok(self
            .participant
            .writer(&self.topic(topic)?, qos, endpoint)?)
    }

    fn reader(&self, topic: &str, qos: &Qos<'_>, queue: usize) -> Result<(), Failure> {
        let (endpoint, reader) = self.endpoint(queue);
        // Its listener keeps it until the end of the program.
        let made = self
            .participant
            .reader(&self.topic(topic)?, qos, endpoint)?;
        let _ = reader.set(made);
        Ok(())
    }
}

/// The quality of service of publishers and subscribers.
fn values(reliable: bool) -> Qos<'static> {
    use rc_vocabulary::qos::Qos as Policies;
    Qos::of(if reliable {
        &Policies::PUBLISHER
    } else {
        &Policies::SUBSCRIBER
    })
}

/// The source timestamp of a sample.
fn stamp() -> i64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Realtime);
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

/// The publisher and client: executes commands until the standard input ends.
fn ping(domain: &str) -> Result<(), Failure> {
    let part = Part::new(domain)?;
    part.reader("hand_Reply", &Qos::LOSSLESS, 0)?;
    let requests = part.writer("hand_Request", &Qos::LOSSLESS)?;
    let samples = part.writer("hand", &values(true))?;
    part.inbox.meet(3)?;
    // The other program may discover them a little later.
    std::thread::sleep(FOUND);
    // The data follow the longest header, which is written for each message.
    let mut message = vec![7; REQUEST + LARGEST];
    let (mut times, mut answer) = (Vec::new(), Vec::new());
    let mut sequence = 0;
    ready()?;
    while let Some(command) = next_command()? {
        times.clear();
        for _ in 0..command.count {
            sequence += 1;
            if command.kind == Kind::Publish {
                pause(command.size);
                let body = &mut message[..SAMPLE - 4 + command.size];
                body[..8].copy_from_slice(&now().to_ne_bytes());
                samples.write(sequence, stamp(), body)?;
                continue;
            }
            let start = now();
            requests.write(sequence, stamp(), &message[..REQUEST - 4 + command.size])?;
            let end = Instant::now() + START;
            loop {
                if let Some(reply) = part.inbox.next(0) {
                    answer.clear();
                    answer.extend_from_slice(&reply[REPLY..]);
                    break;
                }
                if Instant::now() > end {
                    return Err("no answer".into());
                }
                part.inbox.wait()?;
            }
            times.push(now() - start);
            if answer.len() != command.size {
                return Err("another echo".into());
            }
        }
        if command.kind == Kind::Publish {
            pause(command.size);
            sequence += 1;
            samples.write(sequence, stamp(), &[0; SAMPLE - 4])?;
        }
        report(&times)?;
    }
    Ok(())
}

/// The subscriber and server: replies and records until a signal ends the process.
fn pong(domain: &str) -> Result<(), Failure> {
    let part = Part::new(domain)?;
    let replies = part.writer("hand_Reply", &Qos::LOSSLESS)?;
    part.reader("hand_Request", &Qos::LOSSLESS, 0)?;
    part.reader("hand", &values(false), 1)?;
    let (mut times, mut data, mut reply) = (Vec::new(), Vec::new(), Vec::new());
    let mut sequence = 0;
    ready()?;
    loop {
        part.inbox.wait()?;
        while let Some(sample) = part.inbox.next(1) {
            data.clear();
            data.extend_from_slice(&sample[SAMPLE..]);
            if data.is_empty() {
                report(&times)?;
                times.clear();
            } else {
                let mut sent = [0; 8];
                sent.copy_from_slice(&sample[4..12]);
                times.push(now() - i64::from_ne_bytes(sent));
            }
        }
        while let Some(request) = part.inbox.next(0) {
            reply.clear();
            reply.extend_from_slice(&request[4..]);
            sequence += 1;
            replies.write(sequence, stamp(), &reply)?;
        }
    }
}
