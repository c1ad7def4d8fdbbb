//! Durations of tests, from the output of the stable test harness.
//!
//! The harness prints a line when a test ends and nothing when it begins. It starts tests in the
//! order of their names, as many at a time as there are threads, and the next one whenever one
//! ends. So the start of each test is known: it is that of the program, or the end of an earlier
//! test.

use std::time::Duration;

/// One test that has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Timing {
    pub(crate) name: String,
    pub(crate) took: Duration,
}

/// Collects the durations of the tests of all programs of a run.
#[derive(Debug)]
pub(crate) struct Timings {
    threads: usize,
    began: Duration,
    ended: Vec<(String, Duration)>,
    all: Vec<Timing>,
}

impl Timings {
    /// `threads` is the number of tests that run at a time.
    pub(crate) fn new(threads: usize) -> Self {
        Self {
            threads: threads.max(1),
            began: Duration::ZERO,
            ended: Vec::new(),
            all: Vec::new(),
        }
    }

    /// Reads a line that the harness prints `now`.
    pub(crate) fn note(&mut self, line: &str, now: Duration) {
        if line.starts_with("running ") && line.contains(" test") {
            self.finish();
            self.began = now;
        } else if let Some((name, outcome)) = line
            .strip_prefix("test ")
            .and_then(|rest| rest.rsplit_once(" ... "))
            && outcome != "ignored"
        {
            self.ended.push((name.to_owned(), now));
        }
    }

    /// Ends a program, so that the order in which its tests began is known.
    pub(crate) fn finish(&mut self) {
        let mut names: Vec<&String> = self.ended.iter().map(|(name, _)| name).collect();
        names.sort_unstable();
        for (name, end) in &self.ended {
            let place = names.binary_search(&name).unwrap_or_default();
            // The test began when there was a free thread: that of the test that ended `threads`
            // places before.
            let begin = match place.checked_sub(self.threads) {
                Some(earlier) => self.ended[earlier].1,
                None => self.began,
            };
            self.all.push(Timing {
                name: name.clone(),
                took: end.saturating_sub(begin),
            });
        }
        self.ended.clear();
    }

    /// The `count` tests that took longest.
    pub(crate) fn slowest(&self, count: usize) -> Vec<Timing> {
        let mut all = self.all.clone();
        all.sort_by_key(|timing| std::cmp::Reverse(timing.took));
        all.truncate(count);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_begin_in_order_of_their_names_when_a_thread_is_free() {
        let mut timings = Timings::new(2);
        let at = Duration::from_secs;
        timings.note("running 4 tests", at(10));
        timings.note("test b ... ok", at(11));
        timings.note("test c ... FAILED", at(14));
        timings.note("test z ... ignored", at(14));
        timings.note("test a ... ok", at(15));
        timings.note("test d ... ok", at(20));
        timings.note("running 1 test", at(30));
        timings.note("test e::f ... ok", at(33));
        timings.finish();
        let slowest: Vec<_> = timings.slowest(4);
        let expected = [("d", 6), ("a", 5), ("c", 3), ("e::f", 3)];
        assert_eq!(
            slowest,
            expected.map(|(name, seconds)| Timing {
                name: name.to_owned(),
                took: at(seconds)
            })
        );
    }
}
