//! Detects steady growth of the memory of a process.
//!
//! The rule avoids false alarms. The memory is read at a fixed interval (twice a minute), and the
//! first two minutes of a run do not count. The last twenty minutes and the last five hours are
//! examined.
//!
//! The memory grows steadily if each quarter of such a time has a higher minimum than the one
//! before, by at least a tenth of the whole gain; if the gain is at least 8 MiB and a tenth of the
//! initial memory; and if the last quarter stays above everything before that time. So a single
//! step (a loaded map), a cycle (a cache), or memory that flattens out is not growth. Growth goes
//! on while the memory rises, also by less than that, and ends when it has not risen for a quarter
//! of such a time.

use std::collections::VecDeque;
use std::time::Duration;

/// Readings of a run that do not count.
const WARM_UP: u32 = 4;
/// Readings that are looked at, in four quarters.
const LENGTH: usize = 20;
/// How many readings of the process are one of these, in the shorter and in the longer time.
const STRIDES: [u32; 2] = [2, 30];
/// The least growth in bytes, and the least rise with which growth goes on.
const LEAST: u64 = 8 << 20;
const LEAST_RISE: u64 = 1 << 20;

/// The memory of one run of a process.
#[derive(Debug)]
pub(crate) struct Growth {
    seen: u32,
    series: [Series; 2],
    /// Whether the last reading belonged to growth.
    grows: bool,
}

/// The result of a reading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Growing {
    /// The memory grows steadily. The text says how.
    Grows(String),
    /// It grew, and does no longer.
    Steady,
}

impl Default for Growth {
    fn default() -> Self {
        Self {
            seen: 0,
            series: STRIDES.map(Series::new),
            grows: false,
        }
    }
}

impl Growth {
    /// Takes a reading in bytes, `pause` after the last one. Returns a change: growth with its
    /// present figures, or its end.
    pub(crate) fn sample(&mut self, bytes: u64, pause: Duration) -> Option<Growing> {
        self.seen = self.seen.saturating_add(1);
        if self.seen <= WARM_UP {
            return None;
        }
        let mut text = None;
        for series in &mut self.series {
            if series.push(bytes)
                && let Some((from, to)) = series.rise().filter(|_| series.grows())
            {
                let time = pause * series.stride * LENGTH as u32;
                text = Some(format!(
                    "its memory grows steadily: from {} to {} MiB within {}",
                    from >> 20,
                    to >> 20,
                    in_words(time)
                ));
            }
        }
        let grew = self.grows;
        self.grows = self.series.iter().any(Series::grows);
        match text {
            Some(text) => Some(Growing::Grows(text)),
            None => (grew && !self.grows).then_some(Growing::Steady),
        }
    }
}

fn in_words(time: Duration) -> String {
    match time.as_secs() {
        0..=119 => format!("{:.1} s", time.as_secs_f64()),
        seconds => format!("{} minutes", seconds / 60),
    }
}

#[derive(Debug)]
struct Series {
    stride: u32,
    /// Readings since the last one that was kept, the least and the most of them.
    taken: u32,
    range: (u64, u64),
    kept: VecDeque<(u64, u64)>,
    /// The most that there ever was before those that are kept.
    most: u64,
    /// How many more values without a rise end the growth; 0 if there is none.
    lasting: usize,
}

impl Series {
    fn new(stride: u32) -> Self {
        Self {
            stride,
            taken: 0,
            range: (u64::MAX, 0),
            kept: VecDeque::new(),
            most: 0,
            lasting: 0,
        }
    }

    /// Takes a reading. Returns whether there is a new value to evaluate.
    fn push(&mut self, bytes: u64) -> bool {
        self.taken += 1;
        self.range = (self.range.0.min(bytes), self.range.1.max(bytes));
        if self.taken < self.stride {
            return false;
        }
        if self.kept.len() == LENGTH {
            let (_, most) = self.kept.pop_front().unwrap_or_default();
            self.most = self.most.max(most);
        }
        self.kept.push_back(self.range);
        (self.taken, self.range) = (0, (u64::MAX, 0));
        let rise = self.rise();
        let enough = |(first, last): (u64, u64)| last - first >= LEAST.max(first / 10);
        self.lasting = match rise {
            Some(rise) if self.lasting > 0 || enough(rise) => LENGTH / 4,
            _ => self.lasting.saturating_sub(1),
        };
        true
    }

    /// Whether the memory grows steadily, or did within the last quarter.
    fn grows(&self) -> bool {
        self.lasting > 0
    }

    /// The first and the last value, if the memory has risen steadily.
    fn rise(&self) -> Option<(u64, u64)> {
        if self.kept.len() < LENGTH {
            return None;
        }
        let quarter = |at: usize| {
            let from = at * LENGTH / 4;
            let readings = self.kept.range(from..from + LENGTH / 4);
            readings.map(|(least, _)| *least).min().unwrap_or(0)
        };
        let (first, last) = (quarter(0), quarter(3));
        let gained = last.saturating_sub(first);
        let step = |at: usize| quarter(at + 1).saturating_sub(quarter(at));
        let steady = (0..3).all(|at| step(at) >= gained / 10);
        (steady && gained >= LEAST_RISE && last > self.most).then_some((first, last))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The readings at which growth begins and ends, of a process with so many MiB at each.
    fn reported(readings: impl IntoIterator<Item = u64>) -> Vec<usize> {
        let mut growth = Growth::default();
        let pause = Duration::from_secs(30);
        let mut grows = false;
        let mut changes = |bytes| {
            let now = growth.sample(bytes, pause)?;
            let before = std::mem::replace(&mut grows, now != Growing::Steady);
            (before != grows).then_some(())
        };
        let readings = readings.into_iter().enumerate();
        readings
            .filter_map(|(at, mib)| changes(mib << 20).map(|()| at))
            .collect()
    }

    #[test]
    fn a_leak_is_reported_until_it_ends() {
        // 100 MiB, and one more at each reading.
        let leak = |end: u64| reported((0..3000).map(|at| 100 + at.min(end)));
        assert_eq!(leak(3000), [43]);
        let ended = leak(300);
        assert_eq!((ended[0], ended.len()), (43, 2), "{ended:?}");
        assert!((300..400).contains(&ended[1]), "{ended:?}");
        let back = reported((0..1000).map(|at| if at < 300 { 100 + at } else { 50 }));
        assert!((300..350).contains(&back[1]), "{back:?}");
    }

    #[test]
    fn a_slow_leak_is_detected_within_hours() {
        // 1 MiB in 25 minutes.
        let leak = reported((0..700).map(|at| 50 + at / 50));
        assert_eq!(leak.len(), 1, "{leak:?}");
    }

    #[test]
    fn steady_and_fluctuating_memory_is_not_reported() {
        let start = reported((0..2000).map(|at| (10 * at).min(40)));
        assert_eq!(start, [0; 0], "memory that is taken at the start");
        let step = reported((0..2000).map(|at| if at < 500 { 50 } else { 500 }));
        assert_eq!(step, [0; 0], "a map that is loaded");
        let saw = reported((0..2000).map(|at| 50 + 3 * (at % 17)));
        assert_eq!(saw, [0; 0], "a cache that is emptied");
        let steps = reported((0..2000).map(|at| 50 + 2 * (at % 100) / 90 * 40));
        assert_eq!(steps, [0; 0], "a job that comes and goes");
        let flat = reported((0..2000_u64).map(|at| 1000 + at % 7));
        assert_eq!(flat, [0; 0], "the noise of a large program");
    }

    /// Whether growth is reported for a process with this much memory in MiB before the evaluated
    /// time, if it ran that long, and in each quarter of it.
    fn grows(before: Option<u64>, quarters: [u64; 4]) -> bool {
        let ten = |mib: u64| std::iter::repeat_n(mib, 10);
        let start = std::iter::repeat_n(before.unwrap_or(0), WARM_UP as usize);
        let run = before.into_iter().chain(quarters).flat_map(ten);
        !reported(start.chain(run)).is_empty()
    }

    #[test]
    fn the_gain_is_at_least_eight_mib_and_a_tenth() {
        assert!(grows(None, [10, 13, 16, 18]));
        assert!(!grows(None, [10, 13, 16, 17]));
        assert!(grows(None, [100, 103, 106, 110]));
        assert!(!grows(None, [100, 103, 106, 109]));
    }

    #[test]
    fn each_quarter_has_a_tenth_of_the_gain() {
        assert!(grows(None, [100, 102, 110, 120]));
        for stalled in [
            [100, 101, 110, 120],
            [100, 110, 111, 120],
            [100, 110, 119, 120],
            [100, 130, 110, 120],
        ] {
            assert!(!grows(None, stalled), "{stalled:?}");
        }
    }

    #[test]
    fn memory_that_a_process_had_before_is_no_growth() {
        assert!(grows(Some(119), [100, 103, 106, 120]));
        assert!(!grows(Some(120), [100, 103, 106, 120]));
    }

    #[test]
    fn the_message_says_how_much_within_which_time() {
        let message = |pause| {
            let mut growth = Growth::default();
            let pause = Duration::from_millis(pause);
            let mut all = (100..200).filter_map(|mib: u64| growth.sample(mib << 20, pause));
            match all.next() {
                Some(Growing::Grows(text)) => text,
                other => panic!("{other:?}"),
            }
        };
        let text = "its memory grows steadily: from 104 to 134 MiB within";
        assert_eq!(message(30_000), format!("{text} 20 minutes"));
        assert_eq!(message(3000), format!("{text} 2 minutes"));
        assert_eq!(message(20), format!("{text} 0.8 s"));
    }
}
