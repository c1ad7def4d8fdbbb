//! A sample on the side of its subscriber: reads the parameters.

use super::{HandlerError, Operation};
use crate::cdr::{DecodeError, Reader};
use crate::in_place::{InPlace, Placed};

/// A sample that a subscriber handles.
///
/// ```
/// use rc_middleware::Reader;
/// use rc_middleware::typed::{self, Operation, Sample};
///
/// const TICK: Operation = Operation::one_way("tick", 7, 0);
///
/// let body = 42_i64.to_le_bytes();
/// let mut reader = Reader::new(&body);
/// let sample = Sample::new(0, &[TICK], &mut reader).expect("a topic");
/// let mut seen = 0;
/// sample.command(typed::read, |(number,): (i64,)| seen = number).expect("a number");
/// assert_eq!(seen, 42);
/// ```
pub struct Sample<'r, 'a> {
    /// The hash of the name of the operation.
    pub operation: i32,
    reader: &'r mut Reader<'a>,
}

impl<'r, 'a> Sample<'r, 'a> {
    /// The sample in `reader` of the topic with this number. Fails if there are fewer topics.
    pub fn new(
        topic: usize,
        topics: &[Operation],
        reader: &'r mut Reader<'a>,
    ) -> Result<Self, HandlerError> {
        let operation = topics.get(topic).ok_or_else(no_topic)?.id;
        Ok(Self { operation, reader })
    }

    /// Lets `handle` take the parameters, which `read` reads.
    pub fn command<A>(
        self,
        read: impl FnOnce(&mut Reader<'a>) -> Result<A, DecodeError>,
        handle: impl FnOnce(A),
    ) -> Result<(), HandlerError> {
        handle(read(self.reader)?);
        Ok(())
    }

    /// Lets `handle` take the only parameter where it was written.
    pub fn in_place<T: InPlace>(
        self,
        read: impl FnOnce(&mut Reader<'a>) -> Result<Placed<'a, T>, DecodeError>,
        handle: impl FnOnce((&T,)),
    ) -> Result<(), HandlerError> {
        let value = read(self.reader)?;
        handle((&value,));
        Ok(())
    }

    /// Fails because no operation has this hash.
    pub fn unknown(self) -> Result<(), HandlerError> {
        Err(no_topic())
    }
}

fn no_topic() -> HandlerError {
    HandlerError("the slot has no such topic".to_owned())
}
