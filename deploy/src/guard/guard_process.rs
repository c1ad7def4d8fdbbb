//! The guard: a second process that ends the components and removes all traces if its supervisor is
//! killed. It also holds the services of the network open, see [`HoldServices`].
//!
//! The supervisor reports each process over a socket, the guard's standard input. If the socket
//! closes without a farewell, the supervisor has ended unexpectedly. Components notice this through
//! their own links. The guard reports its progress over the same socket, see
//! [`crate::guard::guard_link`].

use crate::guard::lock::Lock;
use crate::guard::process_registry::{ProcessRegistry, RegisteredProcess};
use crate::process::identity::{Identity, Mark};
use crate::process::own_program::own_program;
use rc_deploy_client::error::{Error, ErrorContext, print_error};
use rc_deploy_network::services::Service;
use rc_management::lines::{self, Lines, Overlong};
use serde::{Deserialize, Serialize};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::io::{self, ErrorKind, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Command, ExitCode};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long a guard waits for its thread that holds services: longer than one opening may take.
const HOLD_LIMIT: Duration = Duration::from_secs(10);
const HOLD_LOOK: Duration = Duration::from_millis(5);

/// How many removed files are named.
const MOST_NAMED: usize = 3;

/// How the guard process is started: `PROGRAM ARGUMENTS… --network NETWORK`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GuardCommand {
    /// The program. It must call [`guard()`](fn@guard).
    pub program: PathBuf,
    /// Arguments that come before those of the guard.
    pub args: Vec<String>,
}

impl GuardCommand {
    /// This program, with the argument `guard`.
    pub fn own() -> io::Result<Self> {
        Ok(Self {
            program: own_program()?,
            args: vec!["guard".to_owned()],
        })
    }
}

/// The reports of a supervisor to its guard, one JSON line each.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Report {
    /// The first line.
    Network { mark: Mark },
    /// A service to hold.
    Hold(Service),
    /// A component was started.
    Started(RegisteredProcess),
    /// One has ended, with its process group.
    Ended { pid: i32 },
    /// Clean up after all dead processes; so many have died until now.
    CleanUp { deaths: u64 },
    /// Look whether services were removed.
    Look,
    /// All components have ended: no service is needed any more.
    Release,
    /// Everything is cleaned up. The guard has nothing to do.
    Farewell,
}

/// Answers of a guard, one JSON line each.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Answer {
    /// It guards: signals of the terminal do not reach it any more.
    Guarding,
    /// This many services were created, or could not be, which is in its log.
    Held { count: usize },
    /// A clean-up goes on.
    Cleaning,
    /// It has cleaned up after the last process of this component.
    Removed { component: String },
    /// It has cleaned up after so many deaths.
    Cleaned { deaths: u64 },
    /// Files or shared memory of the services that it holds were removed: some of them.
    Missing { files: Vec<String> },
    /// It has looked, and reported before what is missing.
    Looked,
    /// It holds no service any more.
    Released,
}

/// Work of [`HoldServices`].
#[derive(Debug)]
pub enum HoldTask {
    /// Create this service, and keep it open.
    Hold(Box<Service>),
    /// Clean up after processes that have died, this many until now. The last one of several such
    /// tasks represents all.
    CleanUp {
        /// How many have died.
        deaths: u64,
    },
    /// Look whether held services were removed.
    Look,
}

/// Progress of [`HoldServices`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HoldProgress {
    /// It holds one service more, or could not create it.
    Held,
    /// A clean-up goes on. Report it every half a second.
    Cleaning,
    /// It has cleaned up after the last process of this component.
    Removed(String),
    /// It has cleaned up after so many deaths.
    Cleaned(u64),
    /// These files and shared memory of held services were removed.
    Missing(Vec<PathBuf>),
    /// It has done [`HoldTask::Look`].
    Looked,
}

/// Holds the services of `network` on a thread of its own until `tasks` ends, and reports each
/// step.
pub type HoldServices =
    fn(network: &str, tasks: &Receiver<HoldTask>, report: &dyn Fn(HoldProgress));

/// Runs the guard process: `rcdeploy guard --network NETWORK`, which people never type.
///
/// `cleanup` removes the memory of the middleware for this network. It is also called if there is
/// nothing to remove.
pub fn guard(network: &str, hold: HoldServices, cleanup: &dyn Fn()) -> ExitCode {
    match watch(network, hold, cleanup) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            print_error(format_args!("guard of {network}: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}

fn watch(network: &str, hold: HoldServices, cleanup: &dyn Fn()) -> Result<(), Error> {
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::new(AtomicBool::new(false)))
            .context("ignore signals")?;
    }
    // Leaves the terminal. This fails only for a process group leader, which has left it already.
    let _ = rustix::process::setsid();
    let mut lock = Lock::inherited(network).context("take over the lock")?;
    let stdin = io::stdin()
        .as_fd()
        .try_clone_to_owned()
        .context("take over the supervisor's socket")?;
    let supervisor = UnixStream::from(stdin);
    match (&supervisor).write_all(&lines::encode(&Answer::Guarding)) {
        // A supervisor that was killed in the meantime: its reports can still be read.
        Err(error)
            if !matches!(
                error.kind(),
                ErrorKind::BrokenPipe | ErrorKind::ConnectionReset
            ) =>
        {
            return Err(error).context("answer the supervisor; only `rcdeploy up` starts `guard`");
        }
        _ => {}
    }
    let mut holder = Holder::start(network, hold, &supervisor).context("make a thread")?;
    let registry = match listen(&supervisor, &mut holder) {
        LinkEnd::Farewell => return Ok(()),
        LinkEnd::Stuck => {
            let stuck = io::Error::from(ErrorKind::TimedOut);
            return Err(stuck).context("end a thread that still creates services");
        }
        // The supervisor was killed before its first report: nothing runs yet.
        LinkEnd::Gone(None) => return wipe(&lock, holder, cleanup),
        LinkEnd::Gone(Some(registry)) => registry,
    };
    // It fails only where a new network has it, or a stranger.
    let _ = lock.inherit_name(network);
    let names: Vec<&str> = registry
        .components
        .iter()
        .map(|c| c.name.as_str())
        .collect();
    print_error(format_args!(
        "guard of {network} ({}): the supervisor has ended; components left: {}",
        Identity::own().map_or(0, |own| own.pid),
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(", ")
        }
    ));
    let killed = registry.end_all();
    print_error(format_args!(
        "guard of {network}: {killed} processes had to be killed"
    ));
    wipe(&lock, holder, cleanup)
}

/// Removes the traces of the network, unless a new network has taken its place.
fn wipe(lock: &Lock, mut holder: Holder, cleanup: &dyn Fn()) -> Result<(), Error> {
    if !holder.release() {
        return Err(restart()).context("end a thread that still creates services");
    }
    if lock.is_current() {
        cleanup();
        lock.remove_directory()
            .context("remove the run directory")?;
    }
    Ok(())
}

/// Replaces this process by the same program, with the same streams and without its threads. It
/// finds that its supervisor has ended, and removes the traces. Returns if that is not possible.
fn restart() -> io::Error {
    match own_program() {
        Ok(program) => Command::new(program)
            .args(std::env::args_os().skip(1))
            .exec(),
        Err(error) => error,
    }
}

/// The thread that holds the services.
struct Holder {
    tasks: Option<Sender<HoldTask>>,
    thread: Option<JoinHandle<()>>,
}

impl Holder {
    fn start(network: &str, hold: HoldServices, supervisor: &UnixStream) -> io::Result<Self> {
        let (tasks, received) = channel();
        let network = network.to_owned();
        let supervisor = supervisor.try_clone()?;
        let thread = std::thread::Builder::new().name("hold".to_owned());
        let thread = thread.spawn(move || {
            let count = std::cell::Cell::new(0);
            hold(&network, &received, &|progress| {
                let answer = match progress {
                    HoldProgress::Held => {
                        count.set(count.get() + 1);
                        Answer::Held { count: count.get() }
                    }
                    HoldProgress::Cleaning => Answer::Cleaning,
                    HoldProgress::Removed(component) => Answer::Removed { component },
                    HoldProgress::Missing(files) => {
                        let files = files.iter().take(MOST_NAMED);
                        let files = files.map(|path| path.display().to_string()).collect();
                        Answer::Missing { files }
                    }
                    HoldProgress::Cleaned(deaths) => Answer::Cleaned { deaths },
                    HoldProgress::Looked => Answer::Looked,
                };
                // A supervisor that was killed does not read.
                let _ = (&supervisor).write_all(&lines::encode(&answer));
            });
        })?;
        Ok(Self {
            tasks: Some(tasks),
            thread: Some(thread),
        })
    }

    fn give(&self, task: HoldTask) {
        if let Some(tasks) = &self.tasks {
            // A thread that panicked has said so in the log.
            let _ = tasks.send(task);
        }
    }

    /// Ends the thread after its present task. Waits for it, with a limit. Returns whether it has
    /// ended: if not, it may still create a service.
    fn release(&mut self) -> bool {
        self.tasks = None;
        let end = Instant::now() + HOLD_LIMIT;
        let Some(thread) = self.thread.take() else {
            return true;
        };
        while !thread.is_finished() {
            if Instant::now() >= end {
                return false;
            }
            std::thread::sleep(HOLD_LOOK);
        }
        true
    }
}

/// How the reports of the supervisor ended.
enum LinkEnd {
    /// The supervisor has cleaned up itself.
    Farewell,
    /// The supervisor was killed. Its processes are in the registry.
    Gone(Option<ProcessRegistry>),
    /// The services cannot be released while this process lives. The supervisor cleans up.
    Stuck,
}

/// Reads the reports of the supervisor until they end.
fn listen(supervisor: &UnixStream, holder: &mut Holder) -> LinkEnd {
    let mut lines = Lines::new(Overlong::Skip);
    let mut registry: Option<ProcessRegistry> = None;
    loop {
        let (complete, ended) = lines.read(supervisor);
        for line in complete {
            let Some(text) = line.into_text() else {
                continue;
            };
            match (serde_json::from_str(&text), &mut registry) {
                (Ok(Report::Network { mark }), _) => registry = Some(ProcessRegistry::new(mark)),
                (Ok(Report::Hold(service)), _) => holder.give(HoldTask::Hold(Box::new(service))),
                (Ok(Report::Started(component)), Some(registry)) => {
                    registry.components.push(component);
                }
                (Ok(Report::Ended { pid }), Some(registry)) => {
                    registry.components.retain(|c| c.process.pid != pid);
                }
                (Ok(Report::CleanUp { deaths }), _) => holder.give(HoldTask::CleanUp { deaths }),
                (Ok(Report::Look), _) => holder.give(HoldTask::Look),
                (Ok(Report::Release), _) => {
                    if !holder.release() {
                        return LinkEnd::Stuck;
                    }
                    // A supervisor that was killed does not read.
                    let _ = { supervisor }.write_all(&lines::encode(&Answer::Released));
                }
                (Ok(Report::Farewell), _) => return LinkEnd::Farewell,
                (Ok(_), None) => {
                    print_error(format_args!("guard: a report before the network: {text}"));
                }
                // The supervisor was killed while it wrote this line.
                (Err(error), _) => print_error(format_args!("guard: {error} in {text}")),
            }
        }
        if ended {
            return LinkEnd::Gone(registry);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader};

    /// Reports what each task asks for.
    fn hold(network: &str, tasks: &Receiver<HoldTask>, report: &dyn Fn(HoldProgress)) {
        assert_eq!(network, "net");
        for task in tasks {
            match task {
                HoldTask::Hold(_) => report(HoldProgress::Held),
                HoldTask::CleanUp { deaths } => {
                    report(HoldProgress::Cleaning);
                    report(HoldProgress::Removed("a".to_owned()));
                    report(HoldProgress::Cleaned(deaths));
                }
                HoldTask::Look => report(HoldProgress::Looked),
            }
        }
    }

    /// The guard's end of a link after these reports, and then the answers to them.
    fn answers(reports: &[Report]) -> (LinkEnd, Vec<Answer>) {
        let (ours, theirs) = UnixStream::pair().expect("a pair");
        let mut holder = Holder::start("net", hold, &theirs).expect("a thread");
        let text: Vec<u8> = reports.iter().flat_map(lines::encode).collect();
        (&ours).write_all(&text).expect("room");
        ours.shutdown(std::net::Shutdown::Write).expect("a socket");
        let end = listen(&theirs, &mut holder);
        assert!(holder.release(), "its thread ends");
        drop((holder, theirs));
        let lines = BufReader::new(ours).lines();
        let answers = lines.map(|line| {
            let line = line.expect("a line");
            serde_json::from_str(&line).expect("an answer")
        });
        (end, answers.collect())
    }

    fn network() -> Report {
        let own = Identity::own().expect("it runs");
        let mark = Mark::new("net", own);
        Report::Network { mark }
    }

    fn started(name: &str, pid: i32) -> Report {
        Report::Started(RegisteredProcess {
            name: name.to_owned(),
            process: Identity { pid, starttime: 1 },
            stop_ms: 100,
        })
    }

    #[test]
    fn a_guard_knows_the_processes_that_run_when_its_supervisor_is_gone() {
        let reports = [
            network(),
            started("a", 1),
            started("b", 2),
            started("c", 3),
            Report::Ended { pid: 2 },
        ];
        let (LinkEnd::Gone(Some(registry)), _) = answers(&reports) else {
            panic!("its supervisor has ended");
        };
        let names: Vec<&str> = registry.components.iter().map(|c| &*c.name).collect();
        assert_eq!(names, ["a", "c"]);
        assert!(matches!(answers(&[]).0, LinkEnd::Gone(None)));
        let early = [started("a", 1)];
        assert!(matches!(answers(&early).0, LinkEnd::Gone(None)));
        let farewell = [network(), Report::Farewell];
        assert!(matches!(answers(&farewell).0, LinkEnd::Farewell));
    }

    #[test]
    fn a_guard_answers_how_far_it_is() {
        let service = || Service {
            address: "a".to_owned(),
            types: "T".to_owned(),
            hash: 1,
            topic: false,
            depth: 0,
            keeps: false,
            users: Vec::new(),
        };
        let reports = [
            network(),
            Report::Hold(service()),
            Report::Hold(service()),
            Report::CleanUp { deaths: 3 },
            Report::Look,
            Report::Release,
            Report::Farewell,
        ];
        let component = "a".to_owned();
        assert_eq!(
            answers(&reports).1,
            [
                Answer::Held { count: 1 },
                Answer::Held { count: 2 },
                Answer::Cleaning,
                Answer::Removed { component },
                Answer::Cleaned { deaths: 3 },
                Answer::Looked,
                Answer::Released,
            ]
        );
    }
}
