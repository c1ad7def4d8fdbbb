//! The state of the protocol of replicas.

use crate::answers::Answers;
use crate::content::Content;
use crate::counts::Counts;
use crate::digest::{self, Digests};
use crate::gaps::Gaps;
use crate::message::{MOST_CHUNK, Message};
use crate::peers::Peers;
use crate::streams::Sample;
use crate::wire;
use graph_merge::Change;
use graph_schema::Schema;
use property_graph::Time;
use rc_diagnostics::foreign;
use std::collections::VecDeque;
use std::time::Duration;

/// How many bytes wait at most to be sent.
const MOST_QUEUED: usize = 16 << 20;
/// How far the time of a change may be ahead of the clock of a receiver.
const AHEAD: Duration = Duration::from_secs(1);

/// The state of the protocol.
pub(crate) struct Protocol {
    pub(crate) writer: u64,
    pub(crate) name: String,
    pub(crate) schema: u64,
    /// How many bytes an answer has at most.
    pub(crate) most_answer: usize,
    pub(crate) digests: Digests,
    pub(crate) peers: Peers,
    pub(crate) answers: Answers,
    pub(crate) gaps: Gaps,
    pub(crate) counts: Counts,
    pub(crate) outbox_bytes: usize,
    pub(crate) outbox: VecDeque<Message>,
    pub(crate) next_digest: Duration,
    /// When it last announced its state.
    pub(crate) told: Option<Duration>,
    /// When to look for something to ask.
    pub(crate) ask_at: Option<Duration>,
    /// The time of the last change, for samples of streams.
    pub(crate) stream_time: Time,
    pub(crate) started: Option<Duration>,
    pub(crate) has_joined: bool,
    pub(crate) has_left: bool,
    pub(crate) ticks: u64,
}

impl Protocol {
    pub(crate) fn new(writer: u64, name: String, schema: &Schema, most_answer: usize) -> Self {
        Self {
            writer,
            name,
            schema: digest::of_schema(schema),
            most_answer,
            digests: Digests::default(),
            peers: Peers::default(),
            answers: Answers::default(),
            gaps: Gaps::default(),
            counts: Counts::default(),
            outbox_bytes: 0,
            outbox: VecDeque::new(),
            next_digest: Duration::ZERO,
            told: None,
            ask_at: None,
            stream_time: Time::ZERO,
            started: None,
            has_joined: false,
            has_left: false,
            ticks: 0,
        }
    }

    /// Whether there is room for the requests of others.
    pub(crate) fn has_room(&self) -> bool {
        self.outbox_bytes < MOST_QUEUED / 2
    }

    pub(crate) fn send(&mut self, message: Content) {
        let message = Message(message);
        self.outbox_bytes += message.size();
        self.outbox.push_back(message);
        // Digests repair dropped messages.
        while self.outbox_bytes > MOST_QUEUED {
            let Some(dropped) = self.outbox.pop_front() else {
                break;
            };
            self.outbox_bytes = self.outbox_bytes.saturating_sub(dropped.size());
            self.counts.dropped += 1;
        }
    }

    /// Sends a change, or announces it if it is too large for one message.
    pub(crate) fn send_change(&mut self, time: Time, change: Change) {
        self.counts.made += 1;
        if wire::size(&change.records) > MOST_CHUNK {
            self.next_digest = Duration::ZERO;
            return;
        }
        let schema = self.schema;
        self.send(Content::Change {
            schema,
            time,
            change,
        });
    }

    pub(crate) fn send_samples(&mut self, samples: Vec<Sample>) {
        let mut rest = samples.into_iter().peekable();
        while rest.peek().is_some() {
            let (mut part, mut bytes) = (Vec::new(), 0);
            while let Some(sample) = rest.next_if(|_| bytes < MOST_CHUNK / 2) {
                bytes += 64 + sample.name.len() + sample.value.size();
                part.push(sample);
            }
            self.counts.samples_sent += part.len() as u64;
            self.send(Content::Samples {
                schema: self.schema,
                sender: self.writer,
                time: self.stream_time,
                samples: part,
            });
        }
    }

    /// Looks for something to ask at this time, or earlier.
    pub(crate) fn ask_by(&mut self, at: Duration) {
        self.ask_at = Some(self.ask_at.map_or(at, |known| known.min(at)));
    }

    pub(crate) fn refuse(&mut self, reason: &str) {
        self.counts.refused += 1;
        let reason: String = reason.chars().take(256).collect();
        self.counts.last_refusal = foreign::clean(&reason);
    }
}

/// The time of a change of another replica, not before the present version and at most slightly
/// ahead of this clock. If this clock was set back, it counts.
pub(crate) fn between(made: Time, present: Time, now: Time) -> Time {
    let last = now.saturating_add(AHEAD);
    if present > last {
        return now;
    }
    made.clamp(present, last)
}
