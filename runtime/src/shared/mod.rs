//! Several components in one process, each on a thread of its own.
//!
//! A component has here everything that it has in its own process: its name, its event loop, its
//! parameters, its management socket, its link to the supervisor, its log. The process handles the
//! signals. A component that ends without an error ends alone. One that fails or panics ends the
//! process: the others end in order, each within its limit.
//!
//! The unique resources of a process are shared: the environment, the working directory, the panic
//! hook, and the log of threads that a worker starts itself, which is standard error.

mod command_line;
mod handover;
mod panics;
pub(crate) mod place;

use crate::adapter;
use crate::arguments::Arguments;
use crate::command_line::Task;
use crate::description::Description;
use crate::dispatch::Serving;
use crate::error::StartError;
use crate::link::Link;
use crate::log::{self, ComponentOutput, print_error};
use crate::notify::{self, ServiceState};
use crate::probe::{self, ProbeResult};
use crate::process::{own_program, printed, run_with};
use crate::signals::Signals;
use crate::stages::{Hosting, Prepared};
use crate::status::DoneBeside;
use crate::waker::{Waker, Wakeups, waker};
use command_line::{Invocation, Member};
use handover::{Handed, ProcessLink};
use place::{MemberState, Place, Report, Reports};
use rc_middleware::WakeEvent;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};
use std::borrow::Cow;
use std::ffi::OsString;
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// The stack of a thread if that of the first thread has no limit, in bytes.
const STACK: usize = 8 << 20;
/// The largest one: a huge limit of the system would reserve as much for each thread.
const MOST_STACK: usize = 64 << 20;

/// A component that is linked into a program of several ones.
#[derive(Debug)]
pub struct ComponentType {
    description: &'static Description,
    /// Runs it on this thread.
    run: fn(Prepared<'_>) -> Result<(), StartError>,
    /// Does what its own program does with these arguments.
    alone: fn(Vec<OsString>, PathBuf) -> u8,
}

impl ComponentType {
    /// The component with the worker `W` and the context `C` of its generated code.
    pub const fn new<W: 'static, C: Serving<W>>() -> Self {
        Self {
            description: C::DESCRIPTION,
            run: |prepared| prepared.run(adapter::start::<W, C>, &[]),
            alone: |args, program| run_with(C::DESCRIPTION, adapter::start::<W, C>, args, program),
        }
    }

    /// The name after `Component` in its `.cdsl`.
    fn name(&self) -> &'static str {
        self.description.name
    }
}

/// Runs components on threads of this process, with the command line of this process, until all
/// have ended. Returns the exit code.
///
/// `rcdeploy up --build` writes the program that calls it, for the components of a `process` of a
/// network.
///
/// ```ignore
/// static COMPONENTS: &[ComponentType] = &[
///     ComponentType::new::<camera::SpecificWorker, camera_generated::Context>(),
///     ComponentType::new::<tracker::SpecificWorker, tracker_generated::Context>(),
/// ];
///
/// fn main() -> std::process::ExitCode {
///     rc_runtime::run_components(COMPONENTS)
/// }
/// ```
pub fn run_components(types: &'static [ComponentType]) -> ExitCode {
    let program = own_program();
    let code = run(types, std::env::args_os().skip(1), &program);
    ExitCode::from(code.unwrap_or_else(|error| {
        print_error(&error.report_line(&name_of(&program)));
        error.exit_code()
    }))
}

/// The name of the program in messages.
fn name_of(program: &Path) -> Cow<'_, str> {
    let name = program.file_name().unwrap_or(program.as_os_str());
    name.to_string_lossy()
}

/// Errors are those of the process; those of components are printed here.
fn run(
    types: &'static [ComponentType],
    args: impl IntoIterator<Item = OsString>,
    program: &Path,
) -> Result<u8, StartError> {
    // The notes must be in the executable, and nothing else refers to them.
    for of in types {
        std::hint::black_box(of.description.note);
    }
    let mut members = match command_line::parse(types, args).map_err(StartError::Usage)? {
        Invocation::Run(members) => members,
        Invocation::Help => {
            rc_diagnostics::print::data(&command_line::help(types));
            return Ok(printed(&name_of(program), 0));
        }
    };
    let mut tasks = Vec::new();
    for member in &members {
        let parsed = crate::command_line::parse(member.of.description, member.args.clone());
        let named = |error| StartError::Usage(format!("{}: {error}", member.of.name()));
        tasks.push(parsed.map_err(named)?);
    }
    if tasks.len() > 1 && tasks.iter().all(|task| matches!(task, Task::Probe(..))) {
        return Ok(probe(&tasks, program));
    }
    let all = tasks.len();
    let arguments: Vec<Arguments> = tasks
        .into_iter()
        .filter_map(|task| match task {
            Task::Run(arguments) => Some(arguments),
            Task::Check(_) | Task::Replay(_) | Task::Probe(..) | Task::Print(_) => None,
        })
        .collect();
    if arguments.len() < all {
        if members.len() == 1 {
            let member = members.remove(0);
            return Ok((member.of.alone)(member.args, program.to_owned()));
        }
        return Err(StartError::Usage(
            "--help, --version, --check and --replay take one component, --probe one or all"
                .to_owned(),
        ));
    }
    Process::new(members.into_iter().zip(arguments).collect(), program)?.run()
}

/// Asks the running components. Returns the exit code.
fn probe(tasks: &[Task], program: &Path) -> u8 {
    let asked = tasks.iter().filter_map(|task| match task {
        Task::Probe(arguments, wait) => Some((arguments, *wait)),
        Task::Run(_) | Task::Check(_) | Task::Replay(_) | Task::Print(_) => None,
    });
    let (asked, waits): (Vec<&Arguments>, Vec<Duration>) = asked.unzip();
    let names = asked.iter().map(|one| (&*one.network, &*one.name));
    let wait = waits.into_iter().max().unwrap_or_default();
    let results = probe::probe(&names.collect::<Vec<_>>(), wait);
    for (one, result) in asked.iter().zip(&results) {
        rc_diagnostics::print::line(format_args!("{}: {}", one.name, result.text()));
    }
    let mut codes = results.iter().map(ProbeResult::code);
    let code = codes.find(|code| *code != 0).unwrap_or(0);
    printed(&name_of(program), code)
}

/// A component of this process.
struct Hosted {
    arguments: Arguments,
    member: Member,
    /// The components before it: indices.
    after: Vec<usize>,
    wake_event: WakeEvent,
    output: ComponentOutput,
    link: Option<UnixStream>,
    phase: Phase,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    Waiting,
    Started,
    Ready,
    Ended,
}

/// The process, on its first thread.
struct Process<'p> {
    program: &'p Path,
    members: Vec<Hosted>,
    signals: Signals,
    link: Option<ProcessLink>,
    sender: Sender<Report>,
    reports: Receiver<Report>,
    waker: Waker,
    wakeups: Wakeups,
    is_stopping: bool,
    /// The components that have ended in order while the others run.
    done: DoneBeside,
    /// The code of the first component that failed, and when.
    failed: Option<(u8, Instant)>,
}

impl<'p> Process<'p> {
    fn new(members: Vec<(Member, Arguments)>, program: &'p Path) -> Result<Self, StartError> {
        let names: Vec<String> = members.iter().map(|(_, a)| a.name.clone()).collect();
        let (link, handed) = if Link::is_expected() {
            let taken = ProcessLink::inherited(members.len());
            let refused = |e| StartError::System(format!("its supervisor: {e}"));
            let (link, handed) = taken.map_err(refused)?;
            (Some(link), handed)
        } else {
            (None, Vec::new())
        };
        let mut handed = handed.into_iter();
        let mut all = Vec::new();
        for (at, (member, arguments)) in members.into_iter().enumerate() {
            let name = &arguments.name;
            if names[..at].contains(name) {
                return Err(StartError::Usage(format!(
                    "two components have the --name `{name}`; choose another one"
                )));
            }
            let after = member.after.iter().map(|other| {
                let found = names.iter().position(|name| name == other);
                let unknown = || {
                    StartError::Usage(format!(
                        "--after: no component of this process has the --name `{other}`"
                    ))
                };
                found.filter(|other| *other != at).ok_or_else(unknown)
            });
            let after = after.collect::<Result<_, _>>()?;
            let (link, output) = match handed.next() {
                Some(Handed { link, log }) => (Some(link), ComponentOutput::File(Arc::new(log))),
                None => (None, ComponentOutput::Named(name.as_str().into())),
            };
            all.push(Hosted {
                after,
                wake_event: WakeEvent::new()
                    .map_err(|e| StartError::cannot_create("an event", &e))?,
                output,
                link,
                phase: Phase::Waiting,
                arguments,
                member,
            });
        }
        let after: Vec<Vec<usize>> = all.iter().map(|one| one.after.clone()).collect();
        for (hosted, after) in all.iter_mut().zip(without_circles(&after)) {
            hosted.after = after;
        }
        let signals =
            Signals::register().map_err(|e| StartError::cannot_create("a signal handler", &e))?;
        let (waker, wakeups) =
            waker().map_err(|e| StartError::cannot_create("a socket pair", &e))?;
        let (sender, reports) = channel();
        Ok(Self {
            program,
            members: all,
            signals,
            link,
            sender,
            reports,
            waker,
            wakeups,
            is_stopping: false,
            done: DoneBeside::default(),
            failed: None,
        })
    }

    fn run(mut self) -> Result<u8, StartError> {
        panics::note();
        notify::await_components(self.members.len());
        // The log of threads that a worker starts.
        let _log = log::start(None, true, &log::Output::Process)?;
        loop {
            self.start_members();
            if self.members.iter().all(|one| one.phase == Phase::Ended) {
                break;
            }
            if self.name_late_members() {
                break;
            }
            self.wait();
        }
        Ok(self.failed.map_or(0, |(code, _)| code))
    }

    /// Starts the components that wait for no other one.
    fn start_members(&mut self) {
        for at in 0..self.members.len() {
            if self.members[at].phase != Phase::Waiting {
                continue;
            }
            let waits = self.members[at]
                .after
                .iter()
                .any(|other| !matches!(self.members[*other].phase, Phase::Ready | Phase::Ended));
            if !waits {
                self.start(at);
            }
        }
    }

    fn start(&mut self, at: usize) {
        let hosted = &mut self.members[at];
        hosted.phase = Phase::Started;
        let reports = Reports {
            member: at,
            sender: self.sender.clone(),
            waker: self.waker.clone(),
        };
        let place = Place {
            program: self.program.to_owned(),
            link: hosted.link.take(),
            output: hosted.output.clone(),
            reports: reports.clone(),
            done: self.done.clone(),
        };
        let (of, arguments) = (hosted.member.of, hosted.arguments.clone());
        let (cpu, priority) = (hosted.member.cpu.clone(), hosted.member.priority);
        let wake_event = hosted.wake_event.clone();
        let thread = std::thread::Builder::new()
            .name(hosted.arguments.name.clone())
            .stack_size(stack());
        let started = thread.spawn(move || {
            let hosting = Hosting::Shared(place);
            let run = || {
                rc_scheduling::set(&cpu, priority).map_err(StartError::System)?;
                let prepared = Prepared::new(of.description, &arguments, wake_event, &hosting)?;
                (of.run)(prepared)
            };
            let ended = catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|payload| {
                let panic = panics::taken(&*payload);
                Err(StartError::System(format!(
                    "the component panicked: {panic}"
                )))
            });
            // The link is closed before the process knows of the end.
            drop(hosting);
            reports.send(MemberState::Ended(ended));
        });
        if let Err(error) = started {
            self.ended(at, Err(StartError::cannot_create("its thread", &error)));
        }
    }

    fn ended(&mut self, at: usize, result: Result<(), StartError>) {
        let hosted = &mut self.members[at];
        let before = std::mem::replace(&mut hosted.phase, Phase::Ended);
        if result.is_ok() && !self.is_stopping {
            self.done.add(&hosted.arguments.name);
            // It has done its work before it was ready: the others are not to wait for it.
            if before == Phase::Started {
                notify::notify(ServiceState::Ready);
            }
        }
        if let Err(error) = result {
            let name = &hosted.arguments.name;
            let mut words = error.report_line(name);
            if matches!(error, StartError::Configuration(_)) {
                words += &format!("{name}: error: its configuration is wrong\n");
            }
            if let ComponentOutput::File(log) = &hosted.output {
                // A log on a full disk is no reason to go on.
                let _ = (&**log).write_all(words.as_bytes());
            }
            print_error(&words);
            self.failed
                .get_or_insert((error.exit_code(), Instant::now()));
            self.stop();
        }
    }

    /// Ends all components in order.
    fn stop(&mut self) {
        if !std::mem::replace(&mut self.is_stopping, true) {
            notify::notify(ServiceState::Stopping);
        }
        for hosted in &mut self.members {
            hosted.wake_event.stop();
            if hosted.phase == Phase::Waiting {
                hosted.phase = Phase::Ended;
            }
        }
    }

    /// When the components that still run have to have ended, if one has failed.
    fn deadline(&self) -> Option<Instant> {
        let (_, since) = self.failed?;
        let running = self.members.iter().filter(|one| one.phase != Phase::Ended);
        running.map(|one| since + one.member.stop).max()
    }

    /// Whether components have not ended within their limits after another one has failed. Names
    /// them.
    fn name_late_members(&self) -> bool {
        let is_late = self.deadline().is_some_and(|at| Instant::now() >= at);
        if is_late {
            for name in self.running() {
                print_error(&format!(
                    "{name}: error: it has not ended within its limit\n"
                ));
            }
        }
        is_late
    }

    /// The names of the components that have not ended.
    fn running(&self) -> impl Iterator<Item = &str> {
        let running = self.members.iter().filter(|one| one.phase != Phase::Ended);
        running.map(|one| one.arguments.name.as_str())
    }

    /// Waits for a signal, the end of the link, or a report.
    fn wait(&mut self) {
        let mut polled = vec![
            PollFd::new(&self.wakeups, PollFlags::IN),
            PollFd::new(&self.signals, PollFlags::IN),
        ];
        if let Some(link) = &self.link {
            polled.push(PollFd::new(link, PollFlags::IN));
        }
        let limit = self.deadline();
        let limit = limit.map(|at| at.saturating_duration_since(Instant::now()));
        let limit = limit.and_then(|limit| Timespec::try_from(limit).ok());
        match poll(&mut polled, limit.as_ref()) {
            Err(Errno::INTR) | Ok(_) => {}
            // If memory is short for a moment, this thread must not spin.
            Err(_) => std::thread::sleep(Duration::from_millis(10)),
        }
        let mut ready = polled.iter().map(|one| !one.revents().is_empty());
        let woken = ready.next() == Some(true);
        let signalled = ready.next() == Some(true);
        let linked = ready.next() == Some(true);
        if woken {
            self.wakeups.take();
        }
        if signalled {
            if self.signals.take() {
                for name in self.running() {
                    print_error(&format!("{name}: ended at once by a second signal\n"));
                }
                std::process::exit(3);
            }
            self.stop();
        }
        if linked && self.link.as_ref().is_some_and(ProcessLink::is_closed) {
            self.link = None;
            self.stop();
        }
        while let Ok(report) = self.reports.try_recv() {
            match report.state {
                MemberState::Ready => self.members[report.member].phase = Phase::Ready,
                MemberState::Ended(result) => self.ended(report.member, result),
            }
        }
    }
}

/// For each component those that it waits for, but for those that wait for it, directly or not:
/// they start together.
fn without_circles(after: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let reached = |from: usize| {
        let mut seen = vec![false; after.len()];
        let mut next = after[from].clone();
        while let Some(one) = next.pop() {
            if !std::mem::replace(&mut seen[one], true) {
                next.extend(&after[one]);
            }
        }
        seen
    };
    let reached: Vec<Vec<bool>> = (0..after.len()).map(reached).collect();
    let all = after.iter().enumerate();
    all.map(|(at, others)| {
        let others = others.iter().copied();
        others.filter(|other| !reached[*other][at]).collect()
    })
    .collect()
}

/// The stack of the first thread, which a component has in a process of its own.
fn stack() -> usize {
    let limit = getrlimit(Resource::Stack).current;
    limit.map_or(STACK, |bytes| {
        usize::try_from(bytes).map_or(STACK, |bytes| bytes.min(MOST_STACK))
    })
}

#[cfg(test)]
mod tests {
    use super::without_circles;

    #[test]
    fn components_that_wait_for_each_other_start_together() {
        // 0 and 1 wait for each other, 1 also for 3; 2 waits for the circle, 4 for 2 and 3.
        let after = vec![vec![1], vec![0, 3], vec![0], vec![], vec![2, 3]];
        let expected = vec![vec![], vec![3], vec![0], vec![], vec![2, 3]];
        assert_eq!(without_circles(&after), expected);
        // A longer circle, and one that only waits for it.
        let after = vec![vec![1], vec![2], vec![0], vec![2]];
        let expected = vec![vec![], vec![], vec![], vec![2]];
        assert_eq!(without_circles(&after), expected);
    }
}
