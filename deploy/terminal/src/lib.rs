//! A live view of a network on a terminal: `rcdeploy up` beside the supervisor, `rcdeploy top` from
//! anywhere.
//!
//! ```text
//! input, sockets, log, clock → session → model → render → screen
//!                                └─ keys: what each key does
//! ```
//!
//! It is a client of the sockets that there are, on a thread or in a process of its own, so that a
//! terminal never holds up the supervision: `rcdeploy.sock` for the states, the events and orders,
//! the management of each component for all else.

mod actions;
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

/// How long the view may take to end when its network has.
const END_LIMIT: Duration = Duration::from_secs(1);

/// How a view was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewEnd {
    /// By the user; the network goes on.
    Running,
    /// Because the network is down.
    Down,
    /// Because the terminal is gone.
    Gone,
}

/// Shows a network that is up until the user leaves, or until it is down.
///
/// A view that is ended gives the terminal back: `stop` becomes readable when it is to end, as at a
/// signal.
pub fn top(network: &str, stop: BorrowedFd<'_>) -> Result<ViewEnd, Error> {
    check_name("network", network)?;
    // What is wrong is said before the terminal is taken.
    rc_deploy_client::connection::status(network)?;
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

/// The view of an `up`, on a thread of its own. When it is dropped, the terminal is as it was.
pub struct SideView {
    /// Closed to end the view.
    alive: Option<UnixStream>,
    ended: Receiver<()>,
    covered: Arc<AtomicBool>,
}

impl SideView {
    /// Starts the view. `covered` is set as long as it is there.
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
            // The terminal takes no output.
            screen::give_back_mode();
        }
        self.covered.store(false, Ordering::Relaxed);
    }
}

/// Tells that the view is gone.
struct ResumeOutput(Arc<AtomicBool>, mpsc::Sender<()>);

impl Drop for ResumeOutput {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Relaxed);
        // Nobody has to wait for it.
        let _ = self.1.send(());
    }
}
