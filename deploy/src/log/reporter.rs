//! Writes events and log lines to the standard streams.
//!
//! A separate thread writes, so that a paused terminal or a full pipe never blocks the supervisor.
//! Log lines wait in their logs until there is room. If no reader comes for long, events are
//! dropped and counted.

use crate::log::journal::Journal;
use rc_deploy_client::Format;
use rc_diagnostics::foreign::without_number;
use rc_management::event::{Event, Severity};
use std::cell::{Cell, Ref, RefCell};
use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::AsFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::Duration;

/// How many bytes may wait before log lines are held back.
const ROOM: usize = 1 << 20;
/// How many bytes may wait before events are dropped.
const EVENTS: usize = 16 << 20;
/// How many bytes of lines are kept while a view covers the streams.
const COVERED: usize = 1 << 20;
/// Memory of a record besides its text, in bytes.
const OVERHEAD: usize = 64;
/// How long the end of the program waits for the records.
const FLUSH_LIMIT: Duration = Duration::from_secs(1);

/// Where events are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Output {
    /// On standard output and standard error.
    Streams,
    /// All on standard error, which is a log file.
    Log,
}

enum Record {
    Out(String),
    Err(String),
    Flush(Sender<()>),
}

impl Record {
    /// Approximate size in memory, in bytes.
    fn size(&self) -> usize {
        match self {
            Self::Out(text) | Self::Err(text) => OVERHEAD + text.len(),
            Self::Flush(_) => OVERHEAD,
        }
    }
}

/// Queues events and log lines. It never blocks.
#[derive(Debug)]
pub(crate) struct Reporter {
    sender: Sender<Record>,
    /// The bytes that wait.
    waiting: Arc<AtomicUsize>,
    format: Format,
    output: Output,
    width: usize,
    dropped: Cell<u64>,
    journal: RefCell<Journal>,
    covered: Arc<AtomicBool>,
}

impl Reporter {
    /// Starts the thread. `width` is the length of the longest name of a component.
    pub(crate) fn start(format: Format, output: Output, width: usize) -> io::Result<Self> {
        let out = File::from(io::stdout().as_fd().try_clone_to_owned()?);
        let err = File::from(io::stderr().as_fd().try_clone_to_owned()?);
        Self::onto(out, err, format, output, width)
    }

    /// One that only keeps its journal.
    #[cfg(test)]
    pub(crate) fn silent() -> Self {
        let null = || File::options().write(true).open("/dev/null");
        let [out, err] = [null(), null()].map(|file| file.expect("a device"));
        Self::onto(out, err, Format::Human, Output::Streams, 0).expect("a thread")
    }

    fn onto(
        out: File,
        err: File,
        format: Format,
        output: Output,
        width: usize,
    ) -> io::Result<Self> {
        let (sender, receiver) = mpsc::channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        let counter = Arc::clone(&waiting);
        let covered = Arc::new(AtomicBool::new(false));
        let hidden = Arc::clone(&covered);
        std::thread::Builder::new()
            .name("report".to_owned())
            .spawn(move || write(&receiver, &counter, &hidden, &out, &err))?;
        Ok(Self {
            sender,
            waiting,
            format,
            output,
            width,
            dropped: Cell::new(0),
            journal: RefCell::default(),
            covered,
        })
    }

    /// Writes one event.
    pub(crate) fn event(&self, mut event: Event) {
        event.message = without_number(&event.message).into_owned();
        self.journal.borrow_mut().add(&event);
        let usual = event.severity == Severity::Info && event.component.is_some();
        if usual && self.covered.load(Ordering::Relaxed) {
            return;
        }
        match self.format {
            Format::Human => self.send(Record::Err(format!("{event}\n"))),
            Format::Json => self.json(&event),
        }
    }

    /// The last events.
    pub(crate) fn journal(&self) -> Ref<'_, Journal> {
        self.journal.borrow()
    }

    /// Set while a full-screen view covers the streams. Warnings, errors and events of the network
    /// are written afterwards.
    pub(crate) fn covered(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.covered)
    }

    /// Writes a line that a component printed.
    pub(crate) fn log_line(&self, component: &str, line: &str) {
        match self.format {
            Format::Human => {
                let width = self.width;
                self.send(Record::Out(format!("{component:width$} | {line}\n")));
            }
            Format::Json => self.json(&Event::component(component, Severity::Info, "log", line)),
        }
    }

    fn json(&self, event: &Event) {
        self.send(Record::Out(event.json_line()));
    }

    /// Whether there is room for log lines. Lines beyond it are kept anyway.
    pub(crate) fn has_room(&self) -> bool {
        self.waiting.load(Ordering::Relaxed) < ROOM
    }

    fn send(&self, record: Record) {
        if self.waiting.load(Ordering::Relaxed) >= EVENTS {
            self.dropped.set(self.dropped.get() + 1);
            return;
        }
        let dropped = self.dropped.take();
        if dropped > 0 {
            let note = format!("warning: {dropped} events were left out here\n");
            self.queue(Record::Err(note));
        }
        self.queue(match (self.output, record) {
            (Output::Log, Record::Out(text)) => Record::Err(text),
            (_, record) => record,
        });
    }

    fn queue(&self, record: Record) {
        self.waiting.fetch_add(record.size(), Ordering::Relaxed);
        // The thread ends after this half of the channel only.
        let _ = self.sender.send(record);
    }

    /// Waits until everything is written, with a limit.
    pub(crate) fn flush(&self) {
        let (done, written) = mpsc::channel();
        self.queue(Record::Flush(done));
        let _ = written.recv_timeout(FLUSH_LIMIT);
    }
}

/// Writes a text. A closed stream is no reason to fail.
fn print(mut stream: &File, text: &str) {
    let _: io::Result<()> = stream.write_all(text.as_bytes());
}

fn write(
    records: &Receiver<Record>,
    waiting: &AtomicUsize,
    covered: &AtomicBool,
    out: &File,
    err: &File,
) {
    let mut kept: VecDeque<String> = VecDeque::new();
    let mut kept_size = 0;
    for record in records {
        let size = record.size();
        let covered = covered.load(Ordering::Relaxed);
        if !covered {
            for text in kept.drain(..) {
                print(err, &text);
            }
            kept_size = 0;
        }
        match record {
            Record::Out(text) | Record::Err(text) if covered => {
                kept.push_back(text);
                kept_size += size;
                while kept_size > COVERED
                    && let Some(oldest) = kept.pop_front()
                {
                    kept_size -= OVERHEAD + oldest.len();
                }
            }
            Record::Out(text) => print(out, &text),
            Record::Err(text) => print(err, &text),
            Record::Flush(done) => drop(done.send(())),
        }
        waiting.fetch_sub(size, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    /// Only a fault lets it pass.
    const LIMIT: Duration = Duration::from_mins(1);

    #[test]
    fn what_nobody_reads_has_a_bound_in_bytes() {
        let (unread, stream) = rustix::pipe::pipe().expect("a pipe");
        let [out, err] = [stream.try_clone().expect("its end"), stream].map(File::from);
        let reporter =
            Reporter::onto(out, err, Format::Human, Output::Streams, 0).expect("a thread");
        let line = "x".repeat(EVENTS / 32);
        assert!(reporter.has_room());
        reporter.log_line("a", &line[..ROOM / 4]);
        assert!(reporter.has_room());
        for _ in 0..40 {
            reporter.log_line("a", &line);
        }
        let waiting = reporter.waiting.load(Ordering::Relaxed);
        assert!(
            (EVENTS..EVENTS + 2 * line.len()).contains(&waiting),
            "{waiting}"
        );
        assert!(!reporter.has_room() && reporter.dropped.get() > 0);
        drop(unread);
        let begun = Instant::now();
        while reporter.waiting.load(Ordering::Relaxed) > 0 {
            assert!(begun.elapsed() < LIMIT, "a closed stream takes everything");
            std::thread::yield_now();
        }
    }
}
