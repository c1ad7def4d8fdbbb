//! The logs of a network: where they are, and how they are printed.

use crate::by_hand;
use crate::connection;
use crate::error::{Error, ErrorContext, print_error, with_owner};
use crate::follower::Follower;
use crate::format::Format;
use crate::log_filter::{LineFilter, LogFilter};
use crate::log_parts;
use crate::names::{check_name, is_reserved};
use crate::watch::DirectoryWatch;
use rc_management::event::{Event, Severity};
use rustix::event::{PollFd, PollFlags, poll};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The name of the supervisor's log. No component has this name ([`crate::names::is_reserved`]).
pub const SUPERVISOR: &str = "rcdeploy";
/// The log of the guard.
pub const GUARD: &str = "rcdeploy-guard";
/// The name of the process that keeps the last messages of the network, and of its log and files.
pub const RING: &str = "rcdeploy-ring";

/// The folder of a network's logs: `robocomp/NETWORK` in `$XDG_STATE_HOME`, else in
/// `~/.local/state`, else `robocomp-UID/NETWORK` in the folder for temporary files.
pub fn directory(network: &str) -> PathBuf {
    root().join(network)
}

/// The folder with the logs of all networks.
pub fn root() -> PathBuf {
    base().0
}

/// The folder, and whether other users can access its parent.
fn base() -> (PathBuf, bool) {
    let absolute = |name: &str| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
    };
    if let Some(state) = absolute("XDG_STATE_HOME") {
        return (state.join("robocomp"), false);
    }
    if let Some(home) = absolute("HOME") {
        return (home.join(".local/state/robocomp"), false);
    }
    let name = format!("robocomp-{}", rustix::process::getuid().as_raw());
    (std::env::temp_dir().join(name), true)
}

/// Creates a folder of logs for this user alone, unless it exists.
pub fn make_folder(path: &Path) -> io::Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    builder.recursive(true).mode(0o700).create(path)
}

/// The folder of a network's logs. It is created if it does not exist.
pub fn open_directory(network: &str) -> Result<PathBuf, Error> {
    let (base, shared) = base();
    let path = base.join(network);
    let made = make_folder(&path).map_err(|error| with_owner(&path, error));
    made.context(format!("make the folder of the logs, {}", path.display()))?;
    if shared {
        let owner = std::fs::symlink_metadata(&base).context("look at the folder of the logs")?;
        if owner.uid() != rustix::process::getuid().as_raw() || owner.mode() & 0o022 != 0 {
            return Err(io::Error::from(io::ErrorKind::PermissionDenied)).context(format!(
                "write logs to {}, which is not private; set XDG_STATE_HOME",
                base.display()
            ));
        }
    }
    Ok(path)
}

/// The log of one component, or of the supervisor.
pub fn file(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!("{name}.log"))
}

/// Empties a log and removes its older part. A process that still writes continues at the
/// beginning.
pub fn clear(path: &Path) -> io::Result<()> {
    match std::fs::remove_file(log_parts::older(path)) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(with_owner(path, error)),
        _ => {}
    }
    File::create(path)
        .map(drop)
        .map_err(|error| with_owner(path, error))
}

/// The last lines of a log, without their ends.
pub fn tail(path: &Path, count: usize) -> io::Result<Vec<String>> {
    Follower::at_last_lines(path, count).map(|(lines, _)| lines)
}

/// The pause between two looks at logs that cannot be watched.
const PAUSE: Duration = Duration::from_millis(200);

/// How many lines at the end are searched for a failure, and how many are quoted.
const LOOKED_THROUGH: usize = 400;
const QUOTED: usize = 10;

/// The last lines of a log for the message of a failure, without backtraces. Lines are shortened.
pub fn quote(path: &Path) -> String {
    let lines = without_backtraces(tail(path, LOOKED_THROUGH).unwrap_or_default());
    let lines = &lines[lines.len().saturating_sub(QUOTED)..];
    let full = if is_full(path) {
        "; its disk is full, and a program that minds may have ended for that: remove something, or have the logs below another XDG_STATE_HOME"
    } else {
        ""
    };
    let path = path.display();
    if lines.is_empty() {
        return format!("there is nothing in {path}{full}");
    }
    let lines = lines.iter().map(|line| {
        let end = line
            .char_indices()
            .nth(400)
            .map_or(line.len(), |(at, _)| at);
        &line[..end]
    });
    let lines: Vec<&str> = lines.collect();
    format!(
        "the last lines of {path}{full}:\n    {}",
        lines.join("\n    ")
    )
}

/// The lines without the frames of backtraces, which would hide the message of a panic.
fn without_backtraces(lines: Vec<String>) -> Vec<String> {
    let mut out = Vec::new();
    let mut inside = false;
    for line in lines {
        if inside && is_frame(&line) {
            continue;
        }
        inside = line == "stack backtrace:";
        out.push(if inside {
            "(a backtrace follows in the log)".to_owned()
        } else {
            line
        });
    }
    out
}

/// Whether a line is `  12: function`, or `      at file:line` below it, or the note at the end of
/// a backtrace.
fn is_frame(line: &str) -> bool {
    let text = line.trim_start();
    let number = text.split_once(':').map(|(number, _)| number);
    let numbered = number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    text.len() < line.len() && (numbered || text.starts_with("at "))
        || text.starts_with("note: Some details are omitted")
        || text.starts_with("note: run with `RUST_BACKTRACE=")
}

/// Whether the disk of this file is full.
fn is_full(path: &Path) -> bool {
    // A file system without blocks reports none.
    rustix::fs::statvfs(path).is_ok_and(|disk| disk.f_blocks > 0 && disk.f_bavail == 0)
}

/// What [`print`] prints, and in which form.
#[derive(Clone, Debug)]
pub struct Shown {
    /// How many lines at the end of each log are printed first; all if none.
    pub lines: Option<usize>,
    /// Whether to continue until it is interrupted.
    pub follow: bool,
    /// In [`Format::Json`], each line is an [`Event`] with the code `log`.
    pub format: Format,
    /// Which lines are meant.
    pub filter: LogFilter,
}

/// Prints the end of one log, or of all logs of a network.
pub fn print(
    network: &str,
    component: Option<&str>,
    shown: &Shown,
    out: &mut dyn Write,
) -> Result<(), Error> {
    check_name("network", network)?;
    let directory = directory(network);
    let nothing = |what: &Path| Error::NoLog {
        what: what.display().to_string(),
        help: match component.filter(|_| directory.exists()) {
            Some(name) => instead_of(name, "components", &names(&directory)),
            None => instead_of(network, "networks", &networks()),
        },
    };
    let by_hand = by_hand_logs(network, component)?;
    let paths: BTreeMap<String, PathBuf> = match component {
        Some(name) => BTreeMap::from([(name.to_owned(), file(&directory, name))]),
        None => names(&directory)
            .into_iter()
            .map(|name| (name.clone(), file(&directory, &name)))
            .collect(),
    };
    // The running component counts, not the log of an earlier run.
    let paths: BTreeMap<String, PathBuf> = paths.into_iter().chain(by_hand).collect();
    let mut printer = Printer {
        width: paths.keys().map(String::len).max().unwrap_or(0),
        bare: component.is_some(),
        format: shown.format,
        out,
    };
    let mut folders: BTreeSet<&Path> = paths.values().filter_map(|path| path.parent()).collect();
    if component.is_none() && (folders.is_empty() || directory.exists()) {
        folders.insert(&directory);
    }
    // Without inotify, of which a user has a limited number of instances, the logs are read again
    // and again.
    let watch = match DirectoryWatch::of(folders) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Err(nothing(&directory)),
        watch => watch.ok().filter(|_| shown.follow),
    };
    let mut followers = BTreeMap::new();
    for (name, path) in &paths {
        let mut filter = LineFilter::new(&shown.filter);
        let (last, follower) =
            last_lines(path, shown.lines, &mut filter).map_err(|_| nothing(path))?;
        for line in last {
            printer.line(name, &line)?;
        }
        followers.insert(name.clone(), (follower, filter));
    }
    if !shown.follow {
        return Ok(());
    }
    loop {
        wait(watch.as_ref())?;
        if let Some(watch) = &watch {
            watch.drain();
        }
        if component.is_none() {
            for name in self::names(&directory) {
                if !followers.contains_key(&name)
                    && let Ok(new) = Follower::open(&file(&directory, &name))
                {
                    followers.insert(name, (new, LineFilter::new(&shown.filter)));
                }
            }
        }
        for (name, (follower, filter)) in &mut followers {
            let mut more = true;
            while more {
                let lines;
                (lines, more) = follower.read();
                for line in lines.into_iter().filter(|line| filter.shows(line)) {
                    printer.line(name, &line)?;
                }
            }
        }
    }
}

/// The last lines of a log that the filter shows: of its end if all lines are shown, else of the
/// whole log.
fn last_lines(
    path: &Path,
    count: Option<usize>,
    filter: &mut LineFilter<'_>,
) -> io::Result<(VecDeque<String>, Follower)> {
    if filter.is_open()
        && let Some(count) = count
    {
        let (lines, follower) = Follower::at_last_lines(path, count)?;
        return Ok((lines.into(), follower));
    }
    let mut last = VecDeque::new();
    let follower = Follower::after_all_lines(path, &mut |line| {
        if filter.shows(&line) {
            last.push_back(line);
        }
        if count.is_some_and(|count| last.len() > count) {
            last.pop_front();
        }
    })?;
    Ok((last, follower))
}

/// The logs of components that were started by hand and print into files. A component that prints
/// elsewhere is an error if it is named, otherwise a note.
fn by_hand_logs(network: &str, named: Option<&str>) -> Result<Vec<(String, PathBuf)>, Error> {
    // A supervisor that does not reply has no influence on logs.
    let known = connection::status(network).map_or_else(|_| Vec::new(), |s| s.components);
    let mut found = by_hand::components(network, known.iter().map(|c| c.name.as_str()));
    found.retain(|c| named.is_none_or(|name| name == c.name));
    let mut logs = Vec::new();
    for component in found {
        let name = component.name;
        if !component.log.as_os_str().is_empty() {
            logs.push((name, component.log));
        } else if let Some(pid) = component.pid {
            let error = Error::PrintsElsewhere {
                name,
                place: by_hand::prints_to(pid),
            };
            if named.is_some() {
                return Err(error);
            }
            print_error(format_args!("rcdeploy: note: {error}"));
        }
    }
    Ok(logs)
}

/// The components that have logs. Logs of rcdeploy itself are shown only by name.
fn names(directory: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            Some(name.strip_suffix(".log")?.to_owned())
        })
        .filter(|name| !is_reserved(name))
        .collect();
    names.sort();
    names
}

/// The networks that have logs.
fn networks() -> Vec<String> {
    let entries = std::fs::read_dir(root()).into_iter().flatten().flatten();
    let folders = entries.filter(|entry| entry.path().is_dir());
    let mut names: Vec<String> = folders
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| check_name("network", name).is_ok())
        .collect();
    names.sort();
    names
}

/// How many names a message lists.
const MOST_LISTED: usize = 12;

/// What has a log where `name` has none.
fn instead_of(name: &str, what: &str, known: &[String]) -> String {
    match rc_diagnostics::nearest(name, known.iter().map(String::as_str)) {
        Some(near) => format!("did you mean `{near}`?"),
        None if known.is_empty() => format!("no {what} have logs here"),
        None if known.len() > MOST_LISTED => format!("{} {what} have logs", known.len()),
        None => format!("these {what} have logs: {}", known.join(", ")),
    }
}

fn wait(watch: Option<&DirectoryWatch>) -> Result<(), Error> {
    let Some(watch) = watch else {
        std::thread::sleep(PAUSE);
        return Ok(());
    };
    let mut polled = [PollFd::from_borrowed_fd(
        watch.descriptor().as_fd(),
        PollFlags::IN,
    )];
    match poll(&mut polled, None) {
        Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
        Err(error) => Err(error).context("wait for new lines"),
    }
}

struct Printer<'o> {
    width: usize,
    bare: bool,
    format: Format,
    out: &'o mut dyn Write,
}

impl Printer<'_> {
    fn line(&mut self, name: &str, line: &str) -> Result<(), Error> {
        let width = self.width;
        let text = match self.format {
            Format::Human if self.bare => format!("{line}\n"),
            Format::Human => format!("{name:width$} | {line}\n"),
            Format::Json => Event::component(name, Severity::Info, "log", line).json_line(),
        };
        let written = self.out.write_all(text.as_bytes());
        written
            .and_then(|()| self.out.flush())
            .context("print the log")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_searches_both_parts_of_a_log() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.log");
        let older = "[rcdeploy: part 1 of this log, without its first 0 bytes]\n";
        let lines = |from: u32| (from..from + 20_000).map(|n| format!("line {n}\n"));
        std::fs::write(
            path.with_extension("log.1"),
            older.to_owned() + &lines(0).collect::<String>(),
        )
        .expect("written");
        std::fs::write(&path, lines(20_000).collect::<String>() + "line 7 again").expect("written");
        let last = |count: Option<usize>, text: &str| {
            let filter = LogFilter {
                texts: vec![text.to_owned()],
                ..LogFilter::default()
            };
            let mut filter = LineFilter::new(&filter);
            last_lines(&path, count, &mut filter).expect("read").0
        };
        assert_eq!(last(None, "LINE 7"), [""; 0]);
        assert_eq!(last(Some(2), "line 39999"), ["line 39999"]);
        assert_eq!(last(Some(2), "line 7"), ["line 7999", "line 7 again"]);
        assert_eq!(last(None, "line 7 "), ["line 7 again"]);
        assert_eq!(last(None, "line").len(), 40_001);
        let all = LogFilter::default();
        let all = last_lines(&path, None, &mut LineFilter::new(&all)).expect("read");
        assert_eq!((all.0.len(), all.0[0].as_str()), (40_001, "line 0"));
    }

    #[test]
    fn a_backtrace_does_not_hide_the_panic() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.log");
        let frames: String = (0..30)
            .map(|n| {
                format!("  {n:2}: core::panicking::panic\n             at /rustc/x.rs:{n}:5\n")
            })
            .collect();
        let text = format!(
            "starts\nthread 'main' panicked at src/worker.rs:12:9:\nno map\nstack backtrace:\n{frames}note: Some details are omitted, run with `RUST_BACKTRACE=full`\navoider: error: the component panicked\n"
        );
        std::fs::write(&path, text).expect("a log");
        let quoted = quote(&path);
        let lines: Vec<&str> = quoted.lines().skip(1).map(str::trim).collect();
        assert_eq!(
            lines,
            [
                "starts",
                "thread 'main' panicked at src/worker.rs:12:9:",
                "no map",
                "(a backtrace follows in the log)",
                "avoider: error: the component panicked",
            ]
        );
    }

    #[test]
    fn a_name_without_a_log_gets_the_nearest_one_or_all() {
        let known = ["avoider", "monitor"].map(str::to_owned);
        let told = |name: &str, known: &[String]| instead_of(name, "components", known);
        assert_eq!(told("avoidr", &known), "did you mean `avoider`?");
        assert_eq!(
            told("x", &known),
            "these components have logs: avoider, monitor"
        );
        assert_eq!(told("x", &[]), "no components have logs here");
        let many: Vec<String> = (0..13).map(|n| format!("component{n}")).collect();
        assert_eq!(told("x", &many), "13 components have logs");
    }
}
