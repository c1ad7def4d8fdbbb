//! How long a step of a state machine takes: the interpreter of components, and the crate `statig`
//! with the same machines. Prints a row for each machine.

mod charts;
mod theirs;

use charts::Ours;
use std::hint::black_box;
use std::time::Instant;

/// Steps of a block, and the blocks of each machine, measured in turns.
const STEPS: u32 = 20_000;
const BLOCKS: usize = 41;

/// A machine under measurement.
pub(crate) trait Stepped {
    /// Handles one event, which changes states.
    fn step(&mut self);
    /// The number of entries of states so far.
    fn entries(&self) -> u64;
}

/// The time of a step in one block, in ns.
fn block(machine: &mut dyn Stepped) -> f64 {
    let start = Instant::now();
    for _ in 0..STEPS {
        black_box(&mut *machine).step();
    }
    start.elapsed().as_nanos() as f64 / f64::from(STEPS)
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() {
    let rows: [(&str, f64, Ours, Box<dyn Stepped>); 3] = [
        (
            "flat, 20 states",
            200.0,
            charts::flat(),
            Box::new(theirs::Flat::new()),
        ),
        (
            "two regions, five levels deep, innermost states",
            1000.0,
            charts::nested(false),
            Box::new(theirs::Nested::new(false)),
        ),
        (
            "two regions, five levels deep, all levels",
            1000.0,
            charts::nested(true),
            Box::new(theirs::Nested::new(true)),
        ),
    ];
    println!("| a step, ns | goal | components | statig | states entered |\n|---|---|---|---|---|");
    let mut met = true;
    for (what, goal, mut ours, mut theirs) in rows {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        for _ in 0..BLOCKS {
            a.push(block(&mut ours));
            b.push(block(&mut *theirs));
        }
        let steps = BLOCKS as u64 * u64::from(STEPS);
        let (entered, same) = (ours.entries() / steps, theirs.entries() / steps);
        assert_eq!(entered, same, "{what}: both do the same");
        let (a, b) = (median(a), median(b));
        met &= a < goal;
        println!("| {what} | < {goal:.0} | {a:.0} | {b:.0} | {entered} |");
    }
    if !met {
        eprintln!("bench_machine: a goal was missed");
        std::process::exit(3);
    }
}
