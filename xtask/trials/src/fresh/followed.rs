//! What a message on a chain costs beside one that is followed by nobody, and what the supervisor needs
//! for 2,000 joined messages a second.
//!
//! Two components of this process exchange samples of 64 bytes over shared memory. Between blocks, both
//! are told to follow the samples, or not to, as the supervisor tells them.

use crate::counts::{Trace, is_installed};
use crate::programs::{Failure, Running, root, target};
use crate::usage::processor_time;
use rc_deploy_network::Profile;
use rc_management::Client;
use rc_management::component::Request;
use rc_management::hops::{Following, HopReport, Message, Pair, Way};
use rc_middleware::qos::Qos;
use rc_middleware::typed::{HandlerError, Operation, TypedPublisher, read};
use rc_middleware::{Member, RunDirectory};
use rc_runtime::{
    Component, Core, Description, Ports, Role, Sample, Slot, StartError, Values, WorkerError, embed,
};
use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// Samples of a block, and the bytes of one beside its number and the length: 64 together.
const SAMPLES: usize = 500;
const REST: usize = 52;
/// The limit for one sample, for an answer of management, and for a network to be up.
const LIMIT: Duration = Duration::from_secs(1);
const ANSWER: Duration = Duration::from_secs(5);
const UP: Duration = Duration::from_mins(1);

const TICK: Operation = Operation::one_way("tick", 4, 14);

const fn slot(role: Role, qos: Qos) -> Slot {
    Slot {
        name: "Ticks",
        role,
        interface: "Ticks",
        type_name: "Ticks",
        type_hash: 7,
        backend: "iceoryx2",
        qos,
        is_array: false,
        operations: &[TICK],
        external_types: &[],
    }
}

const fn description(name: &'static str, period: Duration, slots: &'static [Slot]) -> Description {
    Description {
        name,
        model_hash: 1,
        middleware: "iceoryx2",
        period,
        parameters: None,
        folder: "/nowhere",
        slots,
        backends: &[rc_iceoryx2::LINKED],
        types: &[],
        simulates_time: false,
        managed: false,
        converter: None,
        note: b"",
    }
}

static SENDER: Description = description(
    "sender",
    Duration::from_millis(20),
    &[slot(Role::Publishes, Qos::PUBLISHER)],
);
static HEARER: Description = description(
    "hearer",
    Duration::from_hours(1),
    &[slot(Role::SubscribesTo, Qos::SUBSCRIBER)],
);

/// Sends a block each time that it is asked to, and returns the time of each sample in microseconds.
struct Sending {
    core: Core,
    ticks: TypedPublisher,
    heard: Arc<AtomicI64>,
    number: i64,
    asked: Receiver<usize>,
    times: Sender<Vec<f64>>,
}

impl Component for Sending {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        if self.ticks.peers() == 0 {
            return Ok(());
        }
        let Ok(samples) = self.asked.try_recv() else {
            return Ok(());
        };
        let rest = vec![7_u8; REST];
        let mut times = Vec::with_capacity(samples);
        for _ in 0..samples {
            self.number += 1;
            let begin = Instant::now();
            let sent = self.ticks.publish_parts((&self.number, &rest));
            sent.map_err(|error| WorkerError::Fatal(error.to_string()))?;
            while self.heard.load(Ordering::Acquire) != self.number {
                if begin.elapsed() > LIMIT {
                    return Err(WorkerError::Fatal("a sample was lost".to_owned()));
                }
                std::hint::spin_loop();
            }
            times.push(begin.elapsed().as_secs_f64() * 1e6);
        }
        let _ = self.times.send(times);
        Ok(())
    }
}

/// Says which sample it has heard.
struct Hearing(Core, Arc<AtomicI64>);

impl Component for Hearing {
    fn core(&mut self) -> &mut Core {
        &mut self.0
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        Ok(())
    }

    fn receive(
        &mut self,
        _: usize,
        _: Option<&Member>,
        _: usize,
        sample: Sample<'_>,
    ) -> Result<(), HandlerError> {
        let (number, _) = read::<(i64, Vec<u8>)>(&mut sample.reader())?;
        self.1.store(number, Ordering::Release);
        Ok(())
    }
}

/// What was measured, each without a chain and on one.
pub(super) struct Followed {
    /// Medians in microseconds.
    pub(super) times: [f64; 2],
    /// Kernel calls of a sample; none without `strace`.
    pub(super) calls: Option<[f64; 2]>,
}

/// Tells both components whether to follow the samples.
fn follow(clients: &mut [Client; 2], is_on: bool) -> Result<(), Failure> {
    let end = || {
        Some(Message {
            slot: "Ticks".to_owned(),
            operation: "tick".to_owned(),
        })
    };
    let pairs = [(None, end(), Way::Any), (end(), None, Way::Handler)];
    for (client, (input, output, way)) in clients.iter_mut().zip(pairs) {
        let pair = Pair {
            input,
            output,
            way,
            stamp: None,
        };
        let pairs = if is_on { vec![pair] } else { Vec::new() };
        let _: Following = client.call(&Request::Follow { pairs }, ANSWER)?;
    }
    Ok(())
}

/// Exchanges so many blocks of each kind, in turns.
pub(super) fn messages(blocks: usize) -> Result<Followed, Failure> {
    let network = format!("followed_{}", std::process::id());
    let heard = Arc::new(AtomicI64::new(0));
    let started = |error: StartError| Failure::from(error.to_string());
    let own = Arc::clone(&heard);
    let hearer = move |core: Core, _: &Ports, _: &Values| Ok(Hearing(core, own));
    let _hearer = embed(&HEARER, hearer, &["--network", &network]).map_err(started)?;
    let (ask, asked) = channel();
    let (sender, times) = channel();
    let sending = move |core: Core, ports: &Ports, _: &Values| {
        Ok(Sending {
            core,
            ticks: ports.publisher(0, 0)?,
            heard,
            number: 0,
            asked,
            times: sender,
        })
    };
    let _sender = embed(&SENDER, sending, &["--network", &network]).map_err(started)?;
    let directory = RunDirectory::of(&network);
    let connect = |name| Client::connect(&directory.socket(name), ANSWER);
    let mut clients = [connect("sender")?, connect("hearer")?];
    let block = |clients: &mut [Client; 2], is_on: bool, samples: usize| {
        follow(clients, is_on)?;
        ask.send(samples)?;
        let times = times.recv_timeout(UP)?;
        for client in clients.iter_mut().filter(|_| is_on) {
            let taken: HopReport = client.call(&Request::Hops, ANSWER)?;
            if taken.hops.is_empty() {
                return Err(Failure::from("the samples were not followed"));
            }
        }
        Ok(times)
    };
    // The first one warms up.
    block(&mut clients, true, SAMPLES)?;
    let mut all = [Vec::new(), Vec::new()];
    for _ in 0..blocks {
        for (kind, times) in all.iter_mut().enumerate() {
            times.extend(block(&mut clients, kind == 1, SAMPLES)?);
        }
    }
    let times = all.map(|mut times| super::median(&mut times));
    let mut calls = None;
    if is_installed("strace") {
        let folder = tempfile::tempdir()?;
        let mut counted = [0.0; 2];
        for (kind, counted) in counted.iter_mut().enumerate() {
            follow(&mut clients, kind == 1)?;
            let trace = Trace::start(std::process::id(), folder.path())?;
            block(&mut clients, kind == 1, 2 * SAMPLES)?;
            *counted = trace.end()? / (2 * SAMPLES) as f64;
        }
        calls = Some(counted);
    }
    Ok(Followed { times, calls })
}

/// A network of two pairs whose ticks, 1,000 a second of each, are two chains, or none.
fn soaks(network: &str, has_chains: bool) -> Result<String, Failure> {
    let folder = root().canonicalize()?.join("xtask/bench");
    let mut text = format!("Deployment {network}\n{{\n");
    for number in 0..2 {
        for name in ["sink", "source"] {
            let cdsl = folder.join(format!("soak_{name}/soak_{name}.cdsl"));
            text += &format!(
                "    Component {name}{number} {{ cdsl \"{}\"; }};\n",
                cdsl.display()
            );
        }
        text += &format!(
            "    bind source{number}.Echo -> sink{number}.Echo;\n    \
                 bind sink{number}.Ticks -> source{number}.Ticks;\n    \
                 bind sink{number}.Images -> source{number}.Images;\n"
        );
        if has_chains {
            text += &format!(
                "    Chain ticks{number} {{ from source{number}.Ticks.tick; \
                     to sink{number}.Ticks.tick; within 10s; }};\n"
            );
        }
    }
    Ok(text + "};\n")
}

/// The part of a core that the supervisor of that network takes, in `length`.
fn share(profile: Profile, has_chains: bool, length: Duration) -> Result<f64, Failure> {
    let folder = tempfile::tempdir()?;
    let network = format!("joined_{}_{}", std::process::id(), u8::from(has_chains));
    let file = folder.path().join("joined.ddsl");
    std::fs::write(&file, soaks(&network, has_chains)?)?;
    let mut command = Command::new(target()?.join(profile.folder()).join("rcdeploy"));
    command
        .args(["up", "--format", "json", "--profile", profile.word()])
        .arg(&file)
        .env("CARGO_TARGET_DIR", target()?)
        .env("XDG_STATE_HOME", folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::inherit());
    let mut child = Running(command.spawn()?);
    let output = BufReader::new(child.0.stdout.take().ok_or("no pipe")?);
    let (sender, up) = channel();
    std::thread::spawn(move || {
        for line in output.lines().map_while(Result::ok) {
            if line.contains("\"code\":\"up\"") && sender.send(()).is_err() {
                return;
            }
        }
    });
    let is_up = up.recv_timeout(UP);
    is_up.map_err(|_| "the network of the soak does not get up")?;
    // The sources warm up, and the chains are followed.
    std::thread::sleep(length.min(Duration::from_secs(3)));
    let (pid, begun) = (child.0.id(), Instant::now());
    let before = processor_time(pid)?;
    std::thread::sleep(length);
    let used = processor_time(pid)?.saturating_sub(before);
    let share = used.as_secs_f64() / begun.elapsed().as_secs_f64();
    let _ = rustix::process::kill_process(
        rustix::process::Pid::from_child(&child.0),
        rustix::process::Signal::TERM,
    );
    if !child.ended_within(UP) {
        return Err("the network of the soak does not end".into());
    }
    Ok(share)
}

/// The part of a core that the supervisor takes for 2,000 joined messages a second.
pub(super) fn supervisor(smoke: bool) -> Result<f64, Failure> {
    let (profile, length) = if smoke {
        (Profile::Dev, Duration::from_secs(2))
    } else {
        (Profile::Release, Duration::from_secs(30))
    };
    let [without, with] = [false, true].map(|chains| share(profile, chains, length));
    Ok((with? - without?).max(0.0))
}
