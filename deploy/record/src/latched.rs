//! Values that hold until others follow: states, parameters, and the last samples of latched topics.

use crate::content::OVERHEAD;
use crate::reader::Message;
use std::collections::BTreeMap;

/// The most bytes of values that are kept.
const MOST: usize = 64 << 20;

/// The last message of each latched channel.
#[derive(Default)]
pub(crate) struct Latched {
    messages: BTreeMap<u32, Message>,
    held: usize,
}

impl Latched {
    /// Keeps a message instead of the one before, if there is room for it.
    pub(crate) fn keep(&mut self, message: Message) {
        if let Some(before) = self.messages.remove(&message.channel.id) {
            self.held -= before.data.len() + OVERHEAD;
        }
        let size = message.data.len() + OVERHEAD;
        if self.held + size <= MOST {
            self.held += size;
            self.messages.insert(message.channel.id, message);
        }
    }

    /// Takes all messages, as if they were recorded at this time. Their times of sending stay.
    pub(crate) fn take(&mut self, time: u64) -> impl Iterator<Item = Message> {
        self.held = 0;
        let messages = std::mem::take(&mut self.messages);
        messages.into_values().map(move |message| Message {
            log_time: time,
            ..message
        })
    }
}
