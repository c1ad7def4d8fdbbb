//! Resolves a name of a command line to a topic, or to the calls of an operation.

use crate::error::Error;
use crate::network::{End, Network, Operation, Topic};
use crate::observer::{FeedId, Observer};

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

    /// The end whose messages come from another machine, if there is one: their times of sending
    /// are those of its clock.
    pub fn elsewhere(&self) -> Option<&End> {
        match self {
            Self::Topic(topic) => topic.publishers.iter().find(|end| end.host.is_some()),
            Self::Calls(operation) => Some(&operation.server).filter(|end| end.host.is_some()),
        }
    }
}
