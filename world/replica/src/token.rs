//! Names one change, so that others can wait until they have it.

use crate::error::Error;
use rc_diagnostics::foreign;
use std::fmt;
use std::str::FromStr;

/// Names the last change of a writer. A replica that has it also has all earlier changes of that
/// writer. It travels as two numbers, or as its text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Token {
    /// The writer. 0 is nobody: every replica has this token.
    pub writer: u64,
    /// Number of the change among those of the writer, from 1.
    pub sequence: u64,
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:x}:{}", self.writer, self.sequence)
    }
}

impl FromStr for Token {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let read = || {
            let (writer, sequence) = text.split_once(':')?;
            Some(Self {
                writer: u64::from_str_radix(writer, 16).ok()?,
                sequence: sequence.parse().ok()?,
            })
        };
        read().ok_or_else(|| Error::Token(foreign::clean(text)))
    }
}
