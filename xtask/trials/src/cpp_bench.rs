//! `cargo xtask bench cpp`: components in C++ compared with the same ones in Rust and with Ice: latencies,
//! generation, builds, and idle memory.

use crate::bench::{BLOCKS, GOAL, machine};
use crate::compare::{Peer, met};
use crate::figure::{BUILD, Figure, table};
use crate::ice;
use crate::pair::{Network, Pair, Row, quantile};
use crate::programs::{Failure, Program, cargo, finish, root, target};
use crate::usage::memory;
use crate::variant;
use rc_cdsl::model::Middleware;
use rc_deploy_network::Profile;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

const KIB: usize = 1024;
/// The goal for the ratio to a query over Ice.
const ICE_GOAL: f64 = 0.45;
/// The components.
const COMPONENTS: &str = "bench_cpp";
/// How often the programs are started for the latencies.
const STARTS: usize = 10;
/// How often a duration is measured.
const RUNS: usize = 5;
/// The limit of a command.
const LIMIT: Duration = Duration::from_mins(2);
/// How long a component settles before its memory is read.
const SETTLED: Duration = Duration::from_secs(2);

fn row(name: &'static str, kind: &'static str, size: usize, count: usize) -> Row {
    Row {
        name: Cow::Borrowed(name),
        kind,
        size,
        count,
    }
}

/// Measures everything; `smoke` measures a moment of each, with programs that are not optimised.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let (starts, blocks, share, runs) = if smoke {
        (1, 2, 0.1, 1)
    } else {
        (STARTS, BLOCKS, 1.0, RUNS)
    };
    let profile = if smoke {
        Profile::Dev
    } else {
        Profile::Release
    };
    // What is missing is said before cargo builds for minutes: Ice here, cmake and a compiler by the build of the
    // components. A smoke test needs no Ice.
    let ice = match ice::build() {
        Err(missing) if !smoke => return Err(missing),
        ice => ice,
    };
    let programs = variant::build(COMPONENTS, Middleware::Iceoryx2, profile)?;
    let words = ["build", "--workspace", "--profile", profile.word()];
    let bins = ["--bin", "ping", "--bin", "pong", "--bin", "rcgen"];
    finish(cargo(&[&words[..], &bins].concat())?, BUILD)?;
    println!("{}\n", machine());
    let rows = [
        row("publish 64 B, one way", "publish", 64, 300),
        row("publish 1 MiB in place, one way", "place", KIB * KIB, 30),
        row("query 64 B, round trip", "query", 64, 1000),
    ];
    let peer = Peer {
        name: "in Rust",
        goal: GOAL,
    };
    let ours = || {
        let network = Network::new("cpp")?;
        let name = network.name.clone();
        let arguments: [&str; 4] = ["--network", &name, "--log", "error"];
        Pair::start(
            [&[], &[]],
            &programs,
            [&arguments, &arguments],
            Some(network),
        )
    };
    let both = || {
        let theirs = Pair::generated_with("rust", profile, [&[], &[]]);
        Ok([ours()?, theirs?])
    };
    let mut good = met(&peer.table_of_starts(&rows, starts, both, blocks / starts, share)?);
    println!();
    match ice {
        Ok(echo) => {
            let peer = Peer {
                name: "Ice in C++",
                goal: ICE_GOAL,
            };
            let both = || Ok([ours()?, Pair::ice(&echo)?]);
            good &= met(&peer.table_of_starts(&rows[2..], starts, both, blocks / starts, share)?);
        }
        Err(missing) => println!("{missing}\n"),
    }
    good &= table([
        generation(profile, runs)?,
        rebuild(runs)?,
        clean(runs)?,
        idle(&programs[0], profile)?,
    ]);
    if !good {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// The median of several runs, in milliseconds.
fn median(runs: usize, mut run: impl FnMut() -> Result<(), Failure>) -> Result<f64, Failure> {
    let mut times = Vec::new();
    for _ in 0..runs {
        let start = Instant::now();
        run()?;
        times.push(start.elapsed().as_secs_f64() * 1000.0);
    }
    Ok(quantile(&mut times, 0.5))
}

/// The generation of a component, as a process.
fn generation(profile: Profile, runs: usize) -> Result<Figure, Failure> {
    let rcgen = target()?.join(profile.folder()).join("rcgen");
    let avoider = root().join("components/avoider_cpp/avoider_cpp.cdsl");
    let took = median(4 * runs, || {
        let mut command = Command::new(&rcgen);
        command.arg("--check").arg(&avoider);
        finish(command, LIMIT).map(drop)
    })?;
    Ok(Figure {
        what: "generation of `avoider_cpp`",
        goal: "≤ 20 ms",
        measured: format!("{took:.1} ms"),
        met: took <= 20.0,
    })
}

/// The build folder of `pong_cpp`, which [`variant::build`] has made.
fn build_folder() -> Result<PathBuf, Failure> {
    Ok(target()?.join("rc/cpp/variants/pong_cpp/build"))
}

fn cmake(folder: &Path, words: &[&str]) -> Result<(), Failure> {
    let mut command = Command::new("cmake");
    command.arg("--build").arg(folder).args(words);
    finish(command, LIMIT).map(drop)
}

/// The build after a change of the worker, without cargo.
fn rebuild(runs: usize) -> Result<Figure, Failure> {
    let folder = build_folder()?;
    let object = folder.join("CMakeFiles/pong_cpp.dir/src/specificworker.cpp.o");
    let took = median(runs, || {
        std::fs::remove_file(&object)?;
        cmake(&folder, &[])
    })?;
    Ok(Figure {
        what: "build of `pong_cpp` after a change of its worker",
        goal: "< 5 s",
        measured: format!("{:.1} s", took / 1000.0),
        met: took < 5000.0,
    })
}

/// The whole build of a component; the library of the framework is there.
fn clean(runs: usize) -> Result<Figure, Failure> {
    let folder = build_folder()?;
    let took = median(runs, || {
        cmake(&folder, &["--clean-first", "--parallel", "2"])
    })?;
    Ok(Figure {
        what: "whole build of `pong_cpp`",
        goal: "< 20 s",
        measured: format!("{:.1} s", took / 1000.0),
        met: took < 20_000.0,
    })
}

/// The memory of an idle component, beside that of the same one in Rust.
fn idle(program: &Path, profile: Profile) -> Result<Figure, Failure> {
    let network = Network::new("idle")?;
    let own = |path: &Path, name: &str| -> Result<f64, Failure> {
        let bind = [
            format!("awake={}/Awake", network.name),
            format!("onward={}/Onward", network.name),
        ];
        let mut arguments = vec!["--network", &network.name, "--log", "error", "--name", name];
        if name == "rust" {
            arguments.extend(["--bind", &bind[0], "--bind", &bind[1]]);
        }
        let component = Program::start(path, &arguments)?;
        std::thread::sleep(SETTLED);
        Ok(memory(component.pid())?.0)
    };
    let rust = own(&target()?.join(profile.folder()).join("pong"), "rust")?;
    let cpp = own(program, "cpp")?;
    let more = cpp - rust;
    Ok(Figure {
        what: "memory of an idle `pong_cpp`, more than `pong` in Rust",
        goal: "≤ 2 MB PSS",
        measured: format!("{more:.1} MB ({cpp:.1} and {rust:.1})"),
        met: more <= 2.0,
    })
}
