//! Counts the samples of a topic that a receiver lost, by the sequence numbers of their senders.

use crate::Header;

/// Number of senders that are remembered: twice as many as publish on one topic, so that there is
/// room for their successors.
const SENDERS: usize = 2 * crate::qos::MOST_PUBLISHERS;
/// A gap of more samples counts once the next sample of the sender follows it.
const DOUBTFUL: u64 = 1000;
/// No sender sends so many samples: 49 days of a sample each millisecond.
const INCREDIBLE: u64 = 1 << 32;

/// Counts the gaps in the sequences of the senders of one topic.
///
/// The first sample of a sender is not a gap, whatever its number: a late subscriber has lost
/// nothing, and a restarted sender is another one. Of many senders, the one that was silent the
/// longest is forgotten. A single wild number is ignored. Requests need no such count: their queue
/// refuses what it cannot hold, and the client gets an error.
///
/// ```
/// use rc_middleware::{Gaps, Header};
///
/// let mut gaps = Gaps::default();
/// let sample = |sequence| Header { sender: 1, sequence, ..Header::default() };
/// assert_eq!(gaps.note(&sample(4)), 0);
/// assert_eq!(gaps.note(&sample(7)), 2); // 5 and 6 are lost
/// ```
#[derive(Clone, Debug, Default)]
pub struct Gaps {
    /// The most recent sender comes first.
    heard: Vec<Sender>,
}

#[derive(Clone, Copy, Debug)]
struct Sender {
    id: u128,
    /// The number of its last sample.
    last: u64,
    /// The number of a sample since then, if it is doubtful.
    doubtful: Option<u64>,
}

impl Gaps {
    /// Notes a received sample; gives the number of samples of its sender that were lost right
    /// before it.
    pub fn note(&mut self, header: &Header) -> u64 {
        let Header {
            sender, sequence, ..
        } = *header;
        // The backend cannot distinguish senders, or the sender does not count.
        if sender == 0 || sequence == 0 {
            return 0;
        }
        let Some(at) = self.heard.iter().position(|known| known.id == sender) else {
            self.heard.truncate(SENDERS - 1);
            let new = Sender {
                id: sender,
                last: sequence,
                doubtful: None,
            };
            self.heard.insert(0, new);
            return 0;
        };
        self.heard[..=at].rotate_right(1);
        self.heard[0].note(sequence)
    }
}

impl Sender {
    fn note(&mut self, sequence: u64) -> u64 {
        // The sender has restarted if its number does not grow.
        let missing = |from: u64| sequence.saturating_sub(from).saturating_sub(1);
        let lost = missing(self.last);
        let doubtful = self.doubtful.take();
        let is_confirmed =
            doubtful.is_some_and(|before| sequence > before && missing(before) <= DOUBTFUL);
        if lost > DOUBTFUL && !is_confirmed {
            self.doubtful = Some(sequence);
            return 0;
        }
        self.last = sequence;
        if lost >= INCREDIBLE {
            return 0;
        }
        // The doubtful sample arrived, and is between them.
        lost - u64::from(is_confirmed)
    }
}

/// Counts the samples that arrived and could not be read. A backend returns an error for each.
///
/// Unreadable samples have sequence numbers, too. Without this count, the next sample would report
/// them as lost again.
#[derive(Clone, Debug, Default)]
pub struct Unread {
    /// Senders, each with its count; the newest sender comes last.
    counts: Vec<(u128, u64)>,
}

impl Unread {
    /// Counts one unreadable sample of `sender`.
    pub fn note(&mut self, sender: u128) {
        if let Some((_, count)) = self.counts.iter_mut().find(|(known, _)| *known == sender) {
            *count += 1;
            return;
        }
        if self.counts.len() == SENDERS {
            self.counts.remove(0);
        }
        self.counts.push((sender, 1));
    }

    /// Gives a readable sample its sequence number among the readable ones.
    pub fn renumber(&self, header: &mut Header) {
        let unread = self
            .counts
            .iter()
            .find(|(known, _)| *known == header.sender);
        if let Some((_, unread)) = unread
            && header.sequence != 0
        {
            header.sequence = header.sequence.saturating_sub(*unread).max(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lost(gaps: &mut Gaps, sender: u128, sequences: &[u64]) -> u64 {
        let note = |&sequence| {
            gaps.note(&Header {
                sequence,
                sender,
                ..Header::default()
            })
        };
        sequences.iter().map(note).sum()
    }

    #[test]
    fn missing_samples_are_counted() {
        let gaps = &mut Gaps::default();
        assert_eq!(lost(gaps, 1, &[7, 8, 9]), 0, "a late sample");
        assert_eq!(lost(gaps, 1, &[13, 14, 16]), 4);
        assert_eq!(lost(gaps, 1, &[1, 2]), 0, "the sender has restarted");
    }

    #[test]
    fn an_implausible_sequence_number_is_ignored() {
        let gaps = &mut Gaps::default();
        for wild in [u64::MAX, 1 << 40, 70_000, 2000] {
            assert_eq!(lost(gaps, 1, &[2, wild, 3, wild, wild, 4]), 0, "{wild}");
            // The sender may restart.
            assert_eq!(lost(gaps, 1, &[1]), 0);
        }
        // A large gap counts if consecutive samples follow it.
        assert_eq!(lost(gaps, 2, &[7, 10_007, 10_008]), 9999);
        assert_eq!(lost(gaps, 2, &[30_000, 30_010, 30_011]), 19_991 + 9);
        assert_eq!(
            lost(gaps, 3, &[7, u64::MAX - 1, u64::MAX]),
            0,
            "implausible"
        );
    }

    #[test]
    fn senders_are_counted_separately() {
        let gaps = &mut Gaps::default();
        for round in 1..10 {
            assert_eq!(lost(gaps, 1, &[round]), 0);
            assert_eq!(lost(gaps, 2, &[2 * round]), u64::from(round > 1));
            assert_eq!(lost(gaps, 3, &[0]), 0, "a sender without numbers");
            assert_eq!(lost(gaps, 0, &[9 * round]), 0, "an unknown sender");
        }
    }

    #[test]
    fn absent_senders_are_forgotten() {
        let gaps = &mut Gaps::default();
        for sender in 1..1000 {
            assert_eq!(
                lost(gaps, 7000, &[sender as u64]),
                0,
                "a known sender continues"
            );
            assert_eq!(lost(gaps, sender, &[5, 7]), 1);
            assert!(gaps.heard.len() <= SENDERS && gaps.heard.capacity() <= SENDERS);
        }
        assert_eq!(lost(gaps, 1, &[99]), 0, "a forgotten sender");
        assert_eq!(lost(gaps, 999, &[9]), 1, "a remembered sender");
    }

    #[test]
    fn unreadable_samples_do_not_count_as_lost() {
        let (gaps, unread) = (&mut Gaps::default(), &mut Unread::default());
        let mut lost = 0;
        for (sequence, readable) in [
            (1, true),
            (2, false),
            (3, true),
            (5, true),
            (6, false),
            (8, true),
        ] {
            let mut header = Header {
                sequence,
                sender: 1,
                ..Header::default()
            };
            if readable {
                unread.renumber(&mut header);
                lost += gaps.note(&header);
            } else {
                unread.note(1);
            }
        }
        assert_eq!(lost, 2, "4 and 7");
        for sender in 0..1000 {
            unread.note(sender);
            assert!(unread.counts.len() <= SENDERS);
        }
    }
}
