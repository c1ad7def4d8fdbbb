//! Errors of a world.

use property_graph::Time;
use rc_world::Token;
use thiserror::Error;

/// Why a question has no answer, or a change is refused. A refused change has changed nothing.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The graph does not allow it.
    #[error(transparent)]
    Graph(Box<property_graph::Error>),
    /// The replica does not allow it.
    #[error(transparent)]
    World(Box<rc_world::Error>),
    /// No node has the name.
    #[error("there is no {kind} `{name}`")]
    Unknown {
        /// The wanted type; `node` for any.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// Several nodes have the name.
    #[error("there are several {kind} `{name}`")]
    Ambiguous {
        /// The wanted type; `node` for any.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// There is no such edge.
    #[error("there is no edge `{0}` between the nodes")]
    NoEdge(&'static str),
    /// The history begins later.
    #[error("the history begins later")]
    TooEarly,
    /// Nothing is known about the time yet.
    #[error("the newest change is of {newest:?}, before the wanted time")]
    TooLate {
        /// The time of the newest change.
        newest: Time,
    },
    /// A unit is none, or no unit of the attribute's kind.
    #[error("{0}")]
    Unit(String),
    /// A query that the schema names fails: an argument is of another type, or it takes more steps or rows
    /// than a query may.
    #[cfg(feature = "queries")]
    #[error(transparent)]
    Query(Box<graph_query::Error>),
    /// The replica does not have a change yet, nor within the time that was given to it.
    #[error("the replica does not have the change {0} yet")]
    Behind(Token),
}

impl From<property_graph::Error> for Error {
    fn from(error: property_graph::Error) -> Self {
        Self::Graph(error.into())
    }
}

impl From<rc_world::Error> for Error {
    fn from(error: rc_world::Error) -> Self {
        Self::World(error.into())
    }
}
