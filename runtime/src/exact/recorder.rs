//! Writes an exact recording while the component runs.
//!
//! The worker's thread collects the entries of a turn, [`Output`] writes them.

use super::entry::{DEFINITION, Entry, Kind, TYPE_NAME};
use super::error_codes;
use super::output::{LONGEST, Output};
use super::start::Start;
use crate::status::Shared;
use crate::worker_error::WorkerError;
use rc_files::Disk;
use rc_management::component::State;
use rc_mcap::{Stamp, system_time, write};
use rc_middleware::Writer;
use std::borrow::Cow;
use std::cell::RefCell;
use std::fs::File;
use std::io;
use std::sync::Arc;
use std::time::Duration;

/// The numbers of the only schema and the only channel.
const SCHEMA: u16 = 1;
const CHANNEL: u16 = 1;
/// The encapsulation header of CDR, little endian.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];
/// A turn that is longer, in bytes, is written in parts.
const LONGEST_PART: usize = 1024 * 1024;
/// Size of the number and of the count of entries at the beginning of a turn.
const TURN_HEADER: usize = 12;

/// Records the life of one component.
#[derive(Debug)]
pub(crate) struct Recorder {
    shared: Arc<Shared>,
    turns: RefCell<Turns>,
}

#[derive(Debug)]
struct Turns {
    /// The present turn; empty between two turns.
    turn: Writer<'static>,
    is_in_turn: bool,
    entries: u32,
    /// Whether the turn holds more than its beginning and readings of the clock.
    has_content: bool,
    number: u64,
    sequence: u32,
    began: (u64, u64),
    state: Option<State>,
    period: Option<Duration>,
    output: Option<Output>,
}

impl Recorder {
    /// Begins a recording in `file`, which ends before its disk is full.
    pub(crate) fn begin(
        file: File,
        disk: Disk,
        start: &Start,
        shared: Arc<Shared>,
    ) -> io::Result<Self> {
        let mut begin = Vec::new();
        let topic = format!("/{}/{}/exact", start.network, start.name);
        let metadata = [
            ("robocomp.exact", start.name.as_str()),
            ("robocomp.component", &start.component),
            ("robocomp.network", &start.network),
            ("robocomp.model", &start.model),
        ];
        begin.extend(rc_mcap::MAGIC);
        write::header(&mut begin, "", "robocomp");
        write::schema(
            &mut begin,
            SCHEMA,
            TYPE_NAME,
            "ros2msg",
            DEFINITION.as_bytes(),
        );
        write::channel(&mut begin, CHANNEL, SCHEMA, &topic, "cdr", metadata);
        let asked = file.try_clone()?;
        let free = move || Disk::free_of(&asked);
        // A larger file ends the process by a signal.
        let longest = LONGEST.min(Disk::largest_file());
        let output = Output::begin(file, longest, disk, free, close)?;
        output.push(|out| out.extend(begin));
        let recorder = Self {
            shared,
            turns: RefCell::new(Turns {
                turn: Writer::default(),
                is_in_turn: false,
                entries: 0,
                has_content: false,
                number: 0,
                sequence: 0,
                began: (0, 0),
                state: None,
                period: None,
                output: Some(output),
            }),
        };
        recorder.begin_turn(&Entry {
            text: Cow::Owned(start.to_json()),
            ..Entry::of(Kind::Start)
        });
        recorder.end_turn();
        Ok(recorder)
    }

    /// Begins a turn of the loop.
    pub(super) fn begin_turn(&self, first: &Entry<'_>) {
        let (state, period) = {
            let status = self.shared.status();
            (status.state, status.period)
        };
        let now = self.shared.time.clock.now().as_nanos();
        let turns = &mut *self.turns.borrow_mut();
        turns.is_in_turn = true;
        turns.has_content = false;
        turns.began = (system_time(), now);
        turns.push(first);
        if turns.state != Some(state) {
            turns.state = Some(state);
            turns.push(&Entry {
                text: Cow::Borrowed(state.word()),
                ..Entry::of(Kind::State)
            });
            turns.has_content = true;
        }
        if turns.period != Some(period) {
            turns.period = Some(period);
            turns.push(&Entry {
                value: period.as_nanos() as u64,
                ..Entry::of(Kind::Period)
            });
            turns.has_content = true;
        }
    }

    /// Adds an entry to the present turn. Between two turns nothing concerns the worker.
    pub(super) fn push(&self, entry: &Entry<'_>) {
        let turns = &mut *self.turns.borrow_mut();
        if turns.is_in_turn {
            turns.has_content |= entry.kind != Kind::Now;
            turns.push(entry);
        }
    }

    /// Adds the result of a function of the worker.
    pub(super) fn result(&self, result: &Result<(), WorkerError>) {
        if let Err(error) = result {
            self.push(&error_codes::of_worker(error));
        }
    }

    /// Ends the present turn.
    pub(super) fn end_turn(&self) {
        self.turns.borrow_mut().end();
    }

    /// Ends the turn that a port has begun, if it has.
    pub(super) fn end_begun_turn(&self) {
        let turns = &mut *self.turns.borrow_mut();
        if turns.is_in_turn {
            turns.end();
        }
    }

    /// Ends the present turn, which need not be repeated if nothing but the clock was read in it.
    pub(super) fn end_idle_turn(&self, has_effect: bool) {
        let turns = &mut *self.turns.borrow_mut();
        if has_effect || turns.has_content {
            turns.end();
        } else {
            turns.turn.clear();
            turns.entries = 0;
            turns.is_in_turn = false;
        }
    }
}

impl Turns {
    fn push(&mut self, entry: &Entry<'_>) {
        if self.output.is_none() {
            return;
        }
        if self.entries == 0 {
            self.turn.clear();
            self.turn.put(&self.number);
            self.turn.put(&0_u32);
        }
        self.entries += 1;
        entry.write(&mut self.turn);
        if self.turn.len() > LONGEST_PART {
            self.end_part();
        }
    }

    fn end(&mut self) {
        self.end_part();
        self.is_in_turn = false;
        self.number += 1;
    }

    /// Hands the entries of the present turn over.
    fn end_part(&mut self) {
        let count = std::mem::take(&mut self.entries);
        if count == 0 {
            return;
        }
        let mut bytes = std::mem::take(&mut self.turn).into_bytes();
        bytes[TURN_HEADER - 4..TURN_HEADER].copy_from_slice(&count.to_le_bytes());
        let (log_time, publish_time) = self.began;
        let stamp = Stamp {
            log_time,
            publish_time,
            sequence: self.sequence,
        };
        let parts = [&ENCAPSULATION[..], &bytes];
        let put = |out: &mut Vec<u8>| write::message(out, CHANNEL, stamp, &parts);
        if !self.output.as_ref().is_some_and(|output| output.push(put)) {
            // The log says why.
            self.output = None;
        }
        self.sequence = self.sequence.wrapping_add(1);
        bytes.clear();
        self.turn = Writer::over(bytes);
    }
}

/// Writes the end of a recording.
fn close(out: &mut Vec<u8>) {
    write::data_end(out);
    write::end(out, 0);
}

impl Drop for Turns {
    fn drop(&mut self) {
        self.end_part();
        if let Some(output) = self.output.take() {
            output.push(close);
        }
    }
}
