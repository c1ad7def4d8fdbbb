//! Publishers and subscribers that are killed, stopped and started again at random, beside each other. After
//! each round, every subscriber hears every publisher.

use crate::processes::Network;
use rc_conformance::network::{endpoint, header};
use rc_middleware::qos::Durability;
use rc_middleware::{Endpoint, wait};
use rustix::process::{Pid, Signal, kill_process};
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// A publisher that a subscriber has not heard for so long counts as silent.
const SILENT: Duration = Duration::from_millis(300);
/// The longest time until all hear all after a round.
const LIMIT: Duration = Duration::from_secs(20);

/// A topic that keeps samples for late subscribers, whose ports connect in another way, and one that does not.
fn topics() -> [Endpoint; 2] {
    let mut kept = endpoint("default/Laser/kept");
    kept.qos.durability = Durability::TransientLocal;
    let mut topics = [kept, endpoint("default/Laser/scan")];
    for topic in &mut topics {
        topic.qos.depth = 64;
    }
    topics
}

/// Runs a role of this test.
pub(crate) fn play(role: &str, network: &Network) {
    let backend = network.join(role);
    if role == "publisher" {
        let mut ports = topics().map(|topic| backend.publisher(&topic).expect("a publisher"));
        println!("ready");
        for sequence in 1.. {
            for port in &mut ports {
                let _ = port.publish(header(sequence), &std::process::id().to_le_bytes());
            }
            wait(&[], Duration::from_millis(5));
        }
    }
    let mut ports = topics().map(|topic| backend.subscriber(&topic).expect("a subscriber"));
    let mut heard: Vec<(usize, u32, Instant)> = Vec::new();
    loop {
        let descriptors = ports.each_ref().map(|port| port.descriptor());
        wait(&descriptors, Duration::from_millis(50));
        for (topic, port) in ports.iter_mut().enumerate() {
            port.acknowledge(true);
            let mut take = |_, body: &[u8]| {
                let publisher = u32::from_le_bytes(body.try_into().expect("a process id"));
                heard.retain(|(of, from, _)| (*of, *from) != (topic, publisher));
                heard.push((topic, publisher, Instant::now()));
            };
            while port.receive(&mut take) == Ok(true) {}
        }
        heard.retain(|(_, _, at)| at.elapsed() < SILENT);
        let list = heard
            .iter()
            .map(|(topic, from, _)| format!(" {topic}/{from}"));
        println!("hears{}", list.collect::<String>());
    }
}

/// A process of the test. It ends when this is dropped.
struct Peer {
    child: Child,
    publishes: bool,
    /// Its last line.
    told: Arc<Mutex<String>>,
}

impl Peer {
    fn start(network: &Network, publishes: bool) -> Self {
        let role = if publishes { "publisher" } else { "subscriber" };
        let mut child = Command::new(std::env::current_exe().expect("a path"))
            .args(["role", "--exact", "--nocapture", "--test-threads=1"])
            .env("RC_TEST_ROLE", format!("restarts {role}"))
            .env("RC_TEST_NETWORK", &network.0)
            .stdout(Stdio::piped())
            .spawn()
            .expect("a process");
        let lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
        let told = Arc::new(Mutex::new(String::new()));
        let last = Arc::clone(&told);
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                *last.lock().expect("a lock") = line;
            }
        });
        Self {
            child,
            publishes,
            told,
        }
    }

    /// Whether it is ready and, as a subscriber, hears all of `publishers` on both topics.
    fn hears(&self, publishers: &BTreeSet<u32>) -> bool {
        let told = self.told.lock().expect("a lock");
        if self.publishes {
            return told.ends_with("ready");
        }
        let words: BTreeSet<&str> = told.split(' ').collect();
        let all = publishers.iter().flat_map(|id| [(0, id), (1, id)]);
        all.into_iter()
            .all(|(topic, id)| words.contains(&*format!("{topic}/{id}")))
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).expect("to send a signal");
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn all_hear_all_after_kills_and_stops() {
    let number = |name: &str, default| {
        let value = std::env::var(name).ok().and_then(|text| text.parse().ok());
        value.unwrap_or(default)
    };
    let (mut seed, seconds) = (number("RC_SEED", 7), number("RC_SECONDS", 2));
    let mut random = move |below: u64| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        seed % below
    };
    let network = Network::new("restarts");
    // A deployer keeps the services open, too.
    let holder = network.join("holder");
    let _held = topics().map(|topic| holder.subscriber(&topic).expect("a subscriber"));
    let start = Instant::now();
    let mut peers: Vec<Peer> = (0..8)
        .map(|at| Peer::start(&network, at % 3 == 0))
        .collect();
    let (mut rounds, mut kills) = (0, 0);
    while start.elapsed() < Duration::from_secs(seconds) {
        rounds += 1;
        for _ in 0..=random(5) {
            let at = usize::try_from(random(8)).expect("a small number");
            // The times decide which steps of an opening a kill or a stop meets: there is no event to wait for.
            if random(3) == 0 {
                peers[at].signal(Signal::STOP);
                wait(&[], Duration::from_millis(random(1200)));
                peers[at].signal(Signal::CONT);
            } else {
                peers[at] = Peer::start(&network, peers[at].publishes);
                kills += 1;
                wait(&[], Duration::from_micros(random(60_000)));
            }
        }
        let publishers = peers.iter().filter(|peer| peer.publishes);
        let publishers: BTreeSet<u32> = publishers.map(|peer| peer.child.id()).collect();
        let since = Instant::now();
        while let Some(deaf) = peers.iter().find(|peer| !peer.hears(&publishers)) {
            assert!(
                since.elapsed() < LIMIT,
                "round {rounds}, {kills} kills, publishers {publishers:?}: process {} says {:?}",
                deaf.child.id(),
                deaf.told.lock().expect("a lock")
            );
            wait(&[], Duration::from_millis(20));
        }
    }
    println!("{rounds} rounds, {kills} kills");
}
