//! The steps of changes as bytes.

use super::{WireValue, content, value};
use graph_merge::{Record, Stamp};
use property_graph::{Id, Value};
use rc_middleware::{Cdr, DecodeError, Reader, Writer, cdr};
use std::sync::Arc;

/// A step has more bytes than this.
const LEAST_STEP: usize = 80;

fn begin_step(writer: &mut Writer<'_>, what: u8, stamp: Stamp, name: &str, (of, to): (Id, Id)) {
    writer.put(&what);
    writer.put(&stamp.count);
    follow(writer, [stamp.writer, stamp.sequence]);
    cdr::text(name, writer);
    writer.put(&of.writer());
    follow(writer, [of.count(), to.writer(), to.count()]);
}

/// Writes numbers that follow a number, and are aligned with it.
fn follow<const N: usize>(writer: &mut Writer<'_>, numbers: [u64; N]) {
    writer.raw(numbers.map(u64::to_le_bytes).as_flattened());
}

/// Writes steps.
pub(super) fn put_steps(writer: &mut Writer<'_>, records: &[Record]) {
    writer.length(records.len());
    for record in records {
        put_step(writer, record);
    }
}

fn put_step(writer: &mut Writer<'_>, record: &Record) {
    let (stamp, none) = (record.stamp(), Id::default());
    match record {
        Record::Node { kind, .. } => begin_step(writer, 0, stamp, kind, (none, none)),
        Record::Edge { kind, from, to, .. } => {
            begin_step(writer, 1, stamp, kind, (*from, *to));
        }
        Record::Attribute { of, name, .. } => {
            begin_step(writer, 2, stamp, name, (*of, none));
        }
        Record::Removed { of, .. } => begin_step(writer, 3, stamp, "", (*of, none)),
    }
    let value = match record {
        Record::Attribute { value, .. } => value.as_ref(),
        _ => None,
    };
    put_value(writer, value);
}

/// Writes a value as [`content`] has it, the usual ones without a copy: one list has a value, and the
/// lengths of the others are zero.
pub(super) fn put_value(writer: &mut Writer<'_>, value: Option<&Value>) {
    match value {
        None => {
            writer.put(&0_u8);
            writer.length(0);
            writer.raw(&[0; 12]);
        }
        Some(Value::Int(number)) => {
            writer.put(&2_u8);
            writer.length(1);
            writer.put(number);
            writer.raw(&[0; 12]);
        }
        Some(Value::Float(number)) => {
            writer.put(&3_u8);
            writer.length(0);
            writer.length(1);
            writer.put(number);
            writer.raw(&[0; 8]);
        }
        Some(Value::Text(text)) => {
            writer.put(&4_u8);
            writer.length(0);
            writer.raw(&[0; 4]);
            writer.length(1);
            cdr::text(text, writer);
            writer.length(0);
        }
        other => writer.put(&content(other)),
    }
}

/// The bytes of a text, in the memory of the message.
fn text_bytes<'b>(reader: &mut Reader<'b>) -> Result<&'b [u8], DecodeError> {
    let length = reader.length()?;
    let text = reader.raw(length)?.strip_suffix(&[0]);
    text.ok_or(DecodeError::BadString)
}

fn text(text: &[u8]) -> Result<&str, DecodeError> {
    if text.contains(&0) {
        return Err(DecodeError::BadString);
    }
    std::str::from_utf8(text).map_err(|_| DecodeError::BadString)
}

/// The last names of types and attributes: most steps have one of them.
#[derive(Default)]
struct Names {
    last: [Option<Arc<str>>; 8],
    next: usize,
}

impl Names {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<Arc<str>, DecodeError> {
        let name = text_bytes(reader)?;
        let mut known = self.last.iter().flatten();
        if let Some(known) = known.find(|known| known.as_bytes() == name) {
            return Ok(Arc::clone(known));
        }
        let new: Arc<str> = text(name)?.into();
        self.last[self.next] = Some(Arc::clone(&new));
        self.next = (self.next + 1) % self.last.len();
        Ok(new)
    }
}

/// Numbers that follow a number, and are aligned with it.
fn following<const N: usize>(reader: &mut Reader<'_>) -> Result<[u64; N], DecodeError> {
    let (bytes, _) = reader.raw(8 * N)?.as_chunks();
    Ok(std::array::from_fn(|at| {
        u64::from_le_bytes(bytes.get(at).copied().unwrap_or_default())
    }))
}

fn record(reader: &mut Reader<'_>, names: &mut Names) -> Result<Record, DecodeError> {
    let what: u8 = reader.get()?;
    let count = reader.get()?;
    let [writer, sequence] = following(reader)?;
    let stamp = Stamp {
        count,
        writer,
        sequence,
    };
    let name = names.read(reader)?;
    let writer = reader.get()?;
    let [count, to_writer, to_count] = following(reader)?;
    let (of, to) = (Id::new(writer, count), Id::new(to_writer, to_count));
    let value = read_value(reader)?;
    Ok(match what {
        0 => Record::Node { stamp, kind: name },
        1 => Record::Edge {
            stamp,
            kind: name,
            from: of,
            to,
        },
        2 => Record::Attribute {
            stamp,
            of,
            name,
            value,
        },
        3 => Record::Removed { stamp, of },
        other => {
            return Err(DecodeError::NoSuchValue {
                what: "a step of a change",
                value: i64::from(other),
            });
        }
    })
}

/// Skips the lengths of lists that are all empty. Returns whether these follow.
fn skip_empty<const BYTES: usize>(reader: &mut Reader<'_>) -> bool {
    let is_empty = reader.rest().starts_with(&[0; BYTES]);
    is_empty && reader.raw(BYTES).is_ok()
}

/// Reads a value as [`content`] has it, the usual ones without lists.
pub(super) fn read_value(reader: &mut Reader<'_>) -> Result<Option<Value>, DecodeError> {
    let kind: u8 = reader.get()?;
    let count = reader.length()?;
    if (kind, count) == (0, 0) && skip_empty::<12>(reader) {
        return Ok(None);
    }
    if (kind, count) == (2, 1) {
        let number = reader.get()?;
        if !skip_empty::<12>(reader) {
            let _: (Vec<f64>, Vec<String>) = (reader.get()?, reader.get()?);
            let _: Vec<u8> = reader.get()?;
        }
        return Ok(Some(Value::Int(number)));
    }
    let ints = i64::decode_all(count, reader)?;
    let count = reader.length()?;
    if (kind, count) == (3, 1) {
        let number = reader.get()?;
        let _: (Vec<String>, Vec<u8>) = (reader.get()?, reader.get()?);
        return Ok(Some(Value::Float(number)));
    }
    let floats = f64::decode_all(count, reader)?;
    let count = reader.length()?;
    if (kind, count) == (4, 1) {
        let text = Value::Text(text(text_bytes(reader)?)?.into());
        let _: Vec<u8> = reader.get()?;
        return Ok(Some(text));
    }
    value(WireValue {
        kind,
        ints,
        floats,
        texts: String::decode_all(count, reader)?,
        bytes: reader.get()?,
    })
}

/// Reads steps.
pub(super) fn records(reader: &mut Reader<'_>) -> Result<Vec<Record>, DecodeError> {
    let count = reader.length()?;
    // A false count allocates no memory.
    let mut records = Vec::with_capacity(count.min(reader.rest().len() / LEAST_STEP));
    let mut names = Names::default();
    for _ in 0..count {
        records.push(record(reader, &mut names)?);
    }
    Ok(records)
}
