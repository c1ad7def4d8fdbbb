//! Limits of a query, and the reasons why one ends early.

use crate::cell::Cell;
use thiserror::Error;

/// How many cells a computed list holds at most, with those of lists in it.
pub(crate) const LONGEST_LIST: usize = 1 << 16;
/// The longest text that an expression makes, in bytes.
pub(crate) const LONGEST_TEXT: usize = 1 << 20;

/// The limit in bytes for the values that a query computes, in all its rows.
const MOST_BYTES: usize = 256 << 20;

/// An error as it travels: each value is a result on its way, and an error is larger than a value.
pub(crate) type Result<T> = std::result::Result<T, Box<Error>>;

/// Why a query did not end.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The query takes more steps than its budget.
    #[error("the query takes more than {0} steps")]
    Steps(u64),
    /// The query makes more rows than its budget.
    #[error("the query makes more than {0} rows")]
    Rows(usize),
    /// The values of all rows hold more bytes than a query may have.
    #[error("the values of the query hold more than {0} MiB")]
    Bytes(usize),
    /// A value has a type with which an operation is not possible.
    #[error("{0}")]
    Type(String),
    /// `pose` and `chain` walk over more nodes than the budget of steps allows.
    #[error("`pose` and `chain` walk over too many nodes")]
    Walks,
    /// A number, a text or a list is too large.
    #[error("a number, a text or a list is too large")]
    Overflow,
    /// A parameter has no value.
    #[error("the parameter `${0}` has no value")]
    Parameter(String),
    /// The schema has no query of this name. The second text has the names that it has.
    #[error("the schema has no query `{0}`{1}")]
    UnknownQuery(String, String),
    /// The text of a query of the schema has this fault.
    #[error("{0}")]
    Text(String),
    /// A query of the schema has no such parameter.
    #[error("the query `{query}` has no parameter `{parameter}`{hint}")]
    UnknownParameter {
        /// The query.
        query: String,
        /// The parameter.
        parameter: String,
        /// The names that it has.
        hint: String,
    },
    /// A parameter of a query of the schema has a value of another type.
    #[error("the parameter `${parameter}` is `{found}`, expected {expected}")]
    Argument {
        /// The parameter.
        parameter: String,
        /// The values that its type accepts.
        expected: String,
        /// The value.
        found: String,
    },
    /// The name of a node, as the value of a parameter, is that of no node or of several ones.
    #[error("expected one node of type `{entity}` with the name `{name}`, found {count}")]
    Named {
        /// The entity.
        entity: String,
        /// The name.
        name: String,
        /// How many nodes have it.
        count: usize,
    },
}

/// The limits of a query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Steps that are left.
    pub steps: u64,
    /// Rows that are left; also those between two clauses count.
    pub rows: usize,
    bytes: usize,
    all: (u64, usize),
}

impl Default for Budget {
    fn default() -> Self {
        Self::new(10_000_000, 100_000)
    }
}

impl Budget {
    /// A budget of steps and of rows.
    pub fn new(steps: u64, rows: usize) -> Self {
        Self {
            steps,
            rows,
            bytes: MOST_BYTES,
            all: (steps, rows),
        }
    }

    #[inline]
    pub(crate) fn step(&mut self) -> Result<()> {
        if self.steps == 0 {
            return Err(Error::Steps(self.all.0).into());
        }
        self.steps -= 1;
        Ok(())
    }

    #[inline]
    pub(crate) fn row(&mut self) -> Result<()> {
        if self.rows == 0 {
            return Err(Error::Rows(self.all.1).into());
        }
        self.rows -= 1;
        Ok(())
    }

    /// Counts the memory of a computed value.
    #[inline]
    pub(crate) fn hold(&mut self, cell: Cell) -> Result<Cell> {
        self.take(cell.bytes())?;
        Ok(cell)
    }

    /// Counts cells that are kept until the end, without their contents.
    #[inline]
    pub(crate) fn keep(&mut self, cells: usize) -> Result<()> {
        self.take(cells * size_of::<Cell>())
    }

    #[inline]
    fn take(&mut self, bytes: usize) -> Result<()> {
        if self.bytes < bytes {
            return Err(Error::Bytes(MOST_BYTES >> 20).into());
        }
        self.bytes -= bytes;
        Ok(())
    }
}
