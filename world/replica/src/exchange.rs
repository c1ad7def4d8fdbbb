//! The messages of replicas, and their times. Each announces its state once a second; one that
//! lacks something asks one that has it, and gets it in chunks.

use crate::answers::Question;
use crate::check::Check;
use crate::content::{Content, DigestOf};
use crate::core::Core;
use crate::message::Message;
use crate::overruled;
use crate::protocol::between;
use crate::streams::Sample;
use crate::token::Token;
use graph_merge::{Change, Delta, Reason};
use property_graph::{Graph, Id, Time};
use std::collections::BTreeSet;
use std::time::Duration;

/// How often a replica announces its state.
const PERIOD: Duration = Duration::from_secs(1);
/// How long a replica waits for what is late before it asks.
const PATIENCE: Duration = Duration::from_millis(30);
/// Before that time, a replica has not joined: one that has everything may not have announced
/// itself yet.
const JOINING: Duration = Duration::from_millis(2500);
/// A replica that comes is told at once by one of the others, and by each further one so much later.
const RANK: Duration = Duration::from_millis(2);
/// The last of the others tell it together.
const MOST_RANKS: usize = 15;
/// So long after an announcement, a replica makes no other one for those that come.
const ALL_RANKS: Duration = Duration::from_millis(30);
/// How many edges a replica removes at once: a message holds them.
const MOST_TIDIED: usize = 256;

impl Core {
    pub(crate) fn take(&mut self) -> Option<Message> {
        let message = self.protocol.outbox.pop_front()?;
        let left = self.protocol.outbox_bytes;
        self.protocol.outbox_bytes = left.saturating_sub(message.size());
        Some(message)
    }

    /// Whether another replica has something that this one lacks.
    pub(crate) fn lacks(&self) -> bool {
        let mut live = self.protocol.peers.live();
        live.any(|(_, peer)| peer.has_more(self.replica.seen()) || !peer.wrong_ranges.is_empty())
    }

    /// Whether this replica has the changes that others announce, except those that announce more
    /// than their answers bring.
    fn has_answers(&self) -> bool {
        let mut live = self.protocol.peers.live();
        live.all(|(_, peer)| {
            !peer.is_useful() || !peer.has_more(self.replica.seen()) && peer.wrong_ranges.is_empty()
        })
    }

    pub(crate) fn all_have(&self, token: Token) -> bool {
        let mut live = self.protocol.peers.live();
        self.has(token)
            && live.all(|(writer, peer)| {
                let seen = peer.seen.get(&token.writer).copied();
                writer == token.writer || seen.unwrap_or_default() >= token.sequence
            })
    }

    pub(crate) fn has_joined(&self) -> bool {
        self.protocol.has_joined
    }

    /// Takes a message.
    pub(crate) fn receive(&mut self, graph: &Graph, time: Time, now: Duration, message: Message) {
        match message.0 {
            Content::Change {
                schema,
                time: made,
                change,
            } => {
                if self.is_from(schema, change.writer, now) {
                    let at = between(made, graph.snapshot().time(), time);
                    self.take_change(graph, at, now, change);
                }
            }
            Content::Samples {
                schema,
                sender,
                time: made,
                samples,
            } => {
                if self.is_from(schema, sender, now) {
                    let at = between(made, graph.snapshot().time(), time);
                    self.take_samples(graph, at, now, &samples);
                }
            }
            Content::Digest(digest) => self.take_digest(&digest, now),
            Content::Ask {
                sender,
                to,
                number,
                since,
                ranges,
                chunks,
            } => {
                if to == self.protocol.writer && self.hear(sender, now) {
                    let question = Question {
                        sender,
                        number,
                        since,
                        ranges,
                        chunks,
                    };
                    self.answer(&question, now);
                }
            }
            Content::Chunk {
                sender,
                to,
                number,
                at,
                count,
                bytes,
            } => {
                if to == self.protocol.writer && self.hear(sender, now) {
                    self.take_chunk(graph, time, now, (sender, number), (at, count), bytes);
                }
            }
        }
    }

    /// Notes a sender. Returns whether it is another replica.
    fn hear(&mut self, sender: u64, now: Duration) -> bool {
        let is_other = sender != self.protocol.writer;
        is_other && self.protocol.peers.hear(sender, now).is_some()
    }

    fn is_from(&mut self, schema: u64, sender: u64, now: Duration) -> bool {
        if !self.hear(sender, now) {
            return false;
        }
        let is_same = schema == self.protocol.schema;
        if !is_same {
            self.protocol.refuse("a replica has another schema");
        }
        is_same
    }

    fn take_change(&mut self, graph: &Graph, time: Time, now: Duration, change: Change) {
        let Change {
            writer: sender,
            since,
            upto,
            ..
        } = change;
        let is_own = change.records.iter().all(|record| {
            let stamp = record.stamp();
            stamp.writer == sender && since < stamp.sequence && stamp.sequence <= upto
        });
        if !is_own {
            let reason = "a change has the number of another writer, or none of its own";
            return self.protocol.refuse(reason);
        }
        let seen = self.seen(sender);
        if seen >= upto {
            return;
        }
        if since > seen {
            self.wait_with(time, now, change);
        } else if self.merge_change(graph, time, &change) {
            self.protocol.counts.received += 1;
            self.take_waiting(graph, time);
        }
    }

    /// Keeps a change until those before it are known, and asks for these.
    fn wait_with(&mut self, time: Time, now: Duration, change: Change) {
        let (writer, upto) = (change.writer, change.upto);
        let checked = Check::of(self).records(&change.records);
        let checked = checked.and_then(|()| {
            let taken = self.replica.check_change(&change);
            taken.map_err(|error| error.to_string())
        });
        if let Err(reason) = checked {
            return self.protocol.refuse(&reason);
        }
        self.protocol.counts.gaps += 1;
        self.protocol.gaps.put(time, change);
        self.protocol.ask_by(now.saturating_add(PATIENCE));
        // The sender had this when it sent the change.
        if let Some(peer) = self.protocol.peers.all.get_mut(&writer) {
            let known = peer.seen.entry(writer).or_default();
            *known = (*known).max(upto);
        }
    }

    /// Takes the changes before which nothing is missing any more, each as a version of its own.
    pub(crate) fn take_waiting(&mut self, graph: &Graph, time: Time) {
        while let Some((made, change)) = self.protocol.gaps.next(self.replica.seen()) {
            let at = between(made, graph.snapshot().time(), time);
            if self.merge_change(graph, at, &change) {
                self.protocol.counts.received += 1;
            }
        }
    }

    /// Takes a change of another replica, and shows it. Returns whether it is sound.
    fn merge_change(&mut self, graph: &Graph, time: Time, change: &Change) -> bool {
        let records = &change.records;
        let merged = Check::of(self).records(records).and_then(|()| {
            overruled::note(&mut self.overruled, &self.replica, records);
            let merged = self.replica.merge_change(change);
            merged.map_err(|error| error.to_string())
        });
        if let Err(reason) = merged {
            self.protocol.refuse(&reason);
            return false;
        }
        self.protocol.digests.clear();
        let values = records.iter();
        if !self.show_values(graph, time, values.map(|record| self.value_of(record))) {
            let touched = records.iter().map(graph_merge::Record::of).collect();
            self.show(graph, time, &touched);
        }
        true
    }

    /// Takes a part of an answer, and shows it. Changes that the schema allows each by itself may break it
    /// together. An answer has all of them, and the view hides what the schema does not allow.
    pub(crate) fn merge_answer(&mut self, graph: &Graph, time: Time, delta: &Delta) {
        let merged = Check::of(self).room(&delta.records).and_then(|()| {
            overruled::note(&mut self.overruled, &self.replica, &delta.records);
            let merged = self.replica.merge_answer(delta);
            merged.map_err(|error| error.to_string())
        });
        match merged {
            Ok(touched) => {
                self.protocol.digests.clear();
                self.show(graph, time, &touched);
            }
            Err(reason) => self.protocol.refuse(&reason),
        }
    }

    /// The changes that a replica with this state lacks, and the values of streams.
    pub(crate) fn told(&self, seen: &graph_merge::Vector) -> (Delta, Vec<Sample>) {
        let delta = self.replica.delta_since(seen);
        (delta, self.streams.all())
    }

    /// Takes the messages of another replica in a test.
    pub(crate) fn be_told(&mut self, graph: &Graph, time: Time, delta: &Delta, samples: &[Sample]) {
        let time = between(time, graph.snapshot().time(), time);
        self.merge_answer(graph, time, delta);
        self.take_samples(graph, time, Duration::ZERO, samples);
        if self.is_stale {
            self.show_all(graph, time);
        }
    }

    fn take_samples(&mut self, graph: &Graph, time: Time, now: Duration, samples: &[Sample]) {
        let newest = samples.iter().map(|sample| sample.count).max();
        if !newest.is_none_or(|newest| self.replica.count_from(newest)) {
            return self.protocol.refuse("a count is too far ahead");
        }
        let mut newest = Vec::with_capacity(samples.len());
        for sample in samples {
            let Some(kind) = self.replica.kind_of(sample.of) else {
                // Its element is late, or no more.
                continue;
            };
            let sound = Check::of(self).value(Some(kind), &sample.name, Some(&sample.value));
            if let Err(reason) = sound {
                self.protocol.refuse(&reason);
                continue;
            }
            let stamp = (sample.count, sample.writer);
            if self.overrides(sample.of, &sample.name, stamp) && self.streams.put(sample, now) {
                self.protocol.counts.samples_received += 1;
                newest.push(sample);
            }
        }
        let values = newest.iter();
        let values = values.map(|sample| Some((sample.of, &*sample.name, &sample.value)));
        if !self.show_values(graph, time, values) {
            let touched = newest.iter().map(|sample| sample.of).collect();
            self.show(graph, time, &touched);
        }
    }

    fn take_digest(&mut self, digest: &DigestOf, now: Duration) {
        if digest.sender == self.protocol.writer {
            return;
        }
        let (schema, streams) = (self.protocol.schema, self.stream_digest());
        let Some(is_new) = self.protocol.peers.tell(digest, schema, streams, now) else {
            return self
                .protocol
                .refuse("there are too many replicas, or too many writers");
        };
        if digest.schema != schema {
            return self.protocol.refuse("a replica has another schema");
        }
        if is_new && !digest.is_leaving {
            // Not all at once, and not for each of many that come.
            let protocol = &mut self.protocol;
            let others = protocol.peers.live();
            let is_before = |other: u64| other < protocol.writer && other != digest.sender;
            let before = others.filter(|(other, _)| is_before(*other));
            let rank = before.take(MOST_RANKS).count() as u32;
            let again = protocol.told.map(|told| told.saturating_add(ALL_RANKS));
            let soon = now.saturating_add(RANK * rank);
            let soon = soon.max(again.unwrap_or_default());
            protocol.next_digest = protocol.next_digest.min(soon);
        }
        self.replica.acknowledge(digest.sender, &digest.seen);
        let answers = &mut self.protocol.answers;
        answers.acknowledge(digest.sender, &digest.seen);
        let is_equal = self.replica.seen() == &digest.seen;
        let own = if is_equal {
            self.protocol.digests.of(&self.replica)
        } else {
            Vec::new()
        };
        let wrong = own.iter().zip(&digest.ranges).enumerate();
        let wrong = wrong.filter(|(_, (own, other))| own != other);
        let wrong: Vec<u32> = wrong.map(|(at, _)| at as u32).collect();
        if let Some(peer) = self.protocol.peers.all.get_mut(&digest.sender) {
            peer.wrong_ranges = wrong;
        }
        if self.lacks() {
            // One that has nothing waits for no change that is under way.
            let is_first = self.replica.seen().is_empty();
            let patience = if is_first { Duration::ZERO } else { PATIENCE };
            self.protocol.ask_by(now.saturating_add(patience));
        }
    }

    fn stream_digest(&mut self) -> u64 {
        let mut streams = std::mem::take(&mut self.streams);
        streams.prune(|id, name, stamp| self.overrides(id, name, stamp));
        self.streams = streams;
        self.streams.digest()
    }

    /// Does the work that is due, and returns when more is due.
    pub(crate) fn turn(&mut self, graph: &Graph, time: Time, now: Duration) -> Duration {
        if self.is_stale {
            self.show_all(graph, between(time, graph.snapshot().time(), time));
        }
        let started = *self.protocol.started.get_or_insert(now);
        let may_join = !self.protocol.has_joined && now.saturating_sub(started) >= JOINING;
        if may_join && self.has_answers() {
            self.protocol.has_joined = true;
        }
        if self.protocol.has_left {
            return now.saturating_add(PERIOD);
        }
        if now >= self.protocol.next_digest {
            self.tidy(graph, time);
            self.tick(now);
        }
        let asks = self.ask(now);
        let (due, next) = self.streams.due(now);
        self.protocol.send_samples(due);
        let all = [Some(self.protocol.next_digest), asks, next];
        let next = all.into_iter().flatten().min();
        next.unwrap_or_else(|| now.saturating_add(PERIOD))
    }

    /// Removes edges that are never shown again, because one replica made them while another one removed an
    /// end of them: those of its own, and if it is its turn those of writers that have ended.
    fn tidy(&mut self, graph: &Graph, time: Time) {
        if !self.tidies || !self.has_joined() || self.conflicts.is_empty() {
            return;
        }
        let own = self.replica.writer();
        let others: BTreeSet<u64> = self
            .protocol
            .peers
            .live()
            .map(|(writer, _)| writer)
            .collect();
        let is_its_turn = self.is_its_turn();
        let dangling = self.conflicts.iter().filter(|conflict| {
            let writer = conflict.id.writer();
            conflict.reason == Reason::EndRemoved
                && (writer == own || is_its_turn && !others.contains(&writer))
        });
        let mut gone: BTreeSet<Id> = dangling
            .map(|conflict| conflict.id)
            .take(MOST_TIDIED)
            .collect();
        if gone.is_empty() {
            return;
        }
        let time = between(time, graph.snapshot().time(), time);
        let change = self.replica.recorded(|replica| {
            for id in &gone {
                replica.remove(*id)?;
            }
            Ok::<_, graph_merge::Error>(())
        });
        self.protocol.digests.clear();
        // An edge takes those that start or end there with it.
        let also = change.iter().flat_map(|change| &change.records);
        gone.extend(also.map(graph_merge::Record::of));
        self.show(graph, time, &gone);
        match change {
            Ok(change) if change.records.is_empty() => {}
            Ok(change) => self.protocol.send_change(time, change),
            // The next digest tells of those before the error.
            Err(error) => self.protocol.refuse(&error.to_string()),
        }
    }

    /// The work of each second.
    fn tick(&mut self, now: Duration) {
        self.protocol.ticks = self.protocol.ticks.wrapping_add(1);
        for gone in self.protocol.peers.sweep(now) {
            self.replica.forget(gone);
            self.protocol.gaps.forget(gone);
        }
        self.protocol.answers.expire(now);
        self.repeat_streams(now);
        self.tell(false);
        self.protocol.told = Some(now);
        self.protocol.next_digest = now.saturating_add(PERIOD);
        if self.lacks() {
            self.protocol.ask_by(now);
        } else {
            self.protocol.answers.parts = None;
        }
    }

    fn tell(&mut self, is_leaving: bool) {
        let streams = self.stream_digest();
        let digest = DigestOf {
            schema: self.protocol.schema,
            sender: self.protocol.writer,
            name: self.protocol.name.clone(),
            seen: self.replica.seen().clone(),
            ranges: self.protocol.digests.of(&self.replica),
            streams,
            elements: self.replica.element_count() as u64,
            conflicts: self.conflicts.len() as u32,
            is_leaving,
        };
        self.protocol.send(Content::Digest(digest));
    }

    /// Sends values of streams that others seem to lack. The replicas do so in turn.
    fn repeat_streams(&mut self, now: Duration) {
        // Its answer has the changes alone.
        if std::mem::take(&mut self.protocol.answers.has_new) {
            let all = self.streams.before(now);
            self.protocol.send_samples(all);
            return;
        }
        let peers = &self.protocol.peers;
        if !peers.live().any(|(_, peer)| peer.other_streams > 1) {
            return;
        }
        if self.is_its_turn() {
            let quiet = self.streams.before(now.saturating_sub(PERIOD));
            self.protocol.send_samples(quiet);
        }
    }

    /// Whether this replica does now what one of all has to do: in turn, because any of them may end.
    pub(crate) fn is_its_turn(&self) -> bool {
        let live = || self.protocol.peers.live();
        let before = live().filter(|(writer, _)| *writer < self.protocol.writer);
        let (rank, count) = (before.count() as u64, live().count() as u64 + 1);
        self.protocol.ticks % count == rank
    }

    /// Says goodbye.
    pub(crate) fn leave(&mut self) {
        if !self.protocol.has_left {
            self.tell(true);
            self.protocol.has_left = true;
        }
    }
}
