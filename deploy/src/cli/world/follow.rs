//! The world of a network from now on, also after the network was started again.

use super::replica::{Listener, TURN};
use crate::cli::output::{Failure, system};
use rc_observe::{Network, Poller, Processes};
use std::time::{Duration, Instant};

/// The time between two attempts to join a network that was started again.
const AGAIN: Duration = Duration::from_secs(1);

/// A listener that is replaced when all components were restarted: their world is another one.
pub(super) struct Follower {
    pub(super) listener: Listener,
    processes: Processes,
    /// When it looked, and the processes.
    found: Poller<(Instant, Option<Processes>)>,
    /// When the network that was started again is joined.
    joins: Option<Instant>,
}

/// Events of a turn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Turn {
    /// The replica may have changed.
    Same,
    /// The listener is another one.
    Restarted,
    /// Ctrl-C, or nobody reads the output any more.
    Interrupted,
}

impl Follower {
    /// Joins the world of a network. `None` at Ctrl-C.
    pub(super) fn begin(network: &str) -> Result<Option<Self>, Failure> {
        let Some(mut listener) = Listener::joined(network, None)? else {
            return Ok(None);
        };
        listener.newcomers.hold();
        let name = listener.network.name.clone();
        let look = move || {
            let begin = Instant::now();
            let now = Network::look(&name).ok().map(|now| Processes::of(&now));
            (begin, now)
        };
        let found = Poller::begin(look, || {}).map_err(|error| system(&error))?;
        Ok(Some(Self {
            processes: Processes::of(&listener.network),
            listener,
            found,
            joins: None,
        }))
    }

    /// Takes what has come. It waits for some milliseconds if nothing has.
    pub(super) fn turn(&mut self) -> Result<Turn, Failure> {
        for (begin, now) in self.found.take() {
            let Some(now) = now else { continue };
            if self.processes.were_replaced_by(&now) {
                self.joins.get_or_insert_with(Instant::now);
            } else if self.processes.are_among(&now) {
                self.listener.take_newcomers(begin);
            }
        }
        if self.listener.newcomers.are_new() {
            self.found.poll_now();
        }
        let Some(due) = self.joins else {
            let goes_on = self.listener.turn(&mut |_| {})?;
            return Ok(if goes_on {
                Turn::Same
            } else {
                Turn::Interrupted
            });
        };
        if self.listener.is_interrupted() {
            return Ok(Turn::Interrupted);
        }
        if Instant::now() < due {
            std::thread::sleep(TURN);
            return Ok(Turn::Same);
        }
        match Listener::joined(&self.listener.network.name, None) {
            Ok(Some(mut listener)) => {
                listener.newcomers.hold();
                self.processes = Processes::of(&listener.network);
                (self.listener, self.joins) = (listener, None);
                Ok(Turn::Restarted)
            }
            Ok(None) => Ok(Turn::Interrupted),
            // Its components are not all there yet.
            Err(_) => {
                self.joins = Some(Instant::now() + AGAIN);
                Ok(Turn::Same)
            }
        }
    }
}
