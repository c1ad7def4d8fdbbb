//! The logs of a network: where they are, and how they are printed.

use crate::error::{Error, ErrorContext};
use crate::follower::Follower;
use crate::format::Format;
use crate::log_parts;
use crate::names::{check_name, is_reserved};
use crate::watch::DirectoryWatch;
use rc_management::event::{Event, Severity};
use rustix::event::{PollFd, PollFlags, poll};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

/// The name of the supervisor's log. No component has this name ([`crate::names::is_reserved`]).
pub const SUPERVISOR: &str = "rcdeploy";
/// The log of the guard.
pub const GUARD: &str = "rcdeploy-guard";

/// The folder of a network's logs: `robocomp/NETWORK` in `$XDG_STATE_HOME`, else in
/// `~/.local/state`, else `robocomp-UID/NETWORK` in the folder for temporary files.
pub fn directory(network: &str) -> PathBuf {
    base().0.join(network)
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

/// The folder of a network's logs. It is created if it does not exist.
pub fn open_directory(network: &str) -> Result<PathBuf, Error> {
    let (base, shared) = base();
    let path = base.join(network);
    std::fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(&path)
        .context(format!("make the folder of the logs, {}", path.display()))?;
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
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    File::create(path).map(drop)
}

/// The last lines of a log, without their ends.
pub fn tail(path: &Path, count: usize) -> io::Result<Vec<String>> {
    Follower::at_last_lines(path, count).map(|(lines, _)| lines)
}

/// The last lines of a log for the message of a failure. Lines are shortened.
pub fn quote(path: &Path) -> String {
    let lines = tail(path, 10).unwrap_or_default();
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

/// Whether the disk of this file is full.
fn is_full(path: &Path) -> bool {
    // A file system without blocks reports none.
    rustix::fs::statvfs(path).is_ok_and(|disk| disk.f_blocks > 0 && disk.f_bavail == 0)
}

/// Prints the last `lines` of one log, or of all logs of a network. With `follow`, continues until
/// it is interrupted.
///
/// In [`Format::Json`], each line is an [`Event`] with the code `log`.
pub fn print(
    network: &str,
    component: Option<&str>,
    lines: usize,
    follow: bool,
    format: Format,
    out: &mut dyn Write,
) -> Result<(), Error> {
    check_name("network", network)?;
    let directory = directory(network);
    let nothing = |what: &Path| Error::NoLog {
        what: what.display().to_string(),
    };
    let names = match component {
        Some(name) => vec![name.to_owned()],
        None => names(&directory),
    };
    let mut printer = Printer {
        width: names.iter().map(String::len).max().unwrap_or(0),
        bare: component.is_some(),
        format,
        out,
    };
    let watch = DirectoryWatch::new(&directory).map_err(|_| nothing(&directory))?;
    let mut followers = BTreeMap::new();
    for name in names {
        let path = file(&directory, &name);
        let (last, follower) = Follower::at_last_lines(&path, lines).map_err(|_| nothing(&path))?;
        for line in last {
            printer.line(&name, &line)?;
        }
        followers.insert(name, follower);
    }
    if !follow {
        return Ok(());
    }
    loop {
        wait(&watch)?;
        watch.drain();
        if component.is_none() {
            for name in self::names(&directory) {
                if !followers.contains_key(&name)
                    && let Ok(new) = Follower::open(&file(&directory, &name))
                {
                    followers.insert(name, new);
                }
            }
        }
        for (name, follower) in &mut followers {
            let mut more = true;
            while more {
                let lines;
                (lines, more) = follower.read();
                for line in lines {
                    printer.line(name, &line)?;
                }
            }
        }
    }
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

fn wait(watch: &DirectoryWatch) -> Result<(), Error> {
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
