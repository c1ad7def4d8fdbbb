//! Queue of messages to a client.

use std::collections::VecDeque;
use tungstenite::Message;

/// How many bytes of messages of channels wait for a client; the oldest are dropped first.
const SAMPLES: usize = 32 << 20;
/// How many bytes of other messages wait for a client before it is closed.
const CONTROL: usize = 32 << 20;
/// Memory of an entry in addition to its bytes: its place here, and its allocation.
const ENTRY: usize = 128;

/// Messages of channels, and others. The others go first, and none of them is dropped.
#[derive(Default)]
pub(crate) struct Queue {
    samples: Messages,
    control: Messages,
}

/// The client asks and does not read.
#[derive(Debug, PartialEq)]
pub(crate) struct Full;

impl Queue {
    /// Appends a message that is none of a channel.
    pub(crate) fn control(&mut self, message: Message) -> Result<(), Full> {
        if self.control.bytes + cost(&message) > CONTROL {
            return Err(Full);
        }
        self.control.push(message);
        Ok(())
    }

    /// Appends a message of a channel. Returns how many were dropped for want of room.
    pub(crate) fn sample(&mut self, message: Message) -> u64 {
        if cost(&message) > SAMPLES {
            return 1;
        }
        self.samples.push(message);
        let mut dropped = 0;
        while self.samples.bytes > SAMPLES && self.samples.pop().is_some() {
            dropped += 1;
        }
        dropped
    }

    /// Takes the next message.
    pub(crate) fn pop(&mut self) -> Option<Message> {
        self.control.pop().or_else(|| self.samples.pop())
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.control.waiting.is_empty() && self.samples.waiting.is_empty()
    }
}

#[derive(Default)]
struct Messages {
    waiting: VecDeque<Message>,
    bytes: usize,
}

impl Messages {
    fn push(&mut self, message: Message) {
        self.bytes += cost(&message);
        self.waiting.push_back(message);
    }

    fn pop(&mut self) -> Option<Message> {
        let message = self.waiting.pop_front()?;
        self.bytes -= cost(&message);
        Some(message)
    }
}

fn cost(message: &Message) -> usize {
    message.len() + ENTRY
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(number: u32) -> Message {
        Message::binary(number.to_le_bytes().to_vec())
    }

    #[test]
    fn small_messages_take_more_than_their_bytes() {
        let mut queue = Queue::default();
        let most = SAMPLES / (4 + ENTRY);
        let dropped: u64 = (0..2 * most as u32)
            .map(|n| queue.sample(numbered(n)))
            .sum();
        assert_eq!(dropped, most as u64);
        // The oldest are those that went.
        assert_eq!(queue.pop(), Some(numbered(most as u32)));
        let mut control = 0;
        while queue.control(Message::text("")).is_ok() {
            control += 1;
        }
        assert_eq!(control, CONTROL / ENTRY);
        assert_eq!(queue.pop(), Some(Message::text("")));
        assert_eq!(queue.control(Message::text("")), Ok(()));
    }

    #[test]
    fn other_messages_overtake_those_of_channels() {
        let mut queue = Queue::default();
        assert_eq!(queue.sample(Message::binary(vec![0; SAMPLES])), 1);
        assert!(queue.is_empty());
        queue.sample(numbered(1));
        queue.sample(numbered(2));
        queue.control(Message::text("first")).expect("room");
        let all: Vec<Message> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(all, [Message::text("first"), numbered(1), numbered(2)]);
    }
}
