//! The messages on their way to one component of a chain.

use super::join::JoinedHop;
use std::collections::{HashMap, VecDeque};

/// Most messages that are remembered on their way to one component.
pub(super) const MOST_OPEN: usize = 20_000;

/// A sender and the number of its message.
pub(super) type Key = (u32, u32);

/// The way of a message until now.
#[derive(Clone, Debug)]
pub(super) struct Trace {
    /// When the first message was sent.
    pub(super) began: i64,
    /// For each component that it has passed: on the way, until the reaction, in the reaction.
    pub(super) parts: Vec<[i64; 3]>,
    /// Whether no component on the way has used it twice.
    pub(super) is_first: bool,
}

/// A message on its way to a component, or in it.
#[derive(Debug)]
pub(super) struct Open {
    pub(super) trace: Trace,
    pub(super) left: i64,
    pub(super) has_arrived: bool,
    pub(super) is_used: bool,
}

/// The stamps of messages to programs outside.
#[derive(Debug, Default)]
pub(super) struct Stamps {
    pub(super) keys: HashMap<u64, Key>,
    /// When each was sent, in this order.
    pub(super) order: VecDeque<(i64, u64, Key)>,
    /// Whether the newest message has none.
    pub(super) lacks_newest: bool,
}

impl Stamps {
    /// Forgets the oldest message.
    pub(super) fn forget(&mut self) {
        // A later message may have the same stamp.
        if let Some((_, stamp, key)) = self.order.pop_front()
            && self.keys.get(&stamp) == Some(&key)
        {
            self.keys.remove(&stamp);
        }
    }

    /// Whether a stamp is younger than that of the newest message which was sent until then.
    pub(super) fn are_older_than(&self, stamp: u64, until: i64) -> bool {
        let sent = self.order.partition_point(|(left, ..)| *left <= until);
        let newest = sent
            .checked_sub(1)
            .and_then(|newest| self.order.get(newest));
        newest.is_some_and(|(_, known, _)| *known < stamp)
    }
}

/// The messages to one component.
#[derive(Debug, Default)]
pub(super) struct Stage {
    pub(super) open: HashMap<Key, Open>,
    /// The order in which they were sent.
    pub(super) order: VecDeque<(i64, Key)>,
    /// Hops whose message is not known yet: the sender is asked after the receiver.
    pub(super) early: VecDeque<JoinedHop>,
    /// For each identity of a sender, the sender that it belongs to. `None`: any sender begins the
    /// chain.
    pub(super) senders: Option<HashMap<u32, u32>>,
    /// Behind programs outside, stamps in place of senders and their numbers.
    pub(super) stamps: Option<Stamps>,
    /// The newest message that has arrived from each sender, and its time.
    pub(super) newest: HashMap<u32, (u32, i64)>,
    /// When the first message was sent after the last one that arrived, and how many were.
    pub(super) waits_since: Option<i64>,
    pub(super) waiting: u64,
}

impl Stage {
    /// Keeps the records of a message that is not known yet.
    pub(super) fn wait(&mut self, noted: JoinedHop) {
        if self.early.len() < MOST_OPEN {
            self.early.push_back(noted);
        }
    }

    /// Why messages behind programs outside are not those that were sent to them: `sent` and `input`
    /// are these messages.
    pub(super) fn fault_of_stamps(&self, sent: &str, input: &str) -> Option<String> {
        let noted = self.early.back();
        if self.stamps.as_ref()?.lacks_newest {
            return Some(format!(
                "cannot be followed: `{sent}` is sent with the stamp 0, which its sender has to set"
            ));
        }
        if noted.is_some_and(|noted| noted.stamp == 0) {
            return Some(format!(
                "receives {input} with the stamp 0: a program outside does not copy the stamp"
            ));
        }
        noted.filter(|noted| self.is_restamped(noted)).map(|_| {
            format!(
                "receives {input} with stamps that are younger than those of all messages sent: a program outside does not copy the stamp"
            )
        })
    }

    /// Whether a message has a stamp that no message to the programs outside had, and that is younger.
    pub(super) fn is_restamped(&self, noted: &JoinedHop) -> bool {
        let stamps = self.stamps.as_ref();
        stamps.is_some_and(|stamps| {
            noted.stamp > 0
                && !stamps.keys.contains_key(&noted.stamp)
                && stamps.are_older_than(noted.stamp, noted.begun)
        })
    }
}
