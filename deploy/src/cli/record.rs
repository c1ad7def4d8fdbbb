//! `rcdeploy record`: records a running network.

use super::bag::{duration, positive_duration};
use super::completion::{networks, topics};
use super::look::look;
use super::messages::{interrupts, signals};
use super::networks::network_of;
use super::output::{Failure, print_failure, print_line, print_note};
use super::world::WorldRequest;
use rc_deploy_client::connection;
use rc_management::event::time_text;
use rc_management::supervisor::{Event, Severity};
use rc_observe::Network;
use rc_record::live::{Progress, RecordSelection, Recorder};
use rc_record::ring::{Ring, Written};
use rc_record::sink::{FileSink, QUEUE, Sink};
use rc_record::{Limits, RecordError};
use std::ffi::OsStr;
use std::io::{IsTerminal, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// How often the progress is shown.
const SHOW: Duration = Duration::from_millis(500);
/// The pause before the recorder of a supervisor looks again for components.
const AGAIN: Duration = Duration::from_secs(2);
/// The longest wait for messages.
const TURN: Duration = Duration::from_millis(100);

/// Arguments of `record`.
#[derive(clap::Args)]
pub(super) struct Record {
    /// The network or its .ddsl. Optional if only one network runs.
    #[arg(add = networks())]
    network: String,
    /// Topics and operations: whole names, addresses, or any ends of these that mean one thing.
    /// Without them, everything.
    #[arg(value_name = "TOPIC", add = topics())]
    names: Vec<String>,
    /// The file. By default it has the name of the network and the time.
    #[arg(short, long, value_name = "FILE.mcap")]
    output: Option<PathBuf>,
    /// Records topics and no calls.
    #[arg(long)]
    no_calls: bool,
    /// Continues in another file after this many MiB.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    split_mib: Option<u64>,
    /// Continues in another file after this time, as in `10min`.
    #[arg(long, value_name = "TIME", value_parser = positive_duration)]
    split: Option<Duration>,
    /// How much of the disk stays free, in MiB. If less is free, the oldest file is removed; if
    /// there is only one, the recording ends. By default a twentieth of the disk, at most 2048.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(0..=1 << 30))]
    keep_free: Option<u64>,
    /// Ends after this time.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    length: Option<Duration>,
    /// Keeps the last messages of this time in memory. They are written when a component fails,
    /// when an event of `--on` comes, at SIGUSR1, and when you press Enter.
    #[arg(long, value_name = "TIME", value_parser = positive_duration, conflicts_with_all = ["split", "split_mib"])]
    ring: Option<Duration>,
    /// The most memory of the ring in MiB.
    #[arg(long, value_name = "MIB", default_value_t = 256, requires = "ring", value_parser = clap::value_parser!(u64).range(1..=1 << 16))]
    ring_mib: u64,
    /// How many files of the ring are kept. The oldest ones are removed.
    #[arg(long, value_name = "N", default_value_t = 16, requires = "ring", value_parser = clap::value_parser!(u64).range(1..))]
    ring_files: u64,
    /// Codes of events that write the ring. By default the failures of components.
    #[arg(long, value_name = "CODE", value_delimiter = ',', requires = "ring")]
    on: Vec<String>,
    /// Lets the ring of `record { ring TIME; };` in the .ddsl be written, and records nothing else.
    #[arg(long, conflicts_with_all = ["names", "output", "no_calls", "split", "split_mib", "length", "ring"])]
    now: bool,
    /// A supervisor has started it: standard input is its link.
    #[arg(long, hide = true, requires = "ring")]
    supervised: bool,
}

/// Requests by a signal, a key or the supervisor.
#[derive(Clone, Copy, Debug, Default)]
struct Requests {
    write: bool,
    end: bool,
}

pub(super) fn record(options: &Record) -> Result<u8, Failure> {
    if options.now {
        connection::write_ring(&network_of(&options.network)?)?;
        return Ok(0);
    }
    let mut source = RequestSource::new(options)?;
    let Some(network) = source.network(&options.network)? else {
        return Ok(0);
    };
    let name = network.name.clone();
    let wanted = RecordSelection {
        names: options.names.clone(),
        calls: !options.no_calls,
    };
    let files = RingFiles::new(options, &name);
    let sink = || {
        if let Some(time) = options.ring {
            return Ok(Sink::Ring(Ring::new(
                time,
                (options.ring_mib as usize) << 20,
            )));
        }
        let named = || PathBuf::from(format!("{name}-{}.mcap", time()));
        let path = options.output.clone().unwrap_or_else(named);
        Ok(Sink::File(FileSink::create(&path, limits(options, &path))?))
    };
    let is_whole = options.names.is_empty() && options.ring.is_none();
    let without_world = |failure: Failure| {
        let reason = failure.1;
        print_note(&format_args!(
            "the recording has only changes of the world: {reason}"
        ));
    };
    let request = is_whole.then(|| WorldRequest::new(&network));
    let mut request = request.and_then(|request| request.map_err(without_world).ok());
    let mut recorder = Recorder::begin(&network, &wanted, sink)?;
    let began = Instant::now();
    let mut line = ProgressLine::new();
    let mut reason: Option<String> = None;
    loop {
        let events = recorder.step(&source.descriptors(), TURN);
        if let Some(Err(failure)) = request.as_mut().map(WorldRequest::advance) {
            line.clear();
            without_world(failure);
        }
        let requests = source.take();
        let mut notes = recorder.notes();
        if let Sink::File(file) = recorder.sink() {
            notes.extend(file.notes());
        }
        for note in notes {
            line.clear();
            print_note(&note);
        }
        // The first reason of several is the cause.
        let event = events.iter().find(|event| writes_ring(event, &options.on));
        let on_request = || requests.write.then(|| "on request".to_owned());
        reason = reason
            .or_else(|| event.map(ToString::to_string))
            .or_else(on_request);
        if let Sink::Ring(ring) = recorder.sink() {
            if let Some(written) = ring.written() {
                line.clear();
                files.written(written);
            }
            if !ring.is_writing()
                && let Some(reason) = reason.take()
            {
                line.clear();
                files.write(ring, &reason);
            }
        }
        let is_over = options
            .length
            .is_some_and(|length| began.elapsed() >= length);
        if requests.end || is_over {
            break;
        }
        // A supervisor ends its recorder itself. Until then, components may come back.
        if recorder.has_network_ended() && !options.supervised {
            line.clear();
            print_note(&format_args!("the network {name} has ended"));
            break;
        }
        if let Sink::File(file) = recorder.sink()
            && file.has_failed()
        {
            break;
        }
        line.show(&mut recorder, began);
    }
    line.clear();
    let (sink, progress) = recorder.finish();
    end(sink, &progress, &files, reason.as_deref())
}

/// Ends the file, or writes the ring if `reason` asks for it.
fn end(
    sink: Sink,
    progress: &Progress,
    files: &RingFiles,
    reason: Option<&str>,
) -> Result<u8, Failure> {
    match sink {
        Sink::Ring(mut ring) => {
            let begun = ring.finish();
            begun.into_iter().for_each(|written| files.written(written));
            if let Some(reason) = reason {
                files.write(&mut ring, reason);
                let last = ring.finish();
                last.into_iter().for_each(|written| files.written(written));
            }
            Ok(0)
        }
        Sink::File(file) => {
            let parts = file.finish().map_err(|error| {
                let text = format!(
                    "the recording has stopped: {error}; the network runs on, and the file holds what was written before"
                );
                Failure(3, text)
            })?;
            for part in parts {
                print_line(format_args!("{}", part.display()));
            }
            print_line(format_args!("{}", summary(progress)));
            Ok(0)
        }
    }
}

fn summary(progress: &Progress) -> String {
    let Progress {
        messages,
        bytes,
        lost,
        unread,
        ..
    } = progress;
    let unread = if *unread > 0 {
        format!(", {unread} of other types left out")
    } else {
        String::new()
    };
    let megabytes = *bytes as f64 / 1e6;
    format!("{messages} messages, {megabytes:.1} MB, {lost} lost{unread}")
}

fn limits(options: &Record, path: &Path) -> Limits {
    let keep_free = options.keep_free.map(|mib| mib << 20);
    Limits {
        bytes: options.split_mib.map(|mib| mib << 20),
        time: options.split,
        keep_free: keep_free.unwrap_or_else(|| Limits::usual_floor(path)),
    }
}

/// The present time for names of files: `20261123T021908005`.
fn time() -> String {
    let text = time_text(SystemTime::now());
    text.chars()
        .filter(|c| c.is_ascii_digit() || *c == 'T')
        .collect()
}

/// The files of a ring: `NAME-TIME.mcap`. The oldest ones are removed.
struct RingFiles {
    folder: PathBuf,
    name: String,
    most: usize,
}

impl RingFiles {
    fn new(options: &Record, network: &str) -> Self {
        let path = options.output.as_deref();
        let folder = path.and_then(Path::parent).unwrap_or(Path::new(""));
        let name = path.and_then(Path::file_stem);
        let name = name.map(|name| name.to_string_lossy().into_owned());
        Self {
            folder: folder.to_owned(),
            name: name.unwrap_or_else(|| format!("{network}-ring")),
            most: usize::try_from(options.ring_files).unwrap_or(usize::MAX),
        }
    }

    fn write(&self, ring: &mut Ring, reason: &str) {
        let path = self.folder.join(format!("{}-{}.mcap", self.name, time()));
        if let Err(error) = ring.write(&path, reason) {
            // The recorder goes on: there may be room for the next one.
            print_failure(&error);
        }
    }

    fn written(&self, written: Result<Written, RecordError>) {
        match written {
            Ok(written) => {
                let Written {
                    path,
                    reason,
                    messages,
                    shortened_to,
                } = written;
                if let Some(time) = shortened_to {
                    print_note(&format_args!(
                        "the memory of the ring holds the last {:.1} s only; --ring-mib gives it more",
                        time.as_secs_f64()
                    ));
                }
                print_line(format_args!(
                    "{}: {messages} messages, {reason}",
                    path.display()
                ));
                self.remove_oldest(path.file_name());
            }
            Err(error) => {
                print_failure(&error);
                self.remove_oldest(None);
            }
        }
    }

    /// Removes the oldest files, but never the one that was written last: after the clock was set
    /// back, its name sorts first.
    fn remove_oldest(&self, last: Option<&OsStr>) {
        let folder = if self.folder.as_os_str().is_empty() {
            Path::new(".")
        } else {
            &self.folder
        };
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let is_older = |name: &String| self.is_own(name) && last != Some(OsStr::new(name));
        let mut own: Vec<String> = names.filter(is_older).collect();
        own.sort();
        let kept = self.most.saturating_sub(usize::from(last.is_some()));
        let surplus = own.len().saturating_sub(kept);
        for name in own.iter().take(surplus) {
            if let Err(error) = std::fs::remove_file(folder.join(name)) {
                print_note(&format_args!("{name} cannot be removed: {error}"));
            }
        }
    }

    /// Whether a file is one of this ring: its time has 18 characters.
    fn is_own(&self, name: &str) -> bool {
        let time = name.strip_prefix(&self.name);
        let time = time.and_then(|rest| rest.strip_prefix('-')?.strip_suffix(".mcap"));
        time.is_some_and(|time| {
            time.len() == 18 && time.bytes().all(|c| c.is_ascii_digit() || c == b'T')
        })
    }
}

/// Whether an event writes the ring: those that are named, else the failure of a component.
fn writes_ring(event: &Event, codes: &[String]) -> bool {
    if codes.is_empty() {
        let ended_wrongly = event.code == "exited" && event.severity != Severity::Info;
        return event.severity == Severity::Error || ended_wrongly;
    }
    codes.iter().any(|code| *code == event.code)
}

/// Sources of requests: signals, the Enter key and the supervisor.
struct RequestSource {
    ends: UnixStream,
    writes: UnixStream,
    /// Whether standard input is read: keys, or the link to the supervisor.
    reads_input: bool,
    is_supervised: bool,
}

impl RequestSource {
    fn new(options: &Record) -> Result<Self, Failure> {
        let keys = options.ring.is_some() && std::io::stdin().is_terminal();
        Ok(Self {
            ends: interrupts()?,
            writes: signals(&[signal_hook::consts::SIGUSR1])?,
            reads_input: keys || options.supervised,
            is_supervised: options.supervised,
        })
    }

    /// The network. The recorder of a supervisor waits until a component replies; `None` if it is
    /// ended before.
    fn network(&mut self, name: &str) -> Result<Option<Network>, Failure> {
        loop {
            match look(name) {
                Err(_) if self.is_supervised => {}
                found => return found.map(Some),
            }
            let again = Instant::now() + AGAIN;
            while let Some(left) = again.checked_duration_since(Instant::now()) {
                rc_middleware::wait(&self.descriptors(), left);
                if self.take().end {
                    return Ok(None);
                }
            }
        }
    }

    /// Descriptors that are readable when a request has come.
    fn descriptors(&self) -> Vec<BorrowedFd<'_>> {
        let mut all = vec![self.ends.as_fd(), self.writes.as_fd()];
        if self.reads_input {
            all.push(rustix::stdio::stdin());
        }
        all
    }

    fn take(&mut self) -> Requests {
        let mut requests = Requests {
            write: self.writes.read(&mut [0; 64]).is_ok_and(|n| n > 0),
            end: self.ends.read(&mut [0; 64]).is_ok_and(|n| n > 0),
        };
        if self.reads_input && is_readable() {
            let mut buffer = [0; 64];
            match rustix::io::read(rustix::stdio::stdin(), &mut buffer) {
                Ok(0) | Err(_) => {
                    // Nothing outlives its supervisor.
                    self.reads_input = false;
                    requests.end |= self.is_supervised;
                }
                Ok(_) => requests.write = true,
            }
        }
        requests
    }
}

/// Whether standard input can be read without waiting.
fn is_readable() -> bool {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let input = rustix::stdio::stdin();
    let mut polled = [PollFd::from_borrowed_fd(input, PollFlags::IN)];
    poll(&mut polled, Some(&Timespec::default())).unwrap_or(0) > 0
}

/// The line of progress.
struct ProgressLine {
    is_terminal: bool,
    at: Instant,
    bytes: u64,
    width: usize,
}

impl ProgressLine {
    fn new() -> Self {
        Self {
            is_terminal: std::io::stderr().is_terminal(),
            at: Instant::now(),
            bytes: 0,
            width: 0,
        }
    }

    fn show(&mut self, recorder: &mut Recorder, began: Instant) {
        let passed = self.at.elapsed();
        if !self.is_terminal || passed < SHOW {
            return;
        }
        let progress = recorder.progress();
        let rate = (progress.bytes - self.bytes) as f64 / passed.as_secs_f64() / 1e6;
        self.at = Instant::now();
        self.bytes = progress.bytes;
        let held = match recorder.sink() {
            Sink::File(file) => format!("queue {}/{} MiB", file.waiting() >> 20, QUEUE >> 20),
            Sink::Ring(ring) => format!("ring {} messages, {} MiB", ring.len(), ring.held() >> 20),
        };
        let line = format!(
            "{:>6.1} s  {} messages  {rate:.2} MB/s  {} lost  {held}",
            began.elapsed().as_secs_f64(),
            progress.messages,
            progress.lost
        );
        let width = self.width;
        self.width = line.len();
        let _ = write!(std::io::stderr(), "\r{line:<width$}");
    }

    /// Removes the line.
    fn clear(&mut self) {
        let width = std::mem::take(&mut self.width);
        if width > 0 {
            let _ = write!(std::io::stderr(), "\r{:width$}\r", "");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_removes_its_own_oldest_files_only() {
        let folder = tempfile::tempdir().expect("a folder");
        let files = RingFiles {
            folder: folder.path().to_owned(),
            name: "ring".to_owned(),
            most: 2,
        };
        let own = ["1", "2", "3"].map(|n| format!("ring-2026112{n}T021908005.mcap"));
        let others = ["ring.mcap", "ring-x.mcap", "ring-20261123T021908005.txt"];
        let all = own.iter().map(String::as_str).chain(others);
        for name in all.clone() {
            std::fs::write(folder.path().join(name), "").expect("to write");
        }
        let left = |last: Option<&str>| -> Vec<&str> {
            files.remove_oldest(last.map(OsStr::new));
            let all = all.clone();
            all.filter(|n| folder.path().join(n).exists()).collect()
        };
        let expected = [own[1].as_str(), &own[2], others[0], others[1], others[2]];
        assert_eq!(left(None), expected);
        // The clock was set back: the file that was written last has the oldest name.
        std::fs::write(folder.path().join(&own[0]), "").expect("to write");
        let expected = [own[0].as_str(), &own[2], others[0], others[1], others[2]];
        assert_eq!(left(Some(&own[0])), expected);
        assert!(files.is_own(&format!("ring-{}.mcap", time())));
    }
}
