//! Resolves a name of a command line to a topic, or to the calls of an operation.

use crate::clock::MachineClock;
use crate::error::Error;
use crate::network::{End, Network, Operation, Topic};
use crate::observer::{FeedId, Observer};
use crate::reach::{is_inside_process, shares_memory};

/// The clock by which the senders of a source stamp their messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SendingClock<'s> {
    /// The monotonic clock of this machine.
    Here,
    /// No sender describes itself: it may run on any machine.
    Unknown,
    /// A clock of another machine.
    Elsewhere {
        /// An end of that machine: its component reports the clock.
        end: &'s End,
        /// The machine.
        host: &'s str,
        /// Which clock it is.
        clock: MachineClock,
    },
    /// The clocks of several machines: these two ends are on different ones.
    Several([&'s End; 2]),
}

/// A topic, or the calls of an operation.
#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "a tool has a few of them, and none in a loop"
)]
pub enum Source {
    /// The samples of a topic.
    Topic(Topic),
    /// The requests and replies of an operation.
    Calls(Operation),
}

impl Source {
    /// Finds the target of a name. The error names the nearest topic or operation.
    pub fn find(network: &Network, wanted: &str) -> Result<Self, Error> {
        let help_of_topics = match network.topic(wanted) {
            Ok(topic) => return Ok(Self::Topic(topic)),
            Err(Error::Unknown { help, .. }) => help,
            Err(error) => return Err(error),
        };
        match network.operation(wanted) {
            Ok(operation) => Ok(Self::Calls(operation)),
            Err(Error::Unknown {
                network,
                name,
                help: help_of_calls,
                ..
            }) => {
                let is_near = |help: &str| help.contains("did you mean");
                let calls = is_near(&help_of_calls) && !is_near(&help_of_topics);
                Err(Error::Unknown {
                    network,
                    what: "topic or operation",
                    name,
                    help: if calls { help_of_calls } else { help_of_topics },
                })
            }
            Err(error) => Err(error),
        }
    }

    /// Observes it. For calls, all operations of the slot arrive.
    pub fn open(&self, observer: &mut Observer) -> Result<FeedId, Error> {
        match self {
            Self::Topic(topic) => observer.open(topic),
            Self::Calls(operation) => {
                observer.tap(&operation.server.component, &operation.server.slot)
            }
        }
    }

    /// The clock of the messages' times of sending. A message does not name its machine: if several
    /// machines send, the clock is not known.
    pub fn sending_clock(&self) -> SendingClock<'_> {
        match self {
            Self::Topic(topic) => topic.sending_clock(),
            Self::Calls(operation) => {
                let ends = std::iter::once(&operation.server).chain(&operation.clients);
                clock_of(ends, MachineClock::Monotonic)
            }
        }
    }
}

impl Topic {
    /// The clock of the samples' times of sending, as [`Source::sending_clock`].
    pub fn sending_clock(&self) -> SendingClock<'_> {
        if !shares_memory(&self.middleware) && !is_inside_process(&self.middleware) {
            return clock_of(self.publishers.iter(), MachineClock::System);
        }
        // Shared memory, as a process, has both ends on one machine. The component whose memory the samples are in
        // copies them, with their times.
        let ends = if self.publishers.is_empty() {
            &self.subscribers
        } else {
            &self.publishers
        };
        clock_of(ends.iter(), MachineClock::Monotonic)
    }
}

/// The clock of senders that are, or share the memory of, these ends.
fn clock_of<'e>(mut ends: impl Iterator<Item = &'e End>, clock: MachineClock) -> SendingClock<'e> {
    let Some(first) = ends.next() else {
        return SendingClock::Unknown;
    };
    if let Some(other) = ends.find(|end| end.host != first.host) {
        return SendingClock::Several([first, other]);
    }
    match first.host.as_deref() {
        Some(host) => SendingClock::Elsewhere {
            end: first,
            host,
            clock,
        },
        None => SendingClock::Here,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SYSTEM: MachineClock = MachineClock::System;

    fn end(component: &str, host: Option<&str>) -> End {
        End {
            component: component.into(),
            slot: "s".into(),
            host: host.map(str::to_owned),
            middlewares: Vec::new(),
        }
    }

    #[test]
    fn the_clock_is_that_of_the_machine_of_all_senders() {
        let here = [end("a", None), end("b", None)];
        let there = [end("c", Some("robot")), end("d", Some("robot"))];
        assert_eq!(clock_of([].iter(), SYSTEM), SendingClock::Unknown);
        assert_eq!(clock_of(here.iter(), SYSTEM), SendingClock::Here);
        assert_eq!(
            clock_of(there.iter(), SYSTEM),
            SendingClock::Elsewhere {
                end: &there[0],
                host: "robot",
                clock: SYSTEM,
            }
        );
        let both = [&here[0], &there[0]];
        let several = clock_of(both.into_iter(), SYSTEM);
        assert_eq!(several, SendingClock::Several(both));
    }
}
