//! Simulated time: a component of the network publishes it, the others follow.
//!
//! The source numbers its ticks. The runtime of a follower, not its worker, acknowledges a tick
//! when all due work has run: the samples that had come, then `compute()` if its period is over. So
//! a source may wait for all.
//!
//! | address | | |
//! |---|---|---|
//! | `NETWORK/rc-time/tick` | topic | [`protocol::Tick`], from the source |
//! | `NETWORK/rc-time` | command `done` | [`protocol::Done`], from each follower |
//! | that of a middleware's `NodeClock` | topic | of its own type, for its other nodes |

pub(crate) mod ends;
pub(crate) mod follower;
pub(crate) mod lockstep;
pub(crate) mod protocol;
pub(crate) mod schedule;
pub(crate) mod source;

use follower::Follower;
use source::Source;

pub use lockstep::{Order, TimeError};
pub use source::TimeSource;

/// Where a component takes its time from: `--clock` of its command line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) enum ClockChoice {
    /// No option: a component that simulates time is the source, another one has the clock of
    /// the system.
    #[default]
    Own,
    /// `system`
    System,
    /// `source`: this component is the source of its network.
    Source,
    /// `simulated`, `simulated:dds`: the source of the network, over this middleware; by default
    /// the component's own.
    Simulated(Option<String>),
}

impl ClockChoice {
    /// Parses the value of `--clock`.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let (word, middleware) = match text.split_once(':') {
            Some((word, middleware)) => (word, Some(middleware)),
            None => (text, None),
        };
        match (word, middleware) {
            ("system", None) => Ok(Self::System),
            ("source", None) => Ok(Self::Source),
            ("simulated", None) => Ok(Self::Simulated(None)),
            ("simulated", Some(name)) if rc_vocabulary::keys(name).is_some() => {
                Ok(Self::Simulated(Some(name.to_owned())))
            }
            _ => Err(format!(
                "--clock takes system, simulated, simulated:MIDDLEWARE or source, not `{text}`"
            )),
        }
    }
}

/// The part that a component has in the time of its network.
pub(crate) enum TimeRole {
    /// None: it has the clock of the system.
    System,
    Follower(Box<Follower>),
    Source(Box<Source>),
}
