//! Two pairs of programs that do the same, measured in turns.

use crate::bench::mark;
use crate::pair::{Pair, Row, Times, quantile};
use crate::programs::Failure;
use std::time::Duration;

/// Whom the generated components are compared with.
#[derive(Clone, Copy)]
pub(crate) struct Peer {
    pub(crate) name: &'static str,
    /// At p50 a generated component may take so many times what the peer takes.
    pub(crate) goal: f64,
}

/// What one side took for a row.
#[derive(Default)]
struct Side {
    times: Times,
    processor: Duration,
}

impl Side {
    fn block(&mut self, pair: &mut Pair, row: &Row, share: f64) -> Result<Vec<i64>, Failure> {
        let before = pair.processor_time()?;
        let times = pair.block(row, share)?;
        self.processor += pair.processor_time()?.saturating_sub(before);
        self.times.add(times.clone());
        Ok(times)
    }

    /// Microseconds of processor time a message, of both programs together.
    fn processor(&self) -> f64 {
        self.processor.as_secs_f64() * 1e6 / self.times.len() as f64
    }
}

impl Peer {
    /// Measures `rows` and prints two tables; says whether all goals are met.
    pub(crate) fn table(
        self,
        rows: &[Row],
        ours: &mut Pair,
        theirs: &mut Pair,
        blocks: usize,
        share: f64,
    ) -> Result<bool, Failure> {
        let Self { name, goal } = self;
        println!(
            "| µs | generated p50 | p99 | {name} p50 | p99 | ratio at p50 (goal ≤ {goal:.2}) | middle half of the blocks | n |"
        );
        println!("|---|---|---|---|---|---|---|---|");
        let mut met = true;
        let mut processor = Vec::new();
        for row in rows {
            let (mut a, mut b) = (Side::default(), Side::default());
            let mut ratios = Vec::new();
            for block in 0..=blocks {
                // The first block warms up.
                if block == 1 {
                    (a, b) = (Side::default(), Side::default());
                    ratios.clear();
                }
                // Who goes first changes, too.
                let (ours, theirs) = if block % 2 == 0 {
                    let ours = a.block(ours, row, share)?;
                    (ours, b.block(theirs, row, share)?)
                } else {
                    let theirs = b.block(theirs, row, share)?;
                    (a.block(ours, row, share)?, theirs)
                };
                let median = |mut times: Vec<i64>| quantile(&mut times, 0.5) as f64;
                ratios.push(median(ours) / median(theirs));
            }
            let ratio = a.times.quantile(0.5) / b.times.quantile(0.5);
            met &= ratio <= goal;
            println!(
                "| {} | {:.1} | {:.1} | {:.1} | {:.1} | {ratio:.2} {} | {:.2}–{:.2} | {} |",
                row.name,
                a.times.quantile(0.5),
                a.times.quantile(0.99),
                b.times.quantile(0.5),
                b.times.quantile(0.99),
                mark(ratio <= goal),
                quantile(&mut ratios, 0.25),
                quantile(&mut ratios, 0.75),
                a.times.len(),
            );
            processor.push((row.name, a.processor(), b.processor()));
        }
        println!("\n| processor time a message, both programs, µs | generated | {name} | ratio |");
        println!("|---|---|---|---|");
        for (row, a, b) in processor {
            println!("| {row} | {a:.1} | {b:.1} | {:.2} |", a / b);
        }
        println!();
        Ok(met)
    }
}
