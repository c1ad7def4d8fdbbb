//! `cargo xtask bench place`: two components of one program, as threads of one process, as two
//! processes, and on two hosts; the copies of a message; a chain of ten components as one process
//! and as ten; the cost of a proxy.

mod copies;
mod pipeline;
mod placed;
mod proxy;

use crate::bench::machine;
use crate::compare::{Ratio, met};
use crate::figure::mark;
use crate::pair::{Row, Times, quantile};
use crate::programs::Failure;
use crate::variant;
use placed::Placed;
use rc_cdsl::model::Middleware;
use rc_deploy_network::Profile;
use rc_test_support::cable::Cable;
use std::borrow::Cow;
use std::time::Duration;

/// Blocks of each row, for each placement.
const BLOCKS: usize = 40;
/// The goal for a thread, divided by a process.
const GOAL: f64 = 0.7;
/// The goal for the greatest time of a value in place of any size, divided by the smallest.
const SIZE_GOAL: f64 = 1.2;

const fn row(name: &'static str, kind: &'static str, size: usize, count: usize) -> Row {
    Row {
        name: Cow::Borrowed(name),
        kind,
        size,
        count,
    }
}

/// The measured rows. The last ones are those of one value in four sizes.
const ROWS: [Row; 9] = [
    row("publish 64 B, one way", "publish", 64, 500),
    row("publish 64 KiB copied, one way", "publish", 64 << 10, 50),
    row("publish 1 MiB copied, one way", "publish", 1 << 20, 50),
    row(
        "publish 1 MiB in place, with the writing",
        "place",
        1 << 20,
        50,
    ),
    row("query 64 B, round trip", "query", 64, 1000),
    row("64 KiB in place, without the writing", "lent", 64 << 10, 50),
    row(
        "256 KiB in place, without the writing",
        "lent",
        256 << 10,
        50,
    ),
    row("1 MiB in place, without the writing", "lent", 1 << 20, 50),
    row("4 MiB in place, without the writing", "lent", 4 << 20, 50),
];

/// Whether a row is also measured on two hosts, which share no memory.
fn is_on_hosts(row: &Row) -> bool {
    matches!(
        (row.kind, row.size),
        ("publish", 64 | 0x0010_0000) | ("query", _)
    )
}

/// Builds all programs that a measurement starts.
pub(crate) fn build() -> Result<(), Failure> {
    variant::program("place", Profile::Release, true)?;
    variant::build("bench", Middleware::Dds, Profile::Release)?;
    proxy::build(Profile::Release, true).map(drop)
}

/// Measures all; with `smoke`, a few blocks of programs that are not optimised.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let (profile, blocks, share) = if smoke {
        (Profile::Dev, 5, 0.2)
    } else {
        (Profile::Release, BLOCKS, 1.0)
    };
    // Tests run what `cargo xtask test` has built.
    let program = variant::program("place", profile, !smoke)?;
    let apart = if smoke {
        variant::built("bench", Middleware::Dds, profile)?
    } else {
        variant::build("bench", Middleware::Dds, profile)?
    };
    println!("{}\n", machine());
    let mut sides = vec![Placed::in_one(&program)?, Placed::in_two(&program)?];
    match Cable::lay() {
        Ok(cable) => sides.push(Placed::on_hosts(cable, &apart)?),
        Err(reason) => eprintln!("xtask: two hosts were not measured: {reason}"),
    }
    println!(
        "| µs | one process p50 | p99 | two processes p50 | p99 | ratio at p50 (goal ≤ {GOAL:.1}) | ratio of processor time | two hosts p50 | p99 | n |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut ratios = Vec::new();
    let mut of_sizes = Vec::new();
    // Sizes that are compared are measured in turns, too: the machine may be slower in another minute.
    let is_compared = |row: &Row| row.kind == "lent";
    for rows in ROWS.chunk_by(|one, next| is_compared(one) && is_compared(next)) {
        for (ratio, of_thread) in measured(rows, &mut sides, (blocks, share))? {
            ratios.push(ratio);
            if is_compared(&rows[0]) {
                of_sizes.push(of_thread);
            }
        }
    }
    let most = quantile(&mut of_sizes, 1.0) / quantile(&mut of_sizes, 0.0);
    println!();
    drop(sides);
    copies::print()?;
    let (of_chain, memory) = pipeline::run(&program, (blocks, share))?;
    println!("| one process | MB | ten processes, MB | ratio | goal |");
    println!("|---|---|---|---|---|");
    println!(
        "| memory of the chain | {:.1} | {:.1} | {:.2} {} | ≤ {:.1} |",
        memory.one,
        memory.ten,
        memory.ratio.value,
        mark(memory.ratio.value <= memory.ratio.goal),
        memory.ratio.goal,
    );
    println!(
        "| the longest time of the sizes in place, by the shortest | | | {most:.2} {} | ≤ {SIZE_GOAL:.1} |\n",
        mark(most <= SIZE_GOAL)
    );
    ratios.extend(of_chain);
    ratios.push(memory.ratio);
    ratios.push(Ratio {
        what: "sizes in place".to_owned(),
        value: most,
        goal: SIZE_GOAL,
    });
    ratios.extend(proxy::run(&program, (profile, !smoke), (blocks, share))?);
    if !met(&ratios) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Measures rows in all placements in turns, and prints them. Returns of each one the ratio of the
/// first two, and the median in one process.
fn measured(
    rows: &[Row],
    sides: &mut [Placed],
    (blocks, share): (usize, f64),
) -> Result<Vec<(Ratio, f64)>, Failure> {
    let mut found: Vec<Vec<Measured>> = Vec::new();
    for block in 0..=blocks {
        // The first block warms up.
        if block <= 1 {
            found = rows.iter().map(|_| Vec::new()).collect();
        }
        for (row, found) in rows.iter().zip(&mut found) {
            let count = if is_on_hosts(row) { sides.len() } else { 2 };
            found.resize_with(count, Measured::default);
            for turn in 0..count {
                let at = (block + turn) % count;
                let before = sides[at].processor_time()?;
                found[at].times.add(sides[at].block(row, share)?);
                let used = sides[at].processor_time()?.saturating_sub(before);
                found[at].processor += used;
            }
        }
    }
    Ok(rows
        .iter()
        .zip(found)
        .map(|(row, found)| print_row(row, found))
        .collect())
}

/// Prints what was measured of a row.
fn print_row(row: &Row, mut found: Vec<Measured>) -> (Ratio, f64) {
    let medians: Vec<f64> = found
        .iter_mut()
        .map(|one| one.times.quantile(0.5))
        .collect();
    let longest: Vec<f64> = found
        .iter_mut()
        .map(|one| one.times.quantile(0.99))
        .collect();
    let value = medians[0] / medians[1];
    let hosts = match (medians.get(2), longest.get(2)) {
        (Some(p50), Some(p99)) => format!("{p50:.1} | {p99:.1}"),
        _ => "– | –".to_owned(),
    };
    println!(
        "| {} | {:.1} | {:.1} | {:.1} | {:.1} | {value:.2} {} | {:.2} | {hosts} | {} |",
        row.name,
        medians[0],
        longest[0],
        medians[1],
        longest[1],
        mark(value <= GOAL),
        found[0].processor.as_secs_f64() / found[1].processor.as_secs_f64(),
        found[0].times.len(),
    );
    let ratio = Ratio {
        what: row.name.to_string(),
        value,
        goal: GOAL,
    };
    (ratio, medians[0])
}

/// The measurements of one placement.
#[derive(Default)]
struct Measured {
    times: Times,
    processor: Duration,
}
