//! Compares two pairs of programs, measured in turns.

use crate::figure::mark;
use crate::pair::{Flood, Pair, Row, Times, quantile};
use crate::programs::Failure;
use std::time::Duration;

/// The reference implementation.
#[derive(Clone, Copy)]
pub(crate) struct Peer {
    pub(crate) name: &'static str,
    /// The goal for the ratio.
    pub(crate) goal: f64,
}

/// One row of a table of ratios.
pub(crate) struct Ratio {
    pub(crate) what: String,
    /// The time of the generated components, divided by that of the reference.
    pub(crate) value: f64,
    pub(crate) goal: f64,
}

/// Whether all goals are met.
pub(crate) fn met(ratios: &[Ratio]) -> bool {
    ratios.iter().all(|row| row.value <= row.goal)
}

/// The measurements of one pair for a row.
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

/// Measures a block of both. The first pair alternates.
fn in_turn<T>(
    block: usize,
    ours: impl FnOnce() -> Result<T, Failure>,
    theirs: impl FnOnce() -> Result<T, Failure>,
) -> Result<(T, T), Failure> {
    if block.is_multiple_of(2) {
        let ours = ours()?;
        Ok((ours, theirs()?))
    } else {
        let theirs = theirs()?;
        Ok((ours()?, theirs))
    }
}

/// Rows at full speed: name, size in bytes, values of a block.
const FLOODS: [(&str, usize, usize); 2] = [
    ("publish 64 B", 64, 20_000),
    ("publish 1 MiB", 1024 * 1024, 300),
];

impl Flood {
    fn add(&mut self, block: Self) {
        self.sent += block.sent;
        self.sending += block.sending;
        self.came += block.came;
        self.coming += block.coming;
    }

    fn columns(&self, size: usize) -> String {
        let came = self.came as f64 / self.coming;
        format!(
            "{:.0} | {came:.0} | {:.0} | {:.1} %",
            self.sent as f64 / self.sending,
            came * size as f64 / 1e6,
            100.0 * (1.0 - self.came as f64 / self.sent as f64),
        )
    }
}

/// The measurements of both pairs for a row.
#[derive(Default)]
struct Compared {
    ours: Side,
    theirs: Side,
    /// Of each block, the ratio of the medians.
    ratios: Vec<f64>,
}

impl Compared {
    /// Measures so many blocks, after one that warms up.
    fn measure(
        &mut self,
        row: &Row,
        [ours, theirs]: [&mut Pair; 2],
        blocks: usize,
        share: f64,
    ) -> Result<(), Failure> {
        let median = |mut times: Vec<i64>| quantile(&mut times, 0.5) as f64;
        for block in 0..=blocks {
            let mut warming = Self::default();
            let to = if block == 0 { &mut warming } else { &mut *self };
            let (ours, theirs) = in_turn(
                block,
                || to.ours.block(ours, row, share),
                || to.theirs.block(theirs, row, share),
            )?;
            to.ratios.push(median(ours) / median(theirs));
        }
        Ok(())
    }
}

impl Peer {
    /// Measures `rows` and prints two tables.
    pub(crate) fn table(
        self,
        rows: &[Row],
        ours: &mut Pair,
        theirs: &mut Pair,
        blocks: usize,
        share: f64,
    ) -> Result<Vec<Ratio>, Failure> {
        let mut all = Vec::new();
        for row in rows {
            let mut compared = Compared::default();
            compared.measure(row, [&mut *ours, &mut *theirs], blocks, share)?;
            all.push(compared);
        }
        Ok(self.print(rows, all))
    }

    /// [`Peer::table`] over so many starts of both pairs, each with so many blocks. Where the pages of a process lie in
    /// the caches decides how long it copies an image, and each start has others.
    pub(crate) fn table_of_starts(
        self,
        rows: &[Row],
        starts: usize,
        mut start: impl FnMut() -> Result<[Pair; 2], Failure>,
        blocks: usize,
        share: f64,
    ) -> Result<Vec<Ratio>, Failure> {
        let mut all: Vec<Compared> = rows.iter().map(|_| Compared::default()).collect();
        for _ in 0..starts {
            let mut pairs = start()?;
            for (row, compared) in rows.iter().zip(&mut all) {
                compared.measure(row, pairs.each_mut(), blocks, share)?;
            }
        }
        Ok(self.print(rows, all))
    }

    fn print(self, rows: &[Row], all: Vec<Compared>) -> Vec<Ratio> {
        let Self { name, goal } = self;
        println!(
            "| µs | generated p50 | p99 | {name} p50 | p99 | ratio at p50 (goal ≤ {goal:.2}) | middle half of the blocks | n |"
        );
        println!("|---|---|---|---|---|---|---|---|");
        let mut ratios_found = Vec::new();
        let mut processor = Vec::new();
        for (row, compared) in rows.iter().zip(all) {
            let Compared {
                ours: mut a,
                theirs: mut b,
                mut ratios,
            } = compared;
            let ratio = a.times.quantile(0.5) / b.times.quantile(0.5);
            ratios_found.push(Ratio {
                what: row.name.to_string(),
                value: ratio,
                goal,
            });
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
            processor.push((&row.name, a.processor(), b.processor()));
        }
        println!("\n| processor time a message, both programs, µs | generated | {name} | ratio |");
        println!("|---|---|---|---|");
        for (row, a, b) in processor {
            println!("| {row} | {a:.1} | {b:.1} | {:.2} |", a / b);
        }
        println!();
        ratios_found
    }

    /// Measures the throughput at full speed and prints a table. Returns the ratios.
    pub(crate) fn throughput(
        self,
        ours: &mut Pair,
        theirs: &mut Pair,
        blocks: usize,
    ) -> Result<Vec<Ratio>, Failure> {
        let Self { name, goal } = self;
        println!(
            "| sender at full speed | generated: sent/s | came/s | MB/s | lost | {name}: sent/s | came/s | MB/s | lost | time a value that came, ratio (goal ≤ {goal:.2}) | middle half of the blocks |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|");
        let mut ratios_found = Vec::new();
        for (what, size, count) in FLOODS {
            let (mut a, mut b) = (Flood::default(), Flood::default());
            let mut ratios = Vec::new();
            // The first block warms up.
            for block in 0..=blocks {
                let (ours, theirs) = in_turn(
                    block,
                    || ours.flood(size, count),
                    || theirs.flood(size, count),
                )?;
                if block > 0 {
                    let each = |flood: Flood| flood.coming / flood.came as f64;
                    ratios.push(each(ours) / each(theirs));
                    a.add(ours);
                    b.add(theirs);
                }
            }
            let ratio = quantile(&mut ratios, 0.5);
            ratios_found.push(Ratio {
                what: format!("{what}, full speed"),
                value: ratio,
                goal,
            });
            println!(
                "| {what} | {} | {} | {ratio:.2} {} | {:.2}–{:.2} |",
                a.columns(size),
                b.columns(size),
                mark(ratio <= goal),
                quantile(&mut ratios, 0.25),
                quantile(&mut ratios, 0.75),
            );
        }
        println!();
        Ok(ratios_found)
    }
}
