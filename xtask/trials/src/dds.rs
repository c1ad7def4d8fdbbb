//! `cargo xtask bench dds`: generated components over DDS compared with hand-written programs on
//! the C library's calls, and with ddsperf, the library's own tool, as Debian has it.

use crate::bench::machine;
use crate::compare::{Peer, met};
use crate::figure::BUILD;
use crate::pair::{Pair, Row, quantile};
use crate::programs::{Failure, Program, cargo, finish, target};
use crate::variant::{self, DDS};
use rc_cdsl::model::Middleware;
use rc_deploy_network::Profile;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

/// The goal for the ratio at p50.
const GOAL: f64 = 1.15;
/// The domain of the hand-written program, and that of ddsperf.
const BY_HAND: &str = "191";
const DDSPERF: &str = "192";
/// The configuration of ddsperf: the settings of our backend that influence speed.
const CONFIGURATION: &str = "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
    <MaxMessageSize>65500B</MaxMessageSize><FragmentSize>65000B</FragmentSize></General></Domain></CycloneDDS>";
/// The duration of ddsperf for each size.
const PERIOD: Duration = Duration::from_secs(5);
/// Sizes in bytes, their names, and the messages of a block.
pub(crate) const SIZES: [(&str, usize, usize); 3] = [
    ("64 B", 64, 500),
    ("4 KiB", 4096, 500),
    ("1 MiB", 1024 * 1024, 50),
];

/// The rows over a network.
pub(crate) fn rows() -> [[Row; 2]; 3] {
    SIZES.map(|(name, size, count)| {
        let row = |what: &str, kind| Row {
            name: format!("{what} {name}").into(),
            kind,
            size,
            count,
        };
        [
            row("publish, one way,", "publish"),
            row("query, round trip,", "query"),
        ]
    })
}

/// Builds both, measures them in turns, then ddsperf.
pub(crate) fn run(blocks: usize, share: f64) -> Result<(), Failure> {
    let generated = variant::build("bench", Middleware::Dds, Profile::Release)?;
    let words = [
        "build",
        "--release",
        "--workspace",
        "--bin",
        "bench_dds_peer",
    ];
    finish(cargo(&words)?, BUILD)?;
    println!("{}\n", machine());
    let peer = Peer {
        name: "by hand",
        goal: GOAL,
    };
    let mut ours = Pair::components(&generated, &DDS)?;
    let mut theirs = Pair::by_hand_over("bench_dds_peer", BY_HAND)?;
    if !met(&peer.table(rows().as_flattened(), &mut ours, &mut theirs, blocks, share)?) {
        eprintln!("xtask: a goal was missed");
    }
    drop((ours, theirs));
    match install() {
        Ok(ddsperf) => beside(&ddsperf)?,
        Err(error) => println!("ddsperf was not measured: {error}"),
    }
    Ok(())
}

/// Measures ddsperf and prints a table.
fn beside(ddsperf: &Ddsperf) -> Result<(), Failure> {
    let version = &ddsperf.version;
    println!("| µs | ddsperf {version} p50 | p99 |\n|---|---|---|");
    for (name, size, _) in SIZES {
        let [p50, p99] = ddsperf.one_way(size)?;
        println!("| half a round trip, {name} | {p50:.1} | {p99:.1} |");
    }
    println!();
    Ok(())
}

/// The tool, unpacked below the target folder.
struct Ddsperf {
    folder: PathBuf,
    version: String,
}

/// Fetches Debian's package without root permissions.
fn install() -> Result<Ddsperf, Failure> {
    let folder = target()?.join("ddsperf");
    let program = folder.join("usr/bin/ddsperf");
    if !program.exists() {
        let _ = std::fs::remove_dir_all(&folder);
        let script = "set -e; mkdir -p \"$0\"; cd \"$0\"
            apt-get download $(apt-get --simulate install cyclonedds-tools | sed -n 's/^Inst \\([^ ]*\\).*/\\1/p')
            for package in *.deb; do dpkg --extract $package .; done";
        let mut command = Command::new("sh");
        command.args(["-c", script]).arg(&folder);
        finish(command, BUILD)?;
    }
    let name = |entry: std::fs::DirEntry| entry.file_name().into_string().ok();
    let version = std::fs::read_dir(&folder)?
        .filter_map(|entry| name(entry.ok()?))
        .find_map(|name| {
            Some(
                name.strip_prefix("cyclonedds-tools_")?
                    .split_once('_')?
                    .0
                    .to_owned(),
            )
        })
        .ok_or("cyclonedds-tools was not downloaded")?;
    Ok(Ddsperf { folder, version })
}

impl Ddsperf {
    fn start(&self, arguments: &[&str]) -> Result<Program, Failure> {
        let folder = &self.folder;
        let libraries = folder.join(format!("usr/lib/{}-linux-gnu", std::env::consts::ARCH));
        let mut command = Command::new(folder.join("usr/bin/ddsperf"));
        command
            .args(["-i", DDSPERF])
            .args(arguments)
            .env("LD_LIBRARY_PATH", libraries)
            .env("CYCLONEDDS_URI", CONFIGURATION);
        Program::spawn(command)
    }

    /// The medians of p50 and p99 of each second, in µs. ddsperf prints half of a round trip.
    fn one_way(&self, size: usize) -> Result<[f64; 2], Failure> {
        let _pong = self.start(&["pong"])?;
        let ping = self.start(&["ping", "size", &size.to_string()])?;
        let (end, mut found) = (Instant::now() + PERIOD, [vec![], vec![]]);
        while Instant::now() < end {
            let line = ping.read_line(PERIOD)?;
            let mut number = |name: &str, at: usize| {
                let words: Vec<&str> = line.split_whitespace().collect();
                let word = words.iter().position(|word| *word == name)? + 1;
                let number = words.get(word)?.trim_end_matches("us").parse().ok()?;
                found[at].push(number);
                Some(())
            };
            let _ = (number("50%", 0), number("99%", 1));
        }
        Ok(found.map(|mut each| quantile(&mut each, 0.5)))
    }
}
