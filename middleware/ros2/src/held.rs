//! Samples whose writer is not known yet. The library hands them over before the thread that
//! listens has added the writer, and without the writer nobody knows whether the types match.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Longest time that a sample of an unknown writer is held. Then its writer counts as one of
/// another program.
pub(crate) const UNKNOWN: Duration = Duration::from_millis(20);

/// Samples of unknown writers, in the order in which they arrived.
pub(crate) struct Held<S> {
    samples: VecDeque<(Instant, S)>,
    depth: usize,
}

impl<S> Held<S> {
    /// Room for `depth` samples, at least one.
    pub(crate) fn new(depth: u32) -> Self {
        Self {
            samples: VecDeque::new(),
            depth: (depth as usize).max(1),
        }
    }

    /// Holds a sample from now on. Where there is no room, the oldest sample is dropped.
    pub(crate) fn put(&mut self, sample: S) {
        if self.samples.len() >= self.depth {
            self.samples.pop_front();
        }
        self.samples.push_back((Instant::now(), sample));
    }

    /// Takes the first sample that is known by now, or that was held for as long as it may be.
    pub(crate) fn take(&mut self, is_known: impl Fn(&S) -> bool) -> Option<S> {
        let mut samples = self.samples.iter();
        let at = samples.position(|(since, s)| since.elapsed() >= UNKNOWN || is_known(s))?;
        self.samples.remove(at).map(|(_, sample)| sample)
    }

    /// Whether it holds a sample for which `condition` is true.
    pub(crate) fn has(&self, condition: impl Fn(&S) -> bool) -> bool {
        self.samples.iter().any(|(_, sample)| condition(sample))
    }

    /// Whether it holds nothing.
    pub(crate) fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_held_until_its_writer_is_known_or_for_a_short_time() {
        let mut held = Held::new(3);
        let nobody = |_: &(char, u8)| false;
        for sample in [('a', 1), ('b', 1), ('a', 2), ('a', 3)] {
            held.put(sample);
        }
        assert!(held.has(|(writer, _)| *writer == 'b') && !held.has(|sample| *sample == ('a', 1)));
        assert_eq!(held.take(nobody), None);
        assert_eq!(held.take(|(writer, _)| *writer == 'a'), Some(('a', 2)));
        assert_eq!(held.take(nobody), None);
        std::thread::sleep(UNKNOWN);
        assert_eq!(held.take(nobody), Some(('b', 1)));
        assert_eq!(held.take(nobody), Some(('a', 3)));
        assert!(held.is_empty());
    }
}
