//! The cost of a proxy compared with one more hop: the same two processes, directly and through a
//! proxy.

use super::placed::{SLOTS as SLOTS_OF_PING, SLOTS_OF_PONG, arguments};
use super::{Row, row};
use crate::compare::Ratio;
use crate::figure::mark;
use crate::pair::{Network, Pair, Times};
use crate::programs::{Failure, Program};
use crate::variant;
use rc_deploy_network::Profile;
use std::path::{Path, PathBuf};

/// The goal for the cost of a proxy, divided by one more hop.
const GOAL: f64 = 1.1;
/// The slots of the proxy.
const SLOTS: [&str; 2] = ["Echo", "Sample"];

const ROWS: [Row; 3] = [
    row("publish 64 B, one way", "publish", 64, 500),
    row("publish 1 MiB copied, one way", "publish", 1 << 20, 50),
    row("query 64 B, round trip", "query", 64, 1000),
];

/// The program of the proxy, and its description.
pub(super) fn build(profile: Profile, builds: bool) -> Result<(PathBuf, String), Failure> {
    variant::proxy("place_proxy", "peer", profile, builds)
}

/// Measures all with the program of both components, and prints them.
pub(super) fn run(
    program: &Path,
    (profile, builds): (Profile, bool),
    (blocks, share): (usize, f64),
) -> Result<Vec<Ratio>, Failure> {
    let (forwarder, description) = build(profile, builds)?;
    let direct = Pair::members_in(Network::new("direct")?, program, &[])?;
    let through = Proxied::start(program, &forwarder, &description)?;
    let mut pairs = [direct, through.pair];
    let _proxy = through.proxy;
    println!(
        "| µs, two processes | one hop p50 | p99 | through a proxy p50 | p99 | added by the proxy, divided by one hop (goal ≤ {GOAL:.1}) | n |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut ratios = Vec::new();
    for row in &ROWS {
        ratios.push(measured(row, &mut pairs, (blocks, share))?);
    }
    println!();
    Ok(ratios)
}

fn measured(
    row: &Row,
    pairs: &mut [Pair; 2],
    (blocks, share): (usize, f64),
) -> Result<Ratio, Failure> {
    let mut found = [Times::default(), Times::default()];
    for block in 0..=blocks {
        // The first block warms up.
        if block == 1 {
            found = [Times::default(), Times::default()];
        }
        for at in [block % 2, (block + 1) % 2] {
            found[at].add(pairs[at].block(row, share)?);
        }
    }
    let count = found[0].len();
    let [hop, through] = found.each_mut().map(|times| times.quantile(0.5));
    let [hop_p99, through_p99] = found.each_mut().map(|times| times.quantile(0.99));
    let value = (through - hop) / hop;
    println!(
        "| {} | {hop:.1} | {hop_p99:.1} | {through:.1} | {through_p99:.1} | {value:.2} {} | {count} |",
        row.name,
        mark(value <= GOAL),
    );
    Ok(Ratio {
        what: format!("a proxy, {}", row.name),
        value,
        goal: GOAL,
    })
}

/// Both components with a proxy between them.
struct Proxied {
    pair: Pair,
    proxy: Program,
}

impl Proxied {
    fn start(program: &Path, forwarder: &Path, description: &str) -> Result<Self, Failure> {
        let network = Network::new("proxy")?;
        let name = network.name.clone();
        let outside = SLOTS.map(|slot| format!("--bind={slot}={name}/peer/{slot}"));
        let inside = SLOTS.map(|slot| format!("--bind=inside_{slot}={name}/{slot}"));
        let own = [
            description,
            "--network",
            &name,
            "--name",
            "peer",
            "--log",
            "error",
        ];
        let binds = outside.iter().chain(&inside).map(String::as_str);
        let all: Vec<&str> = own.into_iter().chain(binds).collect();
        let proxy = Program::start(forwarder, &all)?;
        let pair = Pair::members_in(network, program, &outside)?;
        Ok(Self { pair, proxy })
    }
}

impl Pair {
    /// Both components of a program, as two processes. `ping` gets further arguments.
    pub(super) fn members_in(
        network: Network,
        program: &Path,
        more: &[String],
    ) -> Result<Self, Failure> {
        let of = |name: &str, slots: &[&str], more: &[String]| {
            let member = ["--member".to_owned(), name.to_owned()];
            let own = arguments(&network.name, "iceoryx2", slots, &[]);
            [&member[..], &own, more].concat()
        };
        let of = [
            of("pong", &SLOTS_OF_PONG, &[]),
            of("ping", &SLOTS_OF_PING, more),
        ];
        let of: [Vec<&str>; 2] = of
            .each_ref()
            .map(|all| all.iter().map(String::as_str).collect());
        let programs = [program.to_owned(), program.to_owned()];
        Self::start([&[], &[]], &programs, [&of[0], &of[1]], Some(network))
    }
}
