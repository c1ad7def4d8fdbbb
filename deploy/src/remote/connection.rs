//! Sets up a connection on a separate thread, because that waits and copies.

use super::SupervisorMessage;
use super::copies;
use super::known_hashes::KnownHashes;
use super::ssh::TOKEN;
use super::timed_stream::{Beat, LONGEST, TimedStream, read_line};
use crate::process::own_program::OWN;
use rc_ddsl::model::Processor;
use rc_deploy_network::plan::{Elsewhere, Environment};
use rc_diagnostics::foreign::clean;
use rc_management::agent::{AgentMessage, File};
use rc_management::lines;
use std::io::{self, BufReader, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;

/// How many lines a login may print before the script starts.
const GREETING: usize = 1000;

/// Requirements of an agent before it starts.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) network: String,
    /// The files that the other machine needs, without duplicates.
    pub(crate) files: Vec<PathBuf>,
    /// Where the hashes of the files are kept.
    pub(crate) hashes: PathBuf,
    /// The virtual environments of components in Python, whose packages are among the files.
    pub(crate) environments: Vec<Environment>,
    /// The services that the guard there holds, as JSON.
    pub(crate) services: Option<String>,
    /// The pause between two readings of the memory of a component.
    pub(crate) memory_pause: Duration,
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
#[derive(Debug)]
pub(crate) struct AgentProgram {
    /// The file here.
    pub(crate) from: PathBuf,
    /// Its hash and length. The host has its own `rcdeploy` under the hash of this program.
    pub(crate) program: File,
    /// How the programs of the host are made, if not as those of this machine.
    pub(crate) elsewhere: Option<Elsewhere>,
}

/// Describes a program.
pub(crate) fn described(program: &Path) -> io::Result<File> {
    copies::describe(program, None, &mut || Ok(()))
}

impl SetupThread {
    /// Begins a setup over `stream`, the standard streams of an ssh that runs the script for
    /// `program`.
    pub(crate) fn start(stream: OwnedFd, program: AgentProgram, setup: Setup) -> io::Result<Self> {
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

/// Whether programs for a machine, as `uname -m` names it, run on another one. A kernel of 64 bits also
/// runs programs for 32-bit ARM: Raspberry Pi OS of 32 bits has one.
pub(crate) fn is_served(programs: &str, machine: &str) -> bool {
    let is_arm = || Processor::from_machine(programs) == Some(Processor::Armhf);
    programs == machine || ["aarch64", "armv8l"].contains(&machine) && is_arm()
}

/// Whether the program runs on a machine of this kind: `Linux aarch64`.
fn check_kind(kind: &str, program: &AgentProgram) -> Result<(), String> {
    let own = rustix::system::uname();
    let system = own.sysname().to_string_lossy();
    let own = format!("{system} {}", own.machine().to_string_lossy());
    let elsewhere = program.elsewhere.as_ref();
    let is_right = match elsewhere.map(|elsewhere| elsewhere.machine.as_ref()) {
        Some(Some(machine)) => kind
            .strip_prefix(&*format!("{system} "))
            .is_some_and(|there| is_served(machine, there)),
        // It builds its programs itself.
        Some(None) => kind.starts_with(&format!("{system} ")),
        None => kind == own,
    };
    if is_right {
        return Ok(());
    }
    let machine = kind.split(' ').nth(1).unwrap_or_default();
    let advice = match Processor::from_machine(machine) {
        Some(processor) => format!(
            "write `arch {processor};` in its `Host`, and run `rcdeploy up --build`, which builds its programs"
        ),
        None => "run `rcdeploy up` on a machine like it".to_owned(),
    };
    Err(format!(
        "it is another kind of machine ({kind}, this one is {own}), and what is built here does not run there; {advice}"
    ))
}

fn begin(stream: OwnedFd, program: &AgentProgram, setup: &Setup) -> Result<AgentReady, String> {
    let lost = |error: io::Error| lost(&error);
    let mut out = TimedStream(stream.try_clone().map_err(lost)?);
    let mut input = BufReader::new(TimedStream(stream));
    let mut copied = (0, 0);
    let first = said(&mut input)?;
    let (state, machine) = first.split_once(' ').unwrap_or((&first, "unknown"));
    check_kind(machine, program)?;
    if state == "wants" {
        if program.elsewhere.is_some() && program.from == Path::new(OWN) {
            return Err(format!(
                "it has no rcdeploy for its processor ({machine}); `rcdeploy up --build` builds one where the workspace names the sources of \
                 RoboComp. Otherwise, install rcdeploy {} there",
                env!("CARGO_PKG_VERSION")
            ));
        }
        let file = &program.program;
        copies::send(file, &program.from, &mut out).map_err(lost)?;
        copied = (1, file.size);
    }
    said(&mut input)?;
    let mut beat = Beat::new();
    let mut files: Vec<File> = Vec::new();
    let mut known = KnownHashes::read(setup.hashes.clone());
    for path in &setup.files {
        // The packages of an environment may take long, and so may one file.
        let mut sent = Ok(());
        let file = copies::describe(path, Some(&mut known), &mut || {
            sent = beat.send_due(&SupervisorMessage::Heartbeat, &mut out);
            match &sent {
                Ok(()) => Ok(()),
                Err(error) => Err(error.kind().into()),
            }
        });
        sent.map_err(lost)?;
        files.push(file.map_err(|error| format!("cannot read {}: {error}", path.display()))?);
    }
    known.finish();
    let message = SupervisorMessage::Network {
        name: setup.network.clone(),
        files: files.clone(),
        environments: setup.environments.clone(),
        services: setup.services.clone().unwrap_or_else(|| "[]".to_owned()),
        memory_pause_ms: u64::try_from(setup.memory_pause.as_millis()).unwrap_or(u64::MAX),
    };
    let line = lines::encode(&message);
    if line.len() as u64 > LONGEST {
        return Err(format!(
            "the list of its {} files is {} MiB long, and {} are allowed; remove packages that its components in Python do not \
             need from their `.venv`, or links to large folders from their `src`",
            files.len(),
            line.len() >> 20,
            LONGEST >> 20
        ));
    }
    out.write_all(&line).map_err(lost)?;
    loop {
        let text = read_line(&mut input).map_err(|(_, error)| lost(error))?;
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
            // It reads its copies, or waits for an earlier agent to end.
            _ => {}
        }
    }
}

/// The rest of the next line that the script prints. The login may have printed before it, also
/// without an end of line.
pub(super) fn said(input: &mut BufReader<TimedStream>) -> Result<String, String> {
    let mut greeting = String::new();
    for _ in 0..GREETING {
        let (line, error) = match read_line(input) {
            Ok(line) => (line, None),
            Err((line, error)) => (line, Some(error)),
        };
        match (line.split_once(TOKEN), error) {
            (Some((_, said)), None) => return Ok(clean(said.trim())),
            (_, error) => {
                if !line.trim().is_empty() {
                    greeting = clean(line.trim());
                }
                if let Some(error) = error {
                    return Err(without_script(&error, &greeting));
                }
            }
        }
    }
    Err("its login prints more than a thousand lines".to_owned())
}

/// Why the script did not run. `greeting` is what the login printed last.
fn without_script(error: &io::Error, greeting: &str) -> String {
    let why = lost(error);
    if greeting.is_empty() {
        return why;
    }
    format!(
        "{why} before a command ran there; its login printed `{greeting}`. The user needs a login shell that runs commands"
    )
}

/// Why the connection cannot be used.
fn lost(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof
        | io::ErrorKind::BrokenPipe
        | io::ErrorKind::ConnectionReset => "the connection has ended".to_owned(),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The result of a login that prints this, and then ends.
    fn heard(printed: &str) -> Result<String, String> {
        let (ours, mut theirs) = UnixStream::pair().expect("a pair");
        ours.set_nonblocking(true).expect("a mode");
        theirs.write_all(printed.as_bytes()).expect("room");
        drop(theirs);
        said(&mut BufReader::new(TimedStream(OwnedFd::from(ours))))
    }

    #[test]
    fn a_host_has_the_processor_that_its_programs_are_for() {
        let kind = |machine: Option<Option<&str>>, kind: &str| {
            let program = AgentProgram {
                from: PathBuf::from(OWN),
                program: File {
                    path: PathBuf::new(),
                    hash: String::new(),
                    size: 0,
                    executable: true,
                },
                elsewhere: machine.map(|machine| Elsewhere {
                    machine: machine.map(str::to_owned),
                    there: true,
                    program: None,
                }),
            };
            check_kind(kind, &program)
        };
        let own = rustix::system::uname();
        let own = format!("Linux {}", own.machine().to_string_lossy());
        assert_eq!(kind(None, &own), Ok(()));
        assert_eq!(kind(Some(Some("riscv64")), "Linux riscv64"), Ok(()));
        assert_eq!(kind(Some(None), "Linux mips"), Ok(()));
        // A kernel of 64 bits below programs of 32 bits, but not the other way round.
        assert_eq!(kind(Some(Some("armv7l")), "Linux aarch64"), Ok(()));
        assert!(kind(Some(Some("aarch64")), "Linux armv7l").is_err());
        let refused = kind(None, "Linux riscv64").expect_err("it is another one");
        assert!(
            refused.contains("write `arch riscv64;` in its `Host`"),
            "{refused}"
        );
        let refused = kind(Some(Some("aarch64")), "Linux riscv64").expect_err("another one");
        assert!(refused.contains("`arch riscv64;`"), "{refused}");
        let refused = kind(Some(None), "Plan9 mips").expect_err("it is no Linux");
        assert!(refused.contains("on a machine like it"), "{refused}");
    }

    #[test]
    fn a_login_may_print_before_the_script() {
        for greeting in ["", "Welcome!\n", "no end of line", "\n\n"] {
            let printed = format!("{greeting}{TOKEN} has Linux x86_64\n");
            assert_eq!(heard(&printed).as_deref(), Ok("has Linux x86_64"));
        }
    }

    #[test]
    fn a_login_that_runs_no_command_is_quoted() {
        for end in ["\n", ""] {
            let refused = heard(&format!("This account is not available.{end}"));
            let refused = refused.expect_err("no script runs");
            assert!(
                refused.contains("printed `This account is not available.`"),
                "{refused}"
            );
        }
        assert_eq!(
            heard("").expect_err("no script runs"),
            "the connection has ended"
        );
    }
}
