//! Resolves a name of a command line to a topic, or to the calls of an operation.

use crate::clock::MachineClock;
use crate::error::Error;
use crate::network::{End, Network, Operation, Topic};
use crate::observer::{FeedId, Observer};

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
pub enum Source {
    /// The samples of a topic.
    Topic(Topic),
    /// The requests and replies of an operation.
    Calls(Operation),
}

impl Source {
    /// Finds what a name means. The error names the nearest topic or operation.
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

    /// The clock of the messages' times of sending. A message does not name its machine: where
    /// several machines send, the clock cannot be told.
    pub fn sending_clock(&self) -> SendingClock<'_> {
        let (ends, clock) = match self {
            // The component whose memory the samples are in copies them, with its times.
            Self::Topic(topic) if topic.middleware == rc_iceoryx2::NAME => {
                (topic.publishers.iter().collect(), MachineClock::Monotonic)
            }
            Self::Topic(topic) => (topic.publishers.iter().collect(), MachineClock::System),
            Self::Calls(operation) => {
                let server = std::iter::once(&operation.server);
                let ends: Vec<&End> = server.chain(&operation.clients).collect();
                (ends, MachineClock::Monotonic)
            }
        };
        let Some(first) = ends.first() else {
            return SendingClock::Unknown;
        };
        if let Some(other) = ends.iter().find(|end| end.host != first.host) {
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
}
