//! The plan of a connection's conversion.

use crate::item::{Item, Items};
use crate::moves::Move;
use crate::program::Program;
use alloc::vec::Vec;
use core::fmt;

/// The plan of a connection: the messages of the operations of an interface with numbers that are
/// converted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Plan {
    /// The messages.
    pub parts: Vec<Part>,
}

/// A message that is converted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The operation: its number in the interface.
    pub operation: u32,
    /// Which message of the operation.
    pub place: Place,
    /// The transforms between frames that its formulas take.
    pub moves: Vec<Move>,
    /// The values of the message, up to the last number that is converted.
    pub items: Vec<Item>,
}

/// A message of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The parameters: a sample, or a request.
    Input,
    /// The parameters as a memory image.
    InputImage,
    /// The output parameters and the result: a reply.
    Output,
    /// The output parameters and the result as a memory image.
    OutputImage,
    /// The exception with this number among those that the operation throws.
    Exception(u32),
}

impl Plan {
    /// Whether nothing is converted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// The program for a message. `None` if it stays as it is.
    #[must_use]
    pub fn program(&self, operation: usize, place: Place) -> Option<Program> {
        let mut parts = self.parts.iter();
        let part = parts.find(|part| part.operation as usize == operation && part.place == place);
        part.map(|part| Program::new(&part.items).with_moves(&part.moves, &part.items))
    }
}

impl fmt::Display for Plan {
    /// The text that [`str::parse`] reads.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, part) in self.parts.iter().enumerate() {
            if number > 0 {
                f.write_str(",")?;
            }
            write!(f, "{}{}", part.operation, part.place)?;
            for change in &part.moves {
                write!(f, "{change}")?;
            }
            write!(f, ":{}", Items(&part.items))?;
        }
        Ok(())
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input => f.write_str("i"),
            Self::InputImage => f.write_str("I"),
            Self::Output => f.write_str("o"),
            Self::OutputImage => f.write_str("O"),
            Self::Exception(number) => write!(f, "e{number}"),
        }
    }
}
