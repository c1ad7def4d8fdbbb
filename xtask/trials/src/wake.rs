//! `cargo xtask bench wake`: the gain of `wake spin` if each end has a processor, and its cost if
//! both ends share one. One pair of components has two slots of one interface, one of which polls;
//! blocks of both are measured in turns.

use crate::bench::machine;
use crate::compare::{Ratio, met};
use crate::figure::{BUILD, mark};
use crate::pair::{Pair, ROWS, Row, Times};
use crate::programs::{Failure, cargo, finish, target};
use crate::variant::{self, DDS};
use rc_cdsl::model::Middleware;
use rc_deploy_network::Profile;
use rustix::thread::{CpuSet, sched_getaffinity};
use std::path::PathBuf;
use std::time::Duration;

/// The goal for a query with polling, divided by one without.
const GOAL: f64 = 1.2;
/// Blocks of each kind.
const BLOCKS: usize = 40;

/// Measures both middlewares; with `smoke`, a few blocks of programs that are not optimised.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let (profile, blocks, share) = if smoke {
        (Profile::Dev, 5, 0.2)
    } else {
        (Profile::Release, BLOCKS, 1.0)
    };
    let words = ["build", "--workspace", "--bin", "ping", "--bin", "pong"];
    let optimised: &[&str] = if smoke { &[] } else { &["--release"] };
    finish(cargo(&[&words, optimised].concat())?, BUILD)?;
    let folder = target()?.join(if smoke { "debug" } else { "release" });
    let shared = ["pong", "ping"].map(|name| folder.join(name));
    let dds = variant::build("bench", Middleware::Dds, profile)?;
    println!("{}\n", machine());
    println!(
        "| query of 64 B, round trip, µs | with `wake spin 200us` p50 | mean | without p50 | mean | ratio at p50 (goal ≤ {GOAL:.1}) | ratio of processor time | n |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut ratios = Vec::new();
    for (name, programs, more) in [("shared memory", shared, &[][..]), ("DDS", dds, &DDS[..])] {
        for (place, processors) in places()? {
            ratios.push(row(
                &format!("{name}, {place}"),
                &programs,
                more,
                processors,
                (blocks, share),
            )?);
        }
    }
    println!();
    if !met(&ratios) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Where both ends run: the processors of the subscriber and server, and of the publisher and client.
fn places() -> Result<Vec<(&'static str, [usize; 2])>, Failure> {
    let allowed = sched_getaffinity(None)?;
    let allowed: Vec<usize> = (0..CpuSet::MAX_CPU)
        .filter(|at| allowed.is_set(*at))
        .collect();
    let first = *allowed.first().ok_or("no processor")?;
    let mut places = vec![("both ends on one processor", [first, first])];
    match allowed.last() {
        Some(&last) if last != first => places.push(("a processor each", [first, last])),
        _ => println!("There is one processor, so `a processor each` was not measured.\n"),
    }
    Ok(places)
}

/// The measurements of one kind.
#[derive(Default)]
struct Side {
    times: Times,
    processor: Duration,
}

/// Measures a pair at these processors, and prints its row.
fn row(
    name: &str,
    programs: &[PathBuf; 2],
    more: &[&str],
    processors: [usize; 2],
    (blocks, share): (usize, f64),
) -> Result<Ratio, Failure> {
    let mut pair = Pair::at(processors, programs, more)?;
    let of = |kind| {
        ROWS.iter()
            .find(|row| row.kind == kind)
            .ok_or("no such row")
    };
    let rows: [&Row; 2] = [of("awake")?, of("query")?];
    let mut sides = [Side::default(), Side::default()];
    for block in 0..=blocks {
        // The first block warms up.
        if block == 1 {
            sides = [Side::default(), Side::default()];
        }
        for at in [block % 2, (block + 1) % 2] {
            let before = pair.processor_time()?;
            sides[at].times.add(pair.block(rows[at], share)?);
            sides[at].processor += pair.processor_time()?.saturating_sub(before);
        }
    }
    let [polling, sleeping] = &mut sides;
    let processor = polling.processor.as_secs_f64() / sleeping.processor.as_secs_f64();
    let value = polling.times.quantile(0.5) / sleeping.times.quantile(0.5);
    println!(
        "| {name} | {:.1} | {:.1} | {:.1} | {:.1} | {value:.2} {} | {processor:.2} | {} |",
        polling.times.quantile(0.5),
        polling.times.mean(),
        sleeping.times.quantile(0.5),
        sleeping.times.mean(),
        mark(value <= GOAL),
        polling.times.len(),
    );
    Ok(Ratio {
        what: name.to_owned(),
        value,
        goal: GOAL,
    })
}
