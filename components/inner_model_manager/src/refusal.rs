//! Why a request changes nothing and has no result, in the words of both interfaces of a tree.

use innermodel::Error;
use interfaces::rc_inner_model::{InnerModelError, Reason};
use interfaces::robo_comp_inner_model_manager::{ErrorType, InnerModelManagerError};

/// Error of a request that is refused.
#[derive(Debug)]
pub enum Refusal {
    /// The tree does not allow it.
    Tree(Error),
    /// A text is not an element of a file.
    Text(String),
    /// A number, an axis or the like is not allowed.
    Value(String),
    /// The operation does not fit the kind of the node.
    Kind(String),
    /// The file of a mesh cannot be read.
    Path(String),
    /// The physics engine is unknown.
    Engine(String),
    /// Bodies would collide.
    Collision(String),
    /// A result has a number that its type cannot hold.
    Result(String),
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        Self::Tree(error)
    }
}

impl Refusal {
    /// Text for a person.
    pub fn text(self) -> String {
        match self {
            Self::Tree(error) => error.to_string(),
            Self::Text(text)
            | Self::Value(text)
            | Self::Kind(text)
            | Self::Path(text)
            | Self::Engine(text)
            | Self::Collision(text)
            | Self::Result(text) => text,
        }
    }
}

impl From<Refusal> for InnerModelError {
    fn from(refusal: Refusal) -> Self {
        let reason = match &refusal {
            Refusal::Tree(error) => match error {
                Error::UnknownId { .. } | Error::Removed => Reason::UnknownNode,
                Error::DuplicateId(_) => Reason::DuplicateNode,
                Error::EmptyId | Error::NotFinite(_) | Error::Character(_) => Reason::WrongValue,
                Error::UnknownAttribute { .. } => Reason::UnknownAttribute,
                Error::DuplicateAttribute { .. } => Reason::DuplicateAttribute,
                Error::TooEarly { .. } => Reason::TooEarly,
                _ => Reason::WrongKind,
            },
            Refusal::Text(_) | Refusal::Path(_) => Reason::WrongText,
            Refusal::Value(_) | Refusal::Engine(_) | Refusal::Result(_) => Reason::WrongValue,
            Refusal::Kind(_) => Reason::WrongKind,
            Refusal::Collision(_) => Reason::Collision,
        };
        Self {
            reason,
            what: refusal.text(),
        }
    }
}

impl From<Refusal> for InnerModelManagerError {
    fn from(refusal: Refusal) -> Self {
        let err = match &refusal {
            Refusal::Tree(error) => match error {
                Error::UnknownId { .. } | Error::Removed => ErrorType::NonExistingNode,
                Error::DuplicateId(_) => ErrorType::NodeAlreadyExists,
                Error::EmptyId
                | Error::NotFinite(_)
                | Error::Character(_)
                | Error::Impossible { .. } => ErrorType::InvalidValues,
                Error::UnknownAttribute { .. } => ErrorType::NonExistingAttribute,
                Error::DuplicateAttribute { .. } => ErrorType::AttributeAlreadyExists,
                Error::TooEarly { .. } => ErrorType::InternalError,
                _ => ErrorType::OperationInvalidNode,
            },
            Refusal::Text(_) | Refusal::Result(_) => ErrorType::InternalError,
            Refusal::Value(_) => ErrorType::InvalidValues,
            Refusal::Kind(_) => ErrorType::OperationInvalidNode,
            Refusal::Path(_) => ErrorType::InvalidPath,
            Refusal::Engine(_) => ErrorType::InvalidEngine,
            Refusal::Collision(_) => ErrorType::Collision,
        };
        Self {
            err,
            text: refusal.text(),
        }
    }
}
