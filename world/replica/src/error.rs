//! Why a change is refused.

use thiserror::Error;

/// Why a change of a world is refused. Nothing has changed then.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The graph or its schema does not allow the change.
    #[error(transparent)]
    Graph(#[from] property_graph::Error),
    /// The replica does not allow the change.
    #[error(transparent)]
    Merge(#[from] graph_merge::Error),
    /// The component does not say that it writes this.
    #[error("this component does not write `{0}`: add it to `writes` of its world")]
    NotWritten(String),
    /// The change adds an element with an id of its own.
    #[error("an element of a world gets its id from the replica: use `add_node` and `add_edge`")]
    ForeignId,
    /// The world has too many elements.
    #[error("a world has at most {0} elements")]
    TooMany(usize),
    /// The text is not a token.
    #[error("expected a token like `1f:42`, found `{0}`")]
    Token(String),
    /// Replicas of different schemas do not meet.
    #[error("the other replica has another schema")]
    OtherSchema,
    /// The start file cannot be taken.
    #[error("the start of the world: {0}")]
    Start(String),
}
