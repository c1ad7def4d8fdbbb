//! Questions about missing changes, and their answers in chunks.

use crate::answers::{Answer, Asked, MOST_ANSWER, Parts, Question, whole};
use crate::content::Content;
use crate::core::Core;
use crate::digest::RANGES;
use crate::message::MOST_CHUNK;
use crate::peers::{PAUSE, Peer, missing};
use crate::protocol::between;
use crate::wire;
use graph_merge::Delta;
use property_graph::{Graph, Time};
use std::time::Duration;

/// After so long without a chunk, a replica asks again.
const RETRY: Duration = Duration::from_millis(300);
/// How often a replica repeats a question to the same other one.
const MOST_TRIES: u32 = 10;
/// How many chunks are on the way at most.
const WINDOW: usize = 8;

impl Core {
    /// Asks the questions that are due. Returns when to look again.
    pub(crate) fn ask(&mut self, now: Duration) -> Option<Duration> {
        if let Some(asked) = &mut self.protocol.answers.asked {
            let due = asked.heard.saturating_add(RETRY);
            if now < due {
                return Some(due);
            }
            asked.tries += 1;
            let is_there = self.protocol.peers.all.get(&asked.to);
            let is_there = is_there.is_some_and(Peer::is_live);
            // No other replica is asked for an answer of which parts are here.
            let most = if asked.chunks.is_empty() {
                1
            } else {
                MOST_TRIES
            };
            if asked.tries > most || !is_there {
                // Parts alone are no answer.
                if let Some(peer) = self.protocol.peers.all.get_mut(&asked.to) {
                    peer.unanswered = peer.unanswered.saturating_add(1);
                }
                self.protocol.answers.asked = None;
                self.protocol.answers.parts = None;
                self.protocol.ask_by(now);
            } else {
                self.ask_again(now);
                return Some(now.saturating_add(RETRY));
            }
        }
        let at = self.protocol.ask_at?;
        if now < at {
            return Some(at);
        }
        self.protocol.ask_at = self.ask_somebody(now);
        let asked = self.protocol.answers.asked.as_ref();
        let again = asked.map(|_| now.saturating_add(RETRY));
        again.or(self.protocol.ask_at)
    }

    /// Asks the next one of those that have something. If none of them may be asked yet, returns
    /// the earliest time.
    fn ask_somebody(&mut self, now: Duration) -> Option<Duration> {
        let seen = self.replica.seen();
        let parts = self.protocol.answers.parts.as_ref();
        let parts = parts.map(|parts| (parts.from, parts.missing()));
        let all = self.protocol.peers.live();
        // The one that has sent parts sends the others.
        let is_asked = |writer: u64, peer: &Peer| match &parts {
            Some((from, _)) => *from == writer,
            None => peer.has_more(seen),
        };
        let all: Vec<(u64, &Peer)> = all
            .filter(|(writer, peer)| is_asked(*writer, peer))
            .collect();
        if parts.is_some() && all.is_empty() {
            self.protocol.answers.parts = None;
            return Some(now);
        }
        let having = all.iter().filter(|(_, peer)| peer.ask_after <= now);
        let mut having: Vec<u64> = having.map(|(writer, _)| *writer).collect();
        let earliest = all.iter().map(|(_, peer)| peer.ask_after).min();
        let mut ranges = parts.map_or_else(Vec::new, |(_, missing)| missing);
        if having.is_empty() && ranges.is_empty() {
            let wrong = self.protocol.peers.live();
            let mut wrong = wrong.filter(|(_, peer)| !peer.wrong_ranges.is_empty());
            if let Some((writer, peer)) = wrong.next() {
                having.push(writer);
                ranges.clone_from(&peer.wrong_ranges);
            }
        }
        let answers = &mut self.protocol.answers;
        let next = having.iter().find(|writer| **writer > answers.last);
        let Some(to) = next.or(having.first()).copied() else {
            return earliest;
        };
        let peer = self.protocol.peers.all.get_mut(&to)?;
        peer.wrong_ranges.clear();
        answers.last = to;
        answers.number += 1;
        answers.asked = Some(Asked {
            to,
            number: answers.number,
            since: seen.clone(),
            announced: peer.seen.clone(),
            ranges,
            heard: now,
            tries: 0,
            chunks: Vec::new(),
            waiting: WINDOW,
        });
        self.protocol.counts.asked += 1;
        self.ask_again(now);
        None
    }

    /// Asks for the chunks that are missing.
    fn ask_again(&mut self, now: Duration) {
        let sender = self.protocol.writer;
        let Some(asked) = &mut self.protocol.answers.asked else {
            return;
        };
        asked.heard = now;
        let missing = asked.chunks.iter().enumerate();
        let missing = missing.filter(|(_, chunk)| chunk.is_none());
        let chunks: Vec<u32> = missing.map(|(at, _)| at as u32).take(WINDOW).collect();
        asked.waiting = chunks.len();
        let message = Content::Ask {
            sender,
            to: asked.to,
            number: asked.number,
            since: asked.since.clone(),
            ranges: asked.ranges.clone(),
            chunks,
        };
        self.protocol.send(message);
    }

    /// Answers a question, as far as there is room for it.
    pub(crate) fn answer(&mut self, question: &Question, now: Duration) {
        self.replica.acknowledge(question.sender, &question.since);
        if !self.protocol.has_room() {
            return;
        }
        self.protocol.answers.expire(now);
        let (to, number) = (question.sender, question.number);
        let kept = self.protocol.answers.kept.iter();
        let mut known = kept.enumerate();
        let known = known.find(|(_, answer)| answer.to == to && answer.number == number);
        let at = match known {
            Some((at, _)) => Some(at),
            // Made again, it would have other chunks.
            None if !question.chunks.is_empty() => None,
            None => self.make_answer(question, now),
        };
        let answer = at.and_then(|at| self.protocol.answers.kept.get_mut(at));
        let Some(answer) = answer else {
            return;
        };
        let count = answer.count();
        let wanted: Vec<usize> = if question.chunks.is_empty() {
            (0..count.min(WINDOW)).collect()
        } else {
            let chunks = question.chunks.iter().map(|at| *at as usize);
            chunks.filter(|at| *at < count).take(WINDOW).collect()
        };
        answer.ask(&wanted, now);
        let sender = self.protocol.writer;
        let parts = wanted.into_iter().map(|at| {
            let begin = at * MOST_CHUNK;
            let end = (begin + MOST_CHUNK).min(answer.bytes.len());
            Content::Chunk {
                sender,
                to,
                number,
                at: at as u32,
                count: count as u32,
                bytes: answer.bytes[begin..end].to_vec(),
            }
        });
        for part in parts.collect::<Vec<_>>() {
            self.protocol.send(part);
        }
    }

    /// Makes the answer to a new question. Returns its place.
    fn make_answer(&mut self, question: &Question, now: Duration) -> Option<usize> {
        let peer = self.protocol.peers.all.get_mut(&question.sender)?;
        let is_soon = peer
            .answered
            .is_some_and(|last| now < last.saturating_add(PAUSE));
        if is_soon {
            return None;
        }
        peer.answered = Some(now);
        let most = self.protocol.most_answer;
        // It takes a time in proportion to the world: first, those of others arrive.
        let may_be_large = question.since.is_empty() || !question.ranges.is_empty();
        if may_be_large && !self.has_room_for(question, most / 2, now) {
            return None;
        }
        let Some(bytes) = self.answer_of(question) else {
            let reason = format!("a range has more than an answer holds, which is {most} bytes");
            self.protocol.refuse(&reason);
            return None;
        };
        if !self.has_room_for(question, bytes.len(), now) {
            return None;
        }
        let is_whole = question.ranges.is_empty();
        let answer = Answer {
            to: question.sender,
            number: question.number,
            bytes,
            made: now,
            asked: now,
            reached: 0,
            upto: is_whole.then(|| self.replica.seen().clone()),
            has_arrived: false,
        };
        let at = self.protocol.answers.keep(question, answer, most);
        self.protocol.counts.answered += 1;
        self.protocol.answers.has_new |= question.since.is_empty();
        Some(at)
    }

    /// Whether an answer of so many bytes has room. If it has none, the other replica is told to ask
    /// again: a chunk of none says so.
    fn has_room_for(&mut self, question: &Question, bytes: usize, now: Duration) -> bool {
        let most = self.protocol.most_answer;
        let answers = &mut self.protocol.answers;
        // It waits for its own answer then, and keeps no other replica waiting.
        let is_under_way = answers.are_under_way(question.sender, now);
        let has_room = !is_under_way && answers.have_room(question, bytes, most);
        if !has_room {
            if !is_under_way {
                answers.postpone(question.sender, now);
            }
            self.protocol.send(Content::Chunk {
                sender: self.protocol.writer,
                to: question.sender,
                number: question.number,
                at: 0,
                count: 0,
                bytes: Vec::new(),
            });
        }
        has_room
    }

    /// The answer to a question. If it does not hold all, it has as many ranges as it holds.
    fn answer_of(&self, question: &Question) -> Option<Vec<u8>> {
        let most = self.protocol.most_answer;
        let mut ranges: Vec<u32> = question.ranges.clone();
        if ranges.is_empty() {
            let delta = self.replica.delta_since(&question.since);
            if wire::size_of(&delta) <= most {
                return Some(wire::answer(&[delta]));
            }
            ranges = (0..RANGES as u32).collect();
        }
        ranges.sort_unstable();
        ranges.dedup();
        let ranges = ranges
            .into_iter()
            .filter(|range| (*range as usize) < RANGES);
        let (mut deltas, mut bytes) = (Vec::new(), 0);
        for range in ranges {
            let delta = self.replica.range(range as usize, RANGES);
            bytes += wire::size_of(&delta);
            if bytes > most {
                break;
            }
            deltas.push(delta);
        }
        (!deltas.is_empty()).then(|| wire::answer(&deltas))
    }

    /// Takes a part of an answer.
    pub(crate) fn take_chunk(
        &mut self,
        graph: &Graph,
        time: Time,
        now: Duration,
        (sender, number): (u64, u64),
        (at, count): (u32, u32),
        bytes: Vec<u8>,
    ) {
        let (at, count) = (at as usize, count as usize);
        let answers = &mut self.protocol.answers;
        let asked = answers.asked.as_mut();
        let asked = asked.filter(|asked| asked.to == sender && asked.number == number);
        let Some(asked) = asked else { return };
        let is_first = asked.chunks.is_empty();
        if count == 0 && is_first {
            answers.asked = None;
            let peer = self.protocol.peers.all.get_mut(&sender);
            // Parts wait: the same replica has the others. If it stays busy, another one is asked for all.
            if peer.is_none_or(|peer| peer.has_postponed(now)) {
                answers.parts = None;
            }
            return self.protocol.ask_by(now);
        }
        let is_sound = at < count
            && count <= MOST_ANSWER / MOST_CHUNK + 1
            && (is_first || asked.chunks.len() == count)
            && bytes.len() <= MOST_CHUNK;
        if !is_sound {
            return self
                .protocol
                .refuse("a chunk of an answer does not fit the others");
        }
        if is_first {
            asked.chunks = vec![None; count];
            asked.waiting = count.min(WINDOW);
        }
        // A repeated part is no sign that the others follow.
        if asked.chunks[at].is_none() {
            asked.heard = now;
            asked.chunks[at] = Some(bytes);
            asked.tries = 0;
            asked.waiting = asked.waiting.saturating_sub(1);
        }
        if asked.chunks.iter().all(Option::is_some) {
            let chunks = std::mem::take(&mut asked.chunks);
            let announced = std::mem::take(&mut asked.announced);
            let may_be_part = asked.ranges.is_empty() || answers.parts.is_some();
            answers.asked = None;
            let whole = whole(&chunks);
            let is_part = self.take_answer(graph, time, now, &whole, may_be_part.then_some(sender));
            let is_fruitless = !is_part && missing(&announced, self.replica.seen()) > 0;
            if let Some(peer) = self.protocol.peers.all.get_mut(&sender) {
                peer.has_answered(now, is_fruitless);
            }
        } else if asked.waiting == 0 {
            self.ask_again(now);
        }
    }

    /// Takes an answer. One with ranges is a part of a world if nobody has asked for ranges: then
    /// `parts_from` is its sender. Returns whether other parts are missing.
    pub(crate) fn take_answer(
        &mut self,
        graph: &Graph,
        time: Time,
        now: Duration,
        whole: &[u8],
        parts_from: Option<u64>,
    ) -> bool {
        // An answer that is no further part ends the others: another replica is asked then.
        let parts = parts_from.and_then(|_| self.protocol.answers.parts.take());
        let mut is_part = false;
        match wire::read_answer(whole) {
            Ok(deltas) => {
                let deltas = match parts_from.filter(|_| Parts::are(&deltas)) {
                    Some(from) => self.add_parts(from, parts, deltas),
                    None => deltas,
                };
                is_part = parts_from.is_some() && self.protocol.answers.parts.is_some();
                self.take_deltas(graph, time, deltas);
            }
            Err(error) => self.protocol.refuse(&error.to_string()),
        }
        if self.lacks() {
            self.protocol.ask_by(now.saturating_add(PAUSE));
        }
        is_part
    }

    /// Takes what an answer has.
    pub(crate) fn take_deltas(&mut self, graph: &Graph, time: Time, deltas: Vec<Delta>) {
        for delta in deltas {
            let at = between(time, graph.snapshot().time(), time);
            self.merge_answer(graph, at, &delta);
        }
        self.take_waiting(graph, time);
    }

    /// Adds parts of a world. Returns the world once all are here.
    fn add_parts(&mut self, from: u64, known: Option<Parts>, deltas: Vec<Delta>) -> Vec<Delta> {
        let known = known.filter(|parts| parts.from == from);
        let mut parts = known.unwrap_or_else(|| Parts::begin(from, &deltas));
        let before = parts.missing().len();
        if !parts.add(deltas) {
            self.protocol.refuse("a world has more than 1 GiB");
            return Vec::new();
        }
        if parts.missing().len() == before {
            self.protocol.refuse("an answer repeats a part of a world");
            return Vec::new();
        }
        if parts.missing().is_empty() {
            return vec![parts.whole()];
        }
        self.protocol.answers.parts = Some(parts);
        Vec::new()
    }
}
