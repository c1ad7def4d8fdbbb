//! Sets up a connection on a separate thread, because that waits and copies.

use super::SupervisorMessage;
use super::copies;
use super::ssh::TOKEN;
use super::timed_stream::{TimedStream, read_line};
use crate::process::own_program::OWN;
use rc_diagnostics::foreign::clean;
use rc_management::agent::{AgentMessage, File};
use rc_management::lines;
use std::io::{self, BufReader, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver};

/// How many lines a login may print before the script starts.
const GREETING: usize = 1000;

/// Requirements of an agent before it starts.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) network: String,
    /// The files that the other machine needs, without duplicates.
    pub(crate) files: Vec<PathBuf>,
    /// The services that the guard there holds, as JSON.
    pub(crate) services: Option<String>,
}

/// An agent that is ready.
#[derive(Debug)]
pub(crate) struct AgentReady {
    /// The folder of the copies.
    pub(crate) root: PathBuf,
    /// The number of copied files, and of their bytes.
    pub(crate) copied: (usize, u64),
    /// Whether the machine was connected before.
    pub(crate) again: bool,
    /// How many orphans of an earlier run were killed there.
    pub(crate) recovered: Option<usize>,
}

/// A setup in progress.
#[derive(Debug)]
pub(crate) struct SetupThread {
    /// Becomes readable when it is over.
    pub(crate) over: UnixStream,
    result: Receiver<Result<AgentReady, String>>,
}

/// The program that becomes the agent.
pub(crate) fn own_program() -> io::Result<File> {
    copies::describe(Path::new(OWN))
}

impl SetupThread {
    /// Begins a setup over `stream`, the standard streams of an ssh that runs the script for
    /// `program`.
    pub(crate) fn start(stream: OwnedFd, program: File, setup: Setup) -> io::Result<Self> {
        let (over, done) = UnixStream::pair()?;
        let (sender, result) = mpsc::channel();
        std::thread::Builder::new()
            .name("host".to_owned())
            .spawn(move || {
                // The network may have ended in the meantime.
                let _ = sender.send(begin(stream, &program, &setup));
                drop(done);
            })?;
        Ok(Self { over, result })
    }

    /// The result of the setup.
    pub(crate) fn result(self) -> Result<AgentReady, String> {
        let result = self.result.recv();
        result.unwrap_or_else(|_| Err("the thread that connects has panicked".to_owned()))
    }
}

fn begin(stream: OwnedFd, program: &File, setup: &Setup) -> Result<AgentReady, String> {
    let lost = |error: io::Error| match error.kind() {
        io::ErrorKind::UnexpectedEof
        | io::ErrorKind::BrokenPipe
        | io::ErrorKind::ConnectionReset => "the connection has ended".to_owned(),
        _ => error.to_string(),
    };
    let mut out = TimedStream(stream.try_clone().map_err(lost)?);
    let mut input = BufReader::new(TimedStream(stream));
    let mut copied = (0, 0);
    let first = said(&mut input).map_err(lost)?;
    let (state, machine) = first.split_once(' ').unwrap_or((&first, ""));
    let own = rustix::system::uname();
    let own = format!(
        "{} {}",
        own.sysname().to_string_lossy(),
        own.machine().to_string_lossy()
    );
    if machine != own {
        return Err(format!(
            "it is another kind of machine ({machine}, this one is {own}), and what is built here does not run there; \
             run `rcdeploy up` on a machine like it"
        ));
    }
    if state == "wants" {
        copies::send(program, Path::new(OWN), &mut out).map_err(lost)?;
        copied = (1, program.size);
    }
    said(&mut input).map_err(lost)?;
    let files = setup.files.iter().map(|path| {
        let file = copies::describe(path);
        file.map_err(|error| format!("cannot read {}: {error}", path.display()))
    });
    let files: Vec<File> = files.collect::<Result<_, _>>()?;
    let message = SupervisorMessage::Network {
        name: setup.network.clone(),
        files: files.clone(),
        services: setup.services.clone().unwrap_or_else(|| "[]".to_owned()),
    };
    out.write_all(&lines::encode(&message)).map_err(lost)?;
    loop {
        let text = read_line(&mut input).map_err(lost)?;
        let message = serde_json::from_str(&text);
        match message
            .map_err(|_| format!("its agent sent an unknown message: `{}`", clean(&text)))?
        {
            AgentMessage::Missing(wanted) => {
                for at in wanted.into_iter().filter(|at| *at < files.len()) {
                    let file = &files[at];
                    let sent = copies::send(file, &setup.files[at], &mut out);
                    sent.map_err(lost)?;
                    copied = (copied.0 + 1, copied.1 + file.size);
                }
            }
            AgentMessage::Ready { root, recovered } => {
                return Ok(AgentReady {
                    root,
                    copied,
                    again: false,
                    recovered,
                });
            }
            AgentMessage::Refused(why) => return Err(why),
            // It waits for an earlier agent to end.
            _ => {}
        }
    }
}

/// The rest of the next line that the script prints.
fn said(input: &mut BufReader<TimedStream>) -> io::Result<String> {
    for _ in 0..GREETING {
        let line = read_line(input)?;
        if let Some(said) = line.strip_prefix(TOKEN) {
            return Ok(clean(said.trim()));
        }
    }
    let message = "its login prints more than a thousand lines";
    Err(io::Error::other(message))
}
