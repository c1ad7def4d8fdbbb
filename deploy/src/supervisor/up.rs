//! `up`: what it takes, what it gives back, and what stands around the loop.

use crate::guard::guard_process::GuardCommand;
use crate::guard::lock::Lock;
use crate::guard::process_registry::{Recovered, recover_locked};
use crate::log::reporter::{Output, Reporter};
use crate::supervisor::check;
use crate::supervisor::detach::Launcher;
use crate::supervisor::supervise::Supervisor;
use rc_deploy_client::Format;
use rc_deploy_client::error::Error;
use rc_deploy_network::plan::Plan;
use rc_management::event::{Event, Severity};
use std::any::Any;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Starts a view of a network, and ends it when it is dropped. The flag is set while the view covers the streams.
pub type StartView = fn(network: &str, covers: Arc<AtomicBool>) -> Box<dyn Any>;

/// How a network is run.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The form of the events.
    pub format: Format,
    /// Show what the components print.
    pub relay: bool,
    /// Starts a view that covers the terminal. Events that are not as usual are reported after it.
    pub view: Option<StartView>,
    /// This is the background process that [`detach`](fn@crate::supervisor::detach::detach) started: it leaves the terminal's session,
    /// and says on standard output when the network is up.
    pub supervisor: bool,
    /// How long a log may become before it is turned over, in bytes; 16 MiB if not told.
    pub log_limit: Option<u64>,
    /// How often the memory of components is read; twice a minute if not told.
    pub memory_pause: Option<Duration>,
    /// How the guard is started, if not as this program with the argument `guard`.
    pub guard: Option<GuardCommand>,
    /// The shared-memory services that the guards of other machines hold, as JSON, by the name of the machine.
    pub services: BTreeMap<String, String>,
}

/// How an `up` ended.
#[derive(Debug)]
pub enum Outcome {
    /// All components ended as they should. Of [`detach`](fn@crate::supervisor::detach::detach): the network is up.
    Done,
    /// It was asked to stop, and did.
    Stopped,
    /// A component failed, as was reported.
    Failed(String),
    /// It could not be tried, as was reported.
    Refused(Error),
}

impl Outcome {
    /// The exit code of the command.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Done | Self::Stopped => 0,
            Self::Failed(_) => 3,
            Self::Refused(error) => error.exit_code(),
        }
    }

    /// What went wrong.
    pub fn message(&self) -> Option<String> {
        match self {
            Self::Done | Self::Stopped => None,
            Self::Failed(message) => Some(message.clone()),
            Self::Refused(error) => Some(error.to_string()),
        }
    }
}

/// Starts a network and keeps it until it ends or is asked to.
///
/// Everything is reported as events, failures too: on the streams of this process, or in the supervisor's log.
/// `cleanup` wipes what the middleware keeps in memory for this network, before the run directory is removed; it
/// has to bear being called when there is nothing to wipe. SIGINT, SIGTERM and SIGHUP stop the network; a second
/// one kills it.
pub fn up(plan: &Plan, options: &Options, cleanup: &dyn Fn()) -> Outcome {
    let launcher = match options.supervisor.then(Launcher::inherited).transpose() {
        Ok(launcher) => launcher,
        Err(error) => return refused(error, "use the launcher's socket"),
    };
    let output = if options.supervisor {
        Output::Log
    } else {
        Output::Streams
    };
    let width = plan.components.iter().map(|c| c.name.len()).max();
    let report = match Reporter::start(options.format, output, width.unwrap_or(0)) {
        Ok(report) => report,
        Err(error) => return refused(error, "write events"),
    };
    let outcome = match prepare(plan, options, cleanup, &report) {
        Ok(ready) => {
            let view = options.view;
            let view = view.map(|start| start(&plan.network, report.covered()));
            let view = RefCell::new(view);
            let cleanup = || {
                // What the clean-up says is to be read.
                drop(view.take());
                cleanup();
            };
            ready.with(launcher).run(&cleanup)
        }
        Err(error) => {
            let message = error.to_string();
            report.event(Event::network(Severity::Error, "refused", message.clone()));
            if let Some(launcher) = launcher {
                launcher.failed(&message);
            }
            Outcome::Refused(error)
        }
    };
    report.flush();
    outcome
}

fn refused(error: io::Error, action: &str) -> Outcome {
    Outcome::Refused(Error::System {
        action: action.to_owned(),
        source: error,
    })
}

/// Takes the network and makes all that the loop needs. Nothing is left behind if that fails.
fn prepare<'p>(
    plan: &'p Plan,
    options: &Options,
    cleanup: &dyn Fn(),
    report: &'p Reporter,
) -> Result<Supervisor<'p>, Error> {
    check::check(plan)?;
    let lock = Lock::acquire(&plan.network)?;
    if let Recovered::Killed(count) = recover_locked(&lock, cleanup)? {
        let text = format!(
            "an earlier run of {} had lost its supervisor and its guard; what it left was removed, {count} processes were killed",
            plan.network
        );
        report.event(Event::network(Severity::Warning, "recovered", text));
    }
    let directory = lock.directory().clone();
    Supervisor::new(plan, options, lock, report).inspect_err(|_| {
        // Nothing was started yet; and the error that is reported is the first one.
        let _ = directory.remove();
    })
}
