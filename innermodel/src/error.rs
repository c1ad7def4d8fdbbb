//! Errors of questions and changes.

use thiserror::Error;

/// Error of a question or of a change, which was not made. Texts of the caller are cleaned.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// No node has the id.
    #[error("no node has the id `{id}`{}", did_you_mean(nearest.as_deref()))]
    UnknownId {
        /// The id.
        id: String,
        /// The id that is most like it.
        nearest: Option<String>,
    },
    /// The node was removed.
    #[error("the node was removed")]
    Removed,
    /// A node has the id already.
    #[error("a node has the id `{0}` already")]
    DuplicateId(String),
    /// An id cannot be empty.
    #[error("the id is empty")]
    EmptyId,
    /// Only a joint has a position.
    #[error("`{id}` is a {tag}, not a joint")]
    NotAJoint {
        /// The node.
        id: String,
        /// Tag of the node.
        tag: &'static str,
    },
    /// The pose of such a node cannot be set.
    #[error("`{id}` is a {tag}, which has no pose of its own")]
    NoPose {
        /// The node.
        id: String,
        /// Tag of the node.
        tag: &'static str,
    },
    /// Such a node has no children.
    #[error("`{id}` is a {tag}, which cannot have children")]
    NoChildren {
        /// The node.
        id: String,
        /// Tag of the node.
        tag: &'static str,
    },
    /// A node cannot be below itself.
    #[error("`{id}` cannot be moved below itself, to `{to}`")]
    BelowItself {
        /// The node.
        id: String,
        /// The new parent.
        to: String,
    },
    /// Only point clouds have points.
    #[error("`{id}` is a {tag}, not a pointcloud")]
    NotACloud {
        /// The node.
        id: String,
        /// Tag of the node.
        tag: &'static str,
    },
    /// The clouds of a model would have too many points.
    #[error("there would be {count} points in all clouds; at most {most} are kept")]
    TooManyPoints {
        /// Points of all clouds.
        count: usize,
        /// The limit.
        most: usize,
    },
    /// The root cannot be changed.
    #[error("the root cannot be changed")]
    Root,
    /// A value is infinite or not a number.
    #[error("a value for `{0}` is not finite")]
    NotFinite(String),
    /// A file cannot have the node: a number is out of its range.
    #[error("`{id}` is not possible: {reason}")]
    Impossible {
        /// The node.
        id: String,
        /// Which number, and what is allowed.
        reason: String,
    },
    /// A file cannot have the text.
    #[error("a text of `{0}` has a character that XML does not allow")]
    Character(String),
    /// A node with children cannot become one that has none.
    #[error("`{id}` has children, so it cannot become a {tag}")]
    HasChildren {
        /// The node.
        id: String,
        /// The tag that it should get.
        tag: &'static str,
    },
    /// The node has no such attribute.
    #[error("`{id}` has no attribute `{attribute}`{}", did_you_mean(nearest.as_deref()))]
    UnknownAttribute {
        /// The node.
        id: String,
        /// The attribute.
        attribute: String,
        /// The attribute that is most like it.
        nearest: Option<String>,
    },
    /// The node has such an attribute already.
    #[error("`{id}` has an attribute `{attribute}` already")]
    DuplicateAttribute {
        /// The node.
        id: String,
        /// The attribute.
        attribute: String,
    },
    /// The history does not reach so far back.
    #[error("the history starts later: it is empty, or its first version is at {first:?}")]
    TooEarly {
        /// The time of the first version.
        first: Option<crate::Time>,
    },
}

fn did_you_mean(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |near| format!(", did you mean `{near}`?"))
}

impl Error {
    pub(crate) fn unknown<'k>(id: &str, known: impl Iterator<Item = &'k str>) -> Self {
        let nearest = rc_diagnostics::nearest(id, known);
        Self::UnknownId {
            id: rc_diagnostics::foreign::clean(id),
            nearest: nearest.map(str::to_owned),
        }
    }

    pub(crate) fn unknown_attribute<'k>(
        id: &str,
        name: &str,
        known: impl Iterator<Item = &'k String>,
    ) -> Self {
        Self::UnknownAttribute {
            id: rc_diagnostics::foreign::clean(id),
            attribute: rc_diagnostics::foreign::clean(name),
            nearest: rc_diagnostics::nearest(name, known.map(String::as_str)).map(str::to_owned),
        }
    }
}
