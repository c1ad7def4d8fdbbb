//! The queue of a topic.

use crate::endpoint_state::Backlog;
use crate::lock;
use rc_middleware::QueueGauge;
use std::collections::VecDeque;
use std::sync::Mutex;

/// Number of senders of a topic whose last sequence number is remembered.
const MOST_SENDERS: usize = 256;

/// The newest samples of a topic that were not taken yet.
#[derive(Debug)]
pub struct SampleQueue<S> {
    /// Each with its number of bytes.
    samples: Mutex<VecDeque<(usize, S)>>,
    depth: usize,
    gauge: QueueGauge,
}

impl<S> SampleQueue<S> {
    /// A queue of `depth` samples, at least one, with `limit` bytes together.
    pub fn new(depth: u32, limit: u64) -> Self {
        Self {
            samples: Mutex::new(VecDeque::new()),
            depth: (depth as usize).max(1),
            gauge: QueueGauge::new(limit),
        }
    }

    /// Gauge of the bytes and samples in the queue.
    pub fn gauge(&self) -> &QueueGauge {
        &self.gauge
    }

    /// Takes the oldest sample.
    pub fn next(&self) -> Option<S> {
        let (size, sample) = lock(&self.samples).pop_front()?;
        self.gauge.remove(size);
        Some(sample)
    }

    /// Adds a sample of `size` bytes. A full queue drops its oldest samples. A sample that is
    /// larger than the whole queue is dropped, and the result is false.
    pub fn put(&self, size: usize, sample: S) -> bool {
        let mut samples = lock(&self.samples);
        let Some(room) = self.gauge.limit().checked_sub(size as u64) else {
            self.gauge.drop_one();
            return false;
        };
        while samples.len() >= self.depth || self.gauge.bytes() > room {
            let is_full = samples.len() >= self.depth;
            let Some((size, _)) = samples.pop_front() else {
                break;
            };
            self.gauge.remove(size);
            if !is_full {
                self.gauge.drop_one();
            }
        }
        let is_room = self.gauge.add(size);
        if is_room {
            samples.push_back((size, sample));
        }
        is_room
    }
}

impl<S: Send> Backlog for SampleQueue<S> {}

/// Recognizes samples that arrive a second time.
///
/// A DDS library forgets a sender that is out of reach. When it finds the sender again, the sender
/// sends its kept samples once more.
#[derive(Debug, Default)]
pub struct DuplicateFilter(Vec<(u128, u64)>);

impl DuplicateFilter {
    /// Notes a sample, and says whether it is new. A `sequence` of 0 is always new: its sender does
    /// not count.
    pub fn is_new(&mut self, sender: u128, sequence: u64) -> bool {
        let Some(at) = self.0.iter().position(|(known, _)| *known == sender) else {
            self.0.truncate(MOST_SENDERS - 1);
            self.0.insert(0, (sender, sequence));
            return true;
        };
        self.0[..=at].rotate_right(1);
        let last = &mut self.0[0].1;
        let is_new = sequence == 0 || sequence > *last;
        *last = sequence.max(*last);
        is_new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_samples_are_not_new() {
        let mut filter = DuplicateFilter::default();
        let mut new = |sender, numbers: &[u64]| -> Vec<bool> {
            numbers.iter().map(|n| filter.is_new(sender, *n)).collect()
        };
        assert_eq!(new(1, &[7, 8, 10]), [true; 3]);
        assert_eq!(new(2, &[8, 9]), [true; 2]);
        assert_eq!(new(1, &[9, 10, 11]), [false, false, true]);
        assert_eq!(new(3, &[0, 0]), [true; 2]);
        for sender in 10..1000 {
            assert_eq!(new(sender, &[5, 4]), [true, false]);
        }
        assert_eq!(filter.0.len(), MOST_SENDERS);
    }

    #[test]
    fn old_samples_make_room_in_bytes_and_in_number() {
        let queue = SampleQueue::new(3, 100);
        for (size, sample) in [(10, 'a'), (20, 'b'), (30, 'c'), (40, 'd')] {
            queue.put(size, sample);
        }
        assert_eq!((queue.gauge().bytes(), queue.gauge().dropped()), (90, 0));
        assert!(!queue.put(101, 'e'));
        assert_eq!((queue.gauge().bytes(), queue.gauge().dropped()), (90, 1));
        queue.put(60, 'f');
        assert_eq!((queue.gauge().bytes(), queue.gauge().dropped()), (100, 2));
        queue.put(60, 'g');
        assert_eq!((queue.gauge().bytes(), queue.gauge().dropped()), (60, 4));
        assert_eq!((queue.next(), queue.next()), (Some('g'), None));
        assert_eq!(queue.gauge().bytes(), 0);
    }
}
