//! Replicas of which a listener hears later than of the others. If the network was started again, they are of
//! another run, whose world is another one: their messages wait until that is known.

use rc_world::Message;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

/// How many bytes of messages wait at most. The replica asks for what it lacks.
const MOST_HELD: usize = 4 << 20;
/// How many newcomers are known at most.
const MOST: usize = 1024;

/// The messages of newcomers.
#[derive(Default)]
pub(super) struct Newcomers {
    /// The replicas of this run; none while all are taken.
    known: Option<BTreeSet<u64>>,
    heard: BTreeSet<u64>,
    /// The others, and when each was heard first.
    waiting: BTreeMap<u64, Instant>,
    /// The sender of each, and its bytes.
    held: Vec<(u64, Message, usize)>,
    bytes: usize,
    are_new: bool,
}

impl Newcomers {
    /// From now on, replicas that were not heard so far are newcomers.
    pub(super) fn hold(&mut self) {
        self.known = Some(std::mem::take(&mut self.heard));
    }

    /// Gives a message back unless it is of a newcomer.
    pub(super) fn pass(
        &mut self,
        sender: Option<u64>,
        message: Message,
        bytes: usize,
    ) -> Option<Message> {
        let Some(sender) = sender else {
            return Some(message);
        };
        let Some(known) = &self.known else {
            if self.heard.len() < MOST {
                self.heard.insert(sender);
            }
            return Some(message);
        };
        if known.contains(&sender) {
            return Some(message);
        }
        if !self.waiting.contains_key(&sender) && self.waiting.len() < MOST {
            self.waiting.insert(sender, Instant::now());
            self.are_new = true;
        }
        if self.bytes + bytes <= MOST_HELD {
            self.bytes += bytes;
            self.held.push((sender, message, bytes));
        }
        None
    }

    /// Whether one has come since the last call.
    pub(super) fn are_new(&mut self) -> bool {
        std::mem::take(&mut self.are_new)
    }

    /// The messages of newcomers that were heard before a time, which are none any more.
    pub(super) fn accept(&mut self, before: Instant) -> Vec<Message> {
        let Some(known) = &mut self.known else {
            return Vec::new();
        };
        let accepted = self.waiting.extract_if(.., |_, heard| *heard < before);
        known.extend(accepted.map(|(sender, _)| sender));
        let is_known = |held: &mut (u64, Message, usize)| known.contains(&held.0);
        let passed = self.held.extract_if(.., is_known);
        let passed = passed.map(|(_, message, bytes)| {
            self.bytes = self.bytes.saturating_sub(bytes);
            message
        });
        passed.collect()
    }
}
