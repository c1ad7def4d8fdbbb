//! A live view of a network on a terminal: `rcdeploy up` together with the supervisor, `rcdeploy
//! top` from anywhere.
//!
//! ```text
//! input, sockets, log, clock → session → model → render → screen
//!                                └─ keys: what each key does
//! ```
//!
//! The view is a client of the sockets: `rcdeploy.sock` for states, events and commands, and the
//! management socket of each component. It runs on a separate thread or in a separate process, so
//! that a terminal never blocks the supervisor.

mod actions;
mod chains;
mod connection;
mod details;
mod input;
mod keys;
mod log;
mod model;
mod render;
mod rows;
mod screen;
mod session;
mod style;
#[cfg(test)]
mod tests;
mod text;
mod usage;

pub use screen::usable;

use model::{Host, Model};
use rc_deploy_client::error::{Error, ErrorContext};
use rc_deploy_client::names::check_name;
use screen::Screen;
use session::{End, Session};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;

/// How long the view may take to end after its network.
const END_LIMIT: Duration = Duration::from_secs(1);

/// How a view was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewEnd {
    /// The user has left it. The network continues to run.
    Running,
    /// The network is down.
    Down,
    /// The terminal is closed.
    Gone,
}

/// Shows a network that is up until the user leaves, or until it is down.
///
/// The view ends and restores the terminal when `stop` becomes readable, for example at a signal.
pub fn top(network: &str, stop: BorrowedFd<'_>) -> Result<ViewEnd, Error> {
    check_name("network", network)?;
    // Errors are reported before the view takes the terminal.
    rc_deploy_client::status::report(network)?;
    let end = show(Host::Top, network, stop)?;
    Ok(match end {
        End::Left => ViewEnd::Running,
        End::Down => ViewEnd::Down,
        End::Gone => ViewEnd::Gone,
    })
}

fn show(host: Host, network: &str, owner: BorrowedFd<'_>) -> Result<End, Error> {
    let mut screen = Screen::take().context("set up the terminal")?;
    let model = Model::new(host, network, screen::colours());
    Session::new(&mut screen, model, owner)?.run()
}

/// The view of an `up`, on a separate thread. Dropping it restores the terminal.
pub struct SideView {
    /// Closed to end the view.
    alive: Option<UnixStream>,
    ended: Receiver<()>,
    covered: Arc<AtomicBool>,
}

impl SideView {
    /// Starts the view. `covered` is set while the view covers the streams.
    pub fn start(network: &str, covered: Arc<AtomicBool>) -> Self {
        let (end, ended) = mpsc::channel();
        let mut view = Self {
            alive: None,
            ended,
            covered: Arc::clone(&covered),
        };
        let network = network.to_owned();
        covered.store(true, Ordering::Relaxed);
        let started = UnixStream::pair().and_then(|(ours, theirs)| {
            view.alive = Some(ours);
            let thread = std::thread::Builder::new().name("terminal".to_owned());
            thread.spawn(move || {
                // Also when this thread panics.
                let _uncovered = ResumeOutput(covered, end);
                if let Err(error) = show(Host::Up, &network, theirs.as_fd()) {
                    print_error(error);
                }
            })
        });
        if let Err(error) = started {
            view.covered.store(false, Ordering::Relaxed);
            print_error(Error::System {
                action: "start a thread".to_owned(),
                source: error,
            });
        }
        view
    }
}

#[expect(clippy::needless_pass_by_value, reason = "the end of an error")]
fn print_error(error: Error) {
    rc_deploy_client::error::print_error(format_args!(
        "rcdeploy: the view has ended, the network goes on: {error}"
    ));
}

impl Drop for SideView {
    fn drop(&mut self) {
        drop(self.alive.take());
        if self.ended.recv_timeout(END_LIMIT) == Err(mpsc::RecvTimeoutError::Timeout) {
            // The terminal blocks output.
            screen::restore_mode();
        }
        self.covered.store(false, Ordering::Relaxed);
    }
}

/// Reports the end of the view.
struct ResumeOutput(Arc<AtomicBool>, mpsc::Sender<()>);

impl Drop for ResumeOutput {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Relaxed);
        // The receiver may have ended.
        let _ = self.1.send(());
    }
}
