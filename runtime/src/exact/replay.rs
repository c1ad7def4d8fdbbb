//! Recording that a component repeats: the inputs of its worker, and its expected outputs.

use super::entry::{Entry, Kind};
use super::error_codes;
use super::report::Report;
use crate::clock::{Clock, SimulatedClock, Time};
use crate::description::Description;
use crate::slots::{Listed, SlotTable};
use crate::worker_error::WorkerError;
use rc_management::component::State;
use rc_middleware::{DecodeError, Reader};
use std::cell::{Cell, OnceCell, RefCell};
use std::collections::VecDeque;
use std::fmt;
use std::io::{self, Read};
use std::sync::Arc;
use std::time::Duration;

/// The longest part of a turn, in bytes. A recorder writes a part of 1 MiB and one message more.
const LONGEST_PART: usize = 256 * 1024 * 1024;
/// The most entries of a part. A recorder begins another part after a mebibyte; an entry takes
/// several times its bytes in memory.
const MOST_ENTRIES: u32 = 1 << 18;
/// How many entries before a difference a report shows.
const BEFORE: usize = 24;

/// The recording, as far as it has not been repeated.
pub(crate) struct Replay {
    description: &'static Description,
    /// The slots, once the beginning of the recording is read.
    pub(super) slots: OnceCell<Arc<SlotTable>>,
    clock: Arc<SimulatedClock>,
    input: RefCell<Box<dyn Read>>,
    /// Entries with the numbers of their turns.
    waiting: RefCell<VecDeque<(u64, Entry<'static>)>>,
    before: RefCell<VecDeque<(u64, Entry<'static>)>>,
    is_in_turn: Cell<bool>,
    turn: Cell<u64>,
    turns: Cell<u64>,
    outputs: Cell<u64>,
    /// The slot and the number of the call whose end began the present turn.
    ended: Cell<Option<(usize, u64)>>,
}

impl fmt::Debug for Replay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Replay(turn {})", self.turn.get())
    }
}

impl Replay {
    pub(super) fn new(
        description: &'static Description,
        clock: Arc<SimulatedClock>,
        input: Box<dyn Read>,
    ) -> Self {
        Self {
            description,
            slots: OnceCell::new(),
            clock,
            input: RefCell::new(input),
            waiting: RefCell::default(),
            before: RefCell::default(),
            is_in_turn: Cell::new(false),
            turn: Cell::new(0),
            turns: Cell::new(0),
            outputs: Cell::new(0),
            ended: Cell::new(None),
        }
    }

    /// Whether the worker runs, and not the runtime.
    pub(super) fn is_in_turn(&self) -> bool {
        self.is_in_turn.get()
    }

    /// The next entry, which stays. `None` at the end of the recording.
    fn peek(&self) -> Option<Entry<'static>> {
        if self.waiting.borrow().is_empty() {
            match self.read() {
                Ok(true) => {}
                Ok(false) => return None,
                Err(error) => self.end(Some(format!("the recording cannot be read: {error}"))),
            }
        }
        self.waiting
            .borrow()
            .front()
            .map(|(_, entry)| entry.clone())
    }

    /// Whether the next entry is of this kind.
    fn is_next(&self, kind: Kind) -> bool {
        let is_loaded = !self.waiting.borrow().is_empty() || self.peek().is_some();
        let waiting = self.waiting.borrow();
        is_loaded && waiting.front().is_some_and(|(_, entry)| entry.kind == kind)
    }

    /// Reads the next part of a turn. `false` at the end.
    fn read(&self) -> Result<bool, String> {
        let mut input = self.input.borrow_mut();
        let mut length = [0; 4];
        match input.read_exact(&mut length) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(false),
            other => other.map_err(|e| e.to_string())?,
        }
        let length = u32::from_le_bytes(length) as usize;
        if length > LONGEST_PART {
            return Err(format!("a part has {length} bytes"));
        }
        let mut bytes = vec![0; length];
        input.read_exact(&mut bytes).map_err(|e| e.to_string())?;
        let mut reader = Reader::new(&bytes);
        let mut decode = || {
            let turn = reader.get()?;
            let count: u32 = reader.get()?;
            if count > MOST_ENTRIES {
                return Ok(Err(format!("a part has {count} entries")));
            }
            let entries = (0..count).map(|_| Ok((turn, Entry::read(&mut reader)?)));
            let entries = entries.collect::<Result<VecDeque<_>, DecodeError>>();
            entries.map(Ok)
        };
        let entries = decode().map_err(|e: DecodeError| e.to_string())??;
        *self.waiting.borrow_mut() = entries;
        Ok(true)
    }

    pub(super) fn pop(&self) -> Option<Entry<'static>> {
        self.peek()?;
        let (turn, entry) = self.waiting.borrow_mut().pop_front()?;
        self.turn.set(turn);
        let mut before = self.before.borrow_mut();
        if before.len() == BEFORE {
            before.pop_front();
        }
        before.push_back((turn, entry.clone()));
        Some(entry)
    }

    /// The input that the worker asks for. If the recording ends here, the run ends; if the
    /// recorded worker did something else here, the run ends with a difference.
    pub(super) fn take(&self, kind: Kind, slot: usize, operation: usize) -> Entry<'static> {
        let Some(recorded) = self.peek() else {
            self.end(None)
        };
        let here = usize::from(recorded.slot) == slot;
        let here = here
            && (matches!(kind, Kind::Answer | Kind::Fresh)
                || usize::from(recorded.operation) == operation);
        if recorded.kind != kind || !here {
            self.differ(Some(&Entry::at(kind, slot, operation)), Some(&recorded));
        }
        if kind == Kind::Now {
            self.clock.set(Time::from_nanos(recorded.value));
        }
        self.pop().unwrap_or(recorded)
    }

    /// Compares the worker's output with the recorded one.
    pub(super) fn compare(&self, entry: &Entry<'_>) {
        if !self.is_in_turn() {
            return;
        }
        let Some(recorded) = self.peek() else {
            self.end(None)
        };
        if !entry.is_written_as(&recorded) {
            self.differ(Some(&entry.clone().into_owned()), Some(&recorded));
        }
        self.outputs.set(self.outputs.get() + 1);
        self.pop();
    }

    /// The error of the last sending, if it failed.
    pub(super) fn failure(&self) -> Option<Entry<'static>> {
        self.is_next(Kind::Failed).then(|| self.pop()).flatten()
    }

    /// The event that a tool fired here.
    pub(super) fn fired(&self) -> Option<Entry<'static>> {
        self.is_next(Kind::Fired).then(|| self.pop()).flatten()
    }

    pub(super) fn slots(&self) -> &Arc<SlotTable> {
        let none = || {
            Arc::new(SlotTable::replayed(
                self.description,
                ("", ""),
                Listed::new(),
            ))
        };
        self.slots.get_or_init(none)
    }

    fn report(&self) -> Report<'_> {
        Report {
            description: self.description,
            slots: self.slots(),
            turn: self.turn.get(),
            turns: self.turns.get(),
            outputs: self.outputs.get(),
            time: self.clock.now(),
        }
    }

    /// Ends the process with a difference.
    fn differ(&self, found: Option<&Entry<'_>>, recorded: Option<&Entry<'_>>) -> ! {
        let before = self.before.borrow();
        print(&self.report().difference(found, recorded, &before));
        std::process::exit(0)
    }

    /// Ends the process at the end of the recording, or where it cannot be read any more.
    pub(super) fn end(&self, error: Option<String>) -> ! {
        print(&self.report().end(error));
        std::process::exit(0)
    }

    /// The next turn.
    pub(super) fn begin_turn(&self, component: &mut dyn FnMut(Setting)) -> Option<Entry<'static>> {
        self.is_in_turn.set(false);
        let first = self.peek()?;
        if !first.kind.begins_turn() {
            self.differ(None, Some(&first));
        }
        self.pop();
        self.turns.set(self.turns.get() + 1);
        self.settings(component)?;
        self.is_in_turn.set(true);
        Some(first)
    }

    /// Lets the client of a slot end a call in this turn.
    pub(super) fn end_call(&self, slot: usize, sequence: u64) {
        self.ended.set(Some((slot, sequence)));
    }

    /// The number of the call of a slot that ends in this turn, once.
    pub(super) fn ended_call(&self, slot: usize) -> Option<u64> {
        let (of, sequence) = self.ended.get()?;
        (of == slot).then(|| {
            self.ended.set(None);
            sequence
        })
    }

    /// Applies the state and the period, where they are other ones from here on.
    pub(super) fn settings(&self, component: &mut dyn FnMut(Setting)) -> Option<()> {
        loop {
            if self.is_next(Kind::State) {
                let word = self.pop()?.text;
                component(Setting::State(state_of(&word)));
            } else if self.is_next(Kind::Period) {
                component(Setting::Period(Duration::from_nanos(self.pop()?.value)));
            } else {
                return Some(());
            }
        }
    }

    /// Compares the result of a function of the worker.
    pub(super) fn result(&self, result: &Result<(), WorkerError>) {
        if let Err(error) = result {
            self.compare(&error_codes::of_worker(error));
        }
    }
}

/// Setting that has changed before a turn.
pub(super) enum Setting {
    State(State),
    Period(Duration),
}

fn state_of(word: &str) -> State {
    let all = [State::Running, State::Emergency, State::Stopping];
    all.into_iter()
        .find(|state| state.word() == word)
        .unwrap_or(State::Starting)
}

/// Prints the report as a line of its own, also if the worker has printed half a line.
fn print(report: &str) {
    rc_diagnostics::print::data(&format!("\n{report}"));
}
