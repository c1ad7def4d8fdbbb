//! `up`: takes the network, runs the event loop, and returns the outcome.

use crate::guard::lock::Lock;
use crate::guard::process_registry::{Recovered, recover_locked};
use crate::log::reporter::{Output, Reporter};
use crate::process::descriptors;
use crate::supervisor::check;
use crate::supervisor::detach::Launcher;
use crate::supervisor::options::{Options, Outcome};
use crate::supervisor::supervise::Supervisor;
use rc_deploy_client::error::Error;
use rc_deploy_network::plan::Plan;
use rc_management::event::{Event, Severity};
use std::cell::RefCell;
use std::io;

/// Starts a network and supervises it until it ends or is stopped.
///
/// Everything is reported as events, including failures: on the standard streams, or in the
/// supervisor's log. `cleanup` removes the memory of the middleware for this network, before the
/// run directory is removed. It is also called if there is nothing to remove. SIGINT, SIGTERM and
/// SIGHUP stop the network; a second signal kills it.
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
                // The view ends first, so that messages of the cleanup can be read.
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

/// Takes the network and prepares the event loop. If this fails, nothing is left.
fn prepare<'p>(
    plan: &'p Plan,
    options: &Options,
    cleanup: &dyn Fn(),
    report: &'p Reporter,
) -> Result<Supervisor<'p>, Error> {
    check::check(plan)?;
    let here = plan.components.iter().filter(|c| c.host.is_none());
    descriptors::raise(here.count())?;
    let lock = Lock::acquire(&plan.network)?;
    if let Recovered::Killed(count) = recover_locked(&lock, cleanup)? {
        let text = format!(
            "an earlier run of {} lost its supervisor and its guard; rcdeploy removed its files and killed {count} orphaned processes",
            plan.network
        );
        report.event(Event::network(Severity::Warning, "recovered", text));
    }
    let directory = lock.directory().clone();
    Supervisor::new(plan, options, lock, report).inspect_err(|_| {
        // Nothing was started yet. The first error is reported.
        let _ = directory.remove();
    })
}
