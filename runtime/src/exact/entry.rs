//! The entries of an exact recording.

use rc_middleware::{Cdr, DecodeError, Encoding, Header, Reader, Writer, cdr};
use std::borrow::Cow;

/// The definition of a turn and its entries, in the form of ROS 2 messages, which tools read with
/// the recording.
pub(super) const DEFINITION: &str = "\
# One turn of the loop of a component, or a part of it.
# The number of the turn, from 0.
uint64 number
Entry[] entries
================================================================================
MSG: robocomp_exact_msgs/Entry
# Time, count or code.
uint64 value
uint64 type_hash
uint16 slot
uint16 operation
uint8 kind
uint8[] data
string text
";

/// The name of the type in the recording.
pub(super) const TYPE_NAME: &str = "robocomp_exact_msgs/msg/Turn";

macro_rules! kinds {
    ($($(#[doc = $doc:literal])+ $name:ident = $number:literal $word:literal,)*) => {
        /// Kind of an entry. The numbers are part of the file.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub(crate) enum Kind {
            $($(#[doc = $doc])+ $name = $number,)*
        }

        impl Kind {
            fn of(number: u8) -> Option<Self> {
                match number {
                    $($number => Some(Self::$name),)*
                    _ => None,
                }
            }

            /// The word for it in reports.
            pub(crate) fn word(self) -> &'static str {
                match self {
                    $(Self::$name => $word,)*
                }
            }
        }
    };
}

kinds! {
    /// The first entry of a recording; `text` is a JSON document.
    Start = 0 "start",
    /// A turn: the context and the worker are created.
    Initialize = 1 "initialize",
    /// A turn: `compute()`.
    Compute = 2 "compute",
    /// A turn: a sample of a topic.
    Sample = 3 "sample",
    /// A turn: a request to an implemented slot.
    Request = 4 "request",
    /// A turn: events of the state machine.
    React = 5 "react",
    /// A turn: new values of the parameters, as JSON in `text`.
    Parameters = 6 "parameters",
    /// A turn: `params_changed()`; the changes are JSON in `text`.
    Changed = 7 "params_changed",
    /// A turn: `emergency()`.
    Emergency = 8 "emergency",
    /// A turn: `restore()`.
    Restore = 9 "restore",
    /// A turn: `finalize()`.
    Finalize = 10 "finalize",
    /// A turn: the started call with the number `value` has ended. An answer follows.
    Ended = 11 "ended_call",
    /// A turn of the event loop, in addition to handlers.
    Turn = 12 "turn",
    /// The state of the component is another one, `text`.
    State = 16 "state",
    /// The period of the component is another one, in nanoseconds.
    Period = 17 "period",
    /// The worker read the clock: nanoseconds.
    Now = 18 "now",
    /// The worker asked whether the component is to end.
    Stopping = 19 "is_stopping",
    /// The worker asked for the number of peers.
    Peers = 20 "peers",
    /// A client was opened: its GUID in `data`, its profile in `value`.
    Opened = 21 "opened",
    /// The worker asked the source of time; the answer is in `text`.
    Time = 22 "time",
    /// Result of a call. `operation` is the encoding of the reply or the number of an error.
    Answer = 23 "answer",
    /// Sending failed; `operation` is the number of the error. Success has no entry.
    Failed = 24 "failed",
    /// The state machine took an event of a tool, `value`.
    Fired = 25 "fired",
    /// The worker asked for a number that no other run has.
    Unique = 26 "unique",
    /// The worker waits for the shared world: the time in `value`, the kind of the input in
    /// `type_hash`, and its bytes.
    Awaited = 27 "awaited",
    /// The time of a value, or the present one, in nanoseconds: for the ages of values.
    Moment = 28 "moment",
    /// The worker asked how old the last reply of a client is: the age in `value`, what it is made of
    /// in `type_hash`, and in `operation` 0 if the slot does not keep track, 1 if it is too old, else 2.
    Fresh = 29 "fresh",
    /// The worker published a sample; `value` is its encoding.
    Publish = 32 "publish",
    /// The worker sent a command.
    Send = 33 "send",
    /// The worker called; `value` is its limit in nanoseconds.
    Call = 34 "call",
    /// The reply to a request.
    Reply = 35 "reply",
    /// The worker ended the component, for the reason `text`.
    Stop = 36 "stop",
    /// A function of the worker returned an error, `text`. `value` is its kind.
    Error = 37 "error",
    /// The worker set the time of the network.
    Advance = 38 "advance",
    /// The worker started a call; `value` is its limit in nanoseconds.
    Started = 39 "start_call",
}

impl Kind {
    /// Whether a turn begins with it.
    pub(super) fn begins_turn(self) -> bool {
        (1..16).contains(&(self as u8))
    }
}

/// One entry.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry<'a> {
    pub(crate) value: u64,
    pub(crate) type_hash: u64,
    pub(crate) slot: u16,
    pub(crate) operation: u16,
    pub(crate) kind: Kind,
    pub(crate) data: Cow<'a, [u8]>,
    pub(crate) text: Cow<'a, str>,
}

impl<'a> Entry<'a> {
    /// An entry without content.
    pub(crate) fn of(kind: Kind) -> Self {
        Self {
            value: 0,
            type_hash: 0,
            slot: 0,
            operation: 0,
            kind,
            data: Cow::Borrowed(&[]),
            text: Cow::Borrowed(""),
        }
    }

    /// An entry of a slot.
    pub(super) fn at(kind: Kind, slot: usize, operation: usize) -> Self {
        Self {
            slot: slot as u16,
            operation: operation as u16,
            ..Self::of(kind)
        }
    }

    /// A message with its bytes.
    pub(super) fn message(
        kind: Kind,
        slot: usize,
        operation: usize,
        header: Header,
        data: &'a [u8],
    ) -> Self {
        Self {
            value: number(header.encoding),
            type_hash: header.type_hash,
            data: Cow::Borrowed(data),
            ..Self::at(kind, slot, operation)
        }
    }

    /// The header of a message.
    pub(super) fn header(&self, encoding: u64) -> Header {
        Header {
            type_hash: self.type_hash,
            encoding: encoding_of(encoding),
            ..Header::default()
        }
    }

    /// The entry without borrows.
    pub(super) fn into_owned(self) -> Entry<'static> {
        Entry {
            value: self.value,
            type_hash: self.type_hash,
            slot: self.slot,
            operation: self.operation,
            kind: self.kind,
            data: Cow::Owned(self.data.into_owned()),
            text: Cow::Owned(self.text.into_owned()),
        }
    }

    /// Appends the entry to a turn.
    pub(super) fn write(&self, writer: &mut Writer<'_>) {
        writer.put(&self.value);
        writer.put(&self.type_hash);
        writer.put(&self.slot);
        writer.put(&self.operation);
        writer.put(&(self.kind as u8));
        writer.length(self.data.len());
        writer.raw(&self.data);
        cdr::text(&self.written_text(), writer);
    }

    /// The text as it is written: CDR has no NUL in a text.
    fn written_text(&self) -> Cow<'_, str> {
        if self.text.contains('\0') {
            Cow::Owned(self.text.replace('\0', " "))
        } else {
            Cow::Borrowed(&self.text)
        }
    }

    /// Whether this entry would be written as one that was read.
    pub(super) fn is_written_as(&self, read: &Entry<'_>) -> bool {
        let Self {
            value,
            type_hash,
            slot,
            operation,
            kind,
            data,
            text: _,
        } = self;
        let same = (value, type_hash, slot, operation, kind)
            == (
                &read.value,
                &read.type_hash,
                &read.slot,
                &read.operation,
                &read.kind,
            );
        same && *data == read.data && self.written_text() == read.text
    }

    /// Reads the next entry of a turn.
    pub(super) fn read(reader: &mut Reader<'_>) -> Result<Entry<'static>, DecodeError> {
        let (value, type_hash) = (reader.get()?, reader.get()?);
        let (slot, operation) = (reader.get()?, reader.get()?);
        let kind = Kind::of(reader.get()?).ok_or(DecodeError::Unknown("kind of an entry"))?;
        let length = reader.length()?;
        let data = Cow::Owned(reader.raw(length)?.to_vec());
        let text = Cow::Owned(String::decode(reader)?);
        Ok(Entry {
            value,
            type_hash,
            slot,
            operation,
            kind,
            data,
            text,
        })
    }
}

/// The number of an encoding in the file.
pub(super) fn number(encoding: Encoding) -> u64 {
    match encoding {
        Encoding::Cdr => 0,
        Encoding::Image => 1,
    }
}

fn encoding_of(number: u64) -> Encoding {
    match number {
        0 => Encoding::Cdr,
        _ => Encoding::Image,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_is_equal_to_what_was_written_of_it_also_with_a_nul() {
        let entry = Entry {
            text: Cow::Borrowed("a\0b"),
            data: Cow::Borrowed(&[1, 0]),
            ..Entry::at(Kind::Error, 1, 2)
        };
        let mut writer = Writer::default();
        entry.write(&mut writer);
        let bytes = writer.into_bytes();
        let read = Entry::read(&mut Reader::new(&bytes)).expect("an entry");
        assert_eq!(read.text, "a b");
        assert!(entry.is_written_as(&read));
        let other = Entry {
            data: Cow::Borrowed(&[1, 1]),
            ..entry
        };
        assert!(!other.is_written_as(&read));
    }
}
