//! Errors of requests that change nothing and have no result.

use innermodel_simulation::Error;
use rcis_generated::SimulationError;
use rcis_generated::types::rc_simulation::Reason;

/// Error of a request that is refused.
#[derive(Debug)]
pub(crate) enum Refusal {
    /// The world does not allow it.
    World(Error),
    /// It is wrong for another reason.
    Other(Reason, String),
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        Self::World(error)
    }
}

impl From<innermodel::Error> for Refusal {
    fn from(error: innermodel::Error) -> Self {
        Self::World(Error::Tree(error))
    }
}

impl From<Refusal> for SimulationError {
    fn from(refusal: Refusal) -> Self {
        let (reason, what) = match refusal {
            Refusal::Other(reason, what) => (reason, what),
            Refusal::World(error) => (reason(&error), error.to_string()),
        };
        Self { reason, what }
    }
}

fn reason(error: &Error) -> Reason {
    use innermodel::Error as Tree;
    match error {
        Error::Tree(tree) => match tree {
            Tree::UnknownId { .. } | Tree::Removed => Reason::UnknownNode,
            Tree::DuplicateId(_) => Reason::DuplicateNode,
            Tree::EmptyId | Tree::NotFinite(_) | Tree::Character(_) | Tree::Impossible { .. } => {
                Reason::WrongValue
            }
            Tree::UnknownAttribute { .. } => Reason::UnknownAttribute,
            _ => Reason::WrongKind,
        },
        Error::Kind { .. } | Error::Unknown { .. } => Reason::WrongKind,
        _ => Reason::WrongValue,
    }
}

/// The reply or the exception of an operation.
pub(crate) fn reply<T, E: From<SimulationError>>(result: Result<T, Refusal>) -> Result<T, E> {
    result.map_err(|refusal| SimulationError::from(refusal).into())
}
