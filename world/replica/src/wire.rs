//! Messages as bytes: the structures of `World.idsl`, encoded as CDR.

use crate::content::{Content, DigestOf, Topic};
use crate::streams::Sample;
use graph_merge::{Delta, Record, Stamp, Vector};
use property_graph::{Id, Time, Value};
use rc_middleware::{DecodeError, Reader, Writer, cdr_struct};

#[derive(Clone, Debug, Default)]
struct Key {
    writer: u64,
    count: u64,
}
cdr_struct!(Key: writer, count);

#[derive(Clone, Debug, Default)]
struct WireValue {
    kind: u8,
    ints: Vec<i64>,
    floats: Vec<f64>,
    texts: Vec<String>,
    bytes: Vec<u8>,
}
cdr_struct!(WireValue: kind, ints, floats, texts, bytes);

#[derive(Clone, Debug, Default)]
struct Step {
    what: u8,
    count: u64,
    writer: u64,
    sequence: u64,
    name: String,
    of: Key,
    to: Key,
    value: WireValue,
}
cdr_struct!(Step: what, count, writer, sequence, name, of, to, value);

#[derive(Clone, Debug, Default)]
struct Change {
    schema: u64,
    sender: u64,
    time: i64,
    since: u64,
    upto: u64,
    steps: Vec<Step>,
}
cdr_struct!(Change: schema, sender, time, since, upto, steps);

#[derive(Clone, Debug, Default)]
struct StreamValue {
    of: Key,
    name: String,
    count: u64,
    writer: u64,
    value: WireValue,
}
cdr_struct!(StreamValue: of, name, count, writer, value);

#[derive(Clone, Debug, Default)]
struct Samples {
    schema: u64,
    sender: u64,
    time: i64,
    values: Vec<StreamValue>,
}
cdr_struct!(Samples: schema, sender, time, values);

#[derive(Clone, Debug, Default)]
struct Digest {
    schema: u64,
    sender: u64,
    name: String,
    seen: Vec<Key>,
    ranges: Vec<u64>,
    streams: u64,
    elements: u64,
    conflicts: u32,
    leaving: bool,
}
cdr_struct!(Digest: schema, sender, name, seen, ranges, streams, elements, conflicts, leaving);

#[derive(Clone, Debug, Default)]
struct Ask {
    sender: u64,
    to: u64,
    number: u64,
    since: Vec<Key>,
    ranges: Vec<u32>,
    chunks: Vec<u32>,
}
cdr_struct!(Ask: sender, to, number, since, ranges, chunks);

#[derive(Clone, Debug, Default)]
struct Chunk {
    sender: u64,
    to: u64,
    number: u64,
    at: u32,
    count: u32,
    bytes: Vec<u8>,
}
cdr_struct!(Chunk: sender, to, number, at, count, bytes);

/// The content of an answer, before it is cut into chunks.
#[derive(Clone, Debug, Default)]
struct Answer {
    sender: u64,
    seen: Vec<Key>,
    since: Vec<Key>,
    upto: Vec<Key>,
    forgotten: Vec<Key>,
    /// Number of the range and of all ranges, or nothing.
    range: Vec<u32>,
    steps: Vec<Step>,
}
cdr_struct!(Answer: sender, seen, since, upto, forgotten, range, steps);

fn key(id: Id) -> Key {
    Key {
        writer: id.writer(),
        count: id.count(),
    }
}

impl Key {
    fn id(&self) -> Id {
        Id::new(self.writer, self.count)
    }
}

fn keys(vector: &Vector) -> Vec<Key> {
    let all = vector.iter();
    all.map(|(writer, count)| Key {
        writer: *writer,
        count: *count,
    })
    .collect()
}

fn vector(keys: &[Key]) -> Vector {
    keys.iter().map(|key| (key.writer, key.count)).collect()
}

/// The numbers of types are those that the digests of `graph-merge` have.
fn content(value: Option<&Value>) -> WireValue {
    let mut content = WireValue::default();
    let Some(value) = value else { return content };
    content.kind = match value {
        Value::Bool(yes) => {
            content.ints = vec![i64::from(*yes)];
            1
        }
        Value::Int(number) => {
            content.ints = vec![*number];
            2
        }
        Value::Float(number) => {
            content.floats = vec![*number];
            3
        }
        Value::Text(text) => {
            content.texts = vec![text.to_string()];
            4
        }
        Value::Bytes(bytes) => {
            content.bytes = bytes.to_vec();
            5
        }
        Value::Ints(all) => {
            content.ints = all.to_vec();
            6
        }
        Value::Floats(all) => {
            content.floats = all.to_vec();
            7
        }
        Value::Texts(all) => {
            content.texts = all.iter().map(ToString::to_string).collect();
            8
        }
        Value::Sample(sample) => {
            content.texts = vec![sample.topic.clone(), sample.kind.clone()];
            content.ints = vec![sample.sequence.cast_signed()];
            9
        }
    };
    content
}

fn value(content: WireValue) -> Result<Option<Value>, DecodeError> {
    let WireValue {
        kind,
        ints,
        floats,
        texts,
        bytes,
    } = content;
    let wrong = || DecodeError::NoSuchValue {
        what: "the type of a value",
        value: i64::from(kind),
    };
    Ok(Some(
        match (kind, ints.as_slice(), floats.as_slice(), texts.as_slice()) {
            (0, ..) => return Ok(None),
            (1, [yes], ..) => Value::Bool(*yes != 0),
            (2, [number], ..) => Value::Int(*number),
            (3, _, [number], _) => Value::Float(*number),
            (4, _, _, [text]) => Value::Text(text.as_str().into()),
            (5, ..) => Value::Bytes(bytes.into()),
            (6, all, ..) => Value::Ints(all.into()),
            (7, _, all, _) => Value::Floats(all.into()),
            (8, _, _, all) => Value::Texts(all.iter().map(|text| text.as_str().into()).collect()),
            (9, [sequence], _, [topic, of]) => property_graph::Sample {
                topic: topic.clone(),
                kind: of.clone(),
                sequence: sequence.cast_unsigned(),
            }
            .into(),
            _ => return Err(wrong()),
        },
    ))
}

fn step(record: &Record) -> Step {
    let stamp = record.stamp();
    let step = Step {
        count: stamp.count,
        writer: stamp.writer,
        sequence: stamp.sequence,
        ..Step::default()
    };
    match record {
        Record::Node { kind, .. } => Step {
            what: 0,
            name: kind.clone(),
            ..step
        },
        Record::Edge { kind, from, to, .. } => Step {
            what: 1,
            name: kind.clone(),
            of: key(*from),
            to: key(*to),
            ..step
        },
        Record::Attribute {
            of, name, value, ..
        } => Step {
            what: 2,
            name: name.clone(),
            of: key(*of),
            value: content(value.as_ref()),
            ..step
        },
        Record::Removed { of, .. } => Step {
            what: 3,
            of: key(*of),
            ..step
        },
    }
}

fn record(step: Step) -> Result<Record, DecodeError> {
    let stamp = Stamp {
        count: step.count,
        writer: step.writer,
        sequence: step.sequence,
    };
    Ok(match step.what {
        0 => Record::Node {
            stamp,
            kind: step.name,
        },
        1 => Record::Edge {
            stamp,
            kind: step.name,
            from: step.of.id(),
            to: step.to.id(),
        },
        2 => Record::Attribute {
            stamp,
            of: step.of.id(),
            name: step.name,
            value: value(step.value)?,
        },
        3 => Record::Removed {
            stamp,
            of: step.of.id(),
        },
        other => {
            return Err(DecodeError::NoSuchValue {
                what: "a step of a change",
                value: i64::from(other),
            });
        }
    })
}

/// About how many bytes records have.
pub(crate) fn size(records: &[Record]) -> usize {
    let size = |record: &Record| match record {
        Record::Node { kind, .. } | Record::Edge { kind, .. } => kind.len(),
        Record::Attribute { name, value, .. } => name.len() + value.as_ref().map_or(0, Value::size),
        Record::Removed { .. } => 0,
    };
    let sizes = records.iter().map(|record| 104 + size(record));
    sizes.sum()
}

/// About how many bytes a delta has in an answer.
pub(crate) fn size_of(delta: &Delta) -> usize {
    let vectors = [&delta.seen, &delta.since, &delta.upto, &delta.forgotten];
    let vectors: usize = vectors.iter().map(|vector| vector.len() * 16).sum();
    64 + vectors + size(&delta.records)
}

fn nanos(time: Time) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}

fn time(nanos: i64) -> Time {
    Time::from_nanos(nanos.max(0).cast_unsigned())
}

pub(crate) fn encode(message: &Content, writer: &mut Writer<'_>) {
    match message {
        Content::Change {
            schema,
            time,
            delta,
        } => {
            let count = |of: &Vector| of.get(&delta.sender).copied().unwrap_or_default();
            writer.put(&Change {
                schema: *schema,
                sender: delta.sender,
                time: nanos(*time),
                since: count(&delta.since),
                upto: count(&delta.upto),
                steps: delta.records.iter().map(step).collect(),
            });
        }
        Content::Samples {
            schema,
            sender,
            time,
            samples,
        } => writer.put(&Samples {
            schema: *schema,
            sender: *sender,
            time: nanos(*time),
            values: samples.iter().map(stream_value).collect(),
        }),
        Content::Digest(digest) => writer.put(&Digest {
            schema: digest.schema,
            sender: digest.sender,
            name: digest.name.clone(),
            seen: keys(&digest.seen),
            ranges: digest.ranges.clone(),
            streams: digest.streams,
            elements: digest.elements,
            conflicts: digest.conflicts,
            leaving: digest.is_leaving,
        }),
        Content::Ask {
            sender,
            to,
            number,
            since,
            ranges,
            chunks,
        } => writer.put(&Ask {
            sender: *sender,
            to: *to,
            number: *number,
            since: keys(since),
            ranges: ranges.clone(),
            chunks: chunks.clone(),
        }),
        Content::Chunk {
            sender,
            to,
            number,
            at,
            count,
            bytes,
        } => writer.put(&Chunk {
            sender: *sender,
            to: *to,
            number: *number,
            at: *at,
            count: *count,
            bytes: bytes.clone(),
        }),
    }
}

fn stream_value(sample: &Sample) -> StreamValue {
    StreamValue {
        of: key(sample.of),
        name: sample.name.clone(),
        count: sample.count,
        writer: sample.writer,
        value: content(Some(&sample.value)),
    }
}

pub(crate) fn decode(topic: Topic, reader: &mut Reader<'_>) -> Result<Content, DecodeError> {
    Ok(match topic {
        Topic::Change => {
            let change: Change = reader.get()?;
            let records = change.steps.into_iter().map(record);
            Content::Change {
                schema: change.schema,
                time: time(change.time),
                delta: Delta {
                    sender: change.sender,
                    since: [(change.sender, change.since)].into(),
                    upto: [(change.sender, change.upto)].into(),
                    records: records.collect::<Result<_, _>>()?,
                    ..Delta::default()
                },
            }
        }
        Topic::Samples => {
            let samples: Samples = reader.get()?;
            let values = samples.values.into_iter().filter_map(|own| {
                let value = match value(own.value) {
                    Ok(value) => value?,
                    Err(error) => return Some(Err(error)),
                };
                Some(Ok(Sample {
                    of: own.of.id(),
                    name: own.name,
                    count: own.count,
                    writer: own.writer,
                    value,
                }))
            });
            Content::Samples {
                schema: samples.schema,
                sender: samples.sender,
                time: time(samples.time),
                samples: values.collect::<Result<_, _>>()?,
            }
        }
        Topic::Digest => {
            let digest: Digest = reader.get()?;
            Content::Digest(DigestOf {
                schema: digest.schema,
                sender: digest.sender,
                name: digest.name,
                seen: vector(&digest.seen),
                ranges: digest.ranges,
                streams: digest.streams,
                elements: digest.elements,
                conflicts: digest.conflicts,
                is_leaving: digest.leaving,
            })
        }
        Topic::Ask => {
            let ask: Ask = reader.get()?;
            Content::Ask {
                sender: ask.sender,
                to: ask.to,
                number: ask.number,
                since: vector(&ask.since),
                ranges: ask.ranges,
                chunks: ask.chunks,
            }
        }
        Topic::Chunk => {
            let chunk: Chunk = reader.get()?;
            Content::Chunk {
                sender: chunk.sender,
                to: chunk.to,
                number: chunk.number,
                at: chunk.at,
                count: chunk.count,
                bytes: chunk.bytes,
            }
        }
    })
}

/// The bytes of an answer.
pub(crate) fn answer(deltas: &[Delta]) -> Vec<u8> {
    let mut writer = Writer::default();
    let answers = deltas.iter().map(|delta| Answer {
        sender: delta.sender,
        seen: keys(&delta.seen),
        since: keys(&delta.since),
        upto: keys(&delta.upto),
        forgotten: keys(&delta.forgotten),
        range: delta.all_of.map_or_else(Vec::new, |(range, ranges)| {
            vec![range as u32, ranges as u32]
        }),
        steps: delta.records.iter().map(step).collect(),
    });
    writer.put(&answers.collect::<Vec<_>>());
    writer.into_bytes()
}

/// Reads an answer.
pub(crate) fn read_answer(bytes: &[u8]) -> Result<Vec<Delta>, DecodeError> {
    let answers: Vec<Answer> = Reader::new(bytes).get()?;
    let deltas = answers.into_iter().map(|answer| {
        let records = answer.steps.into_iter().map(record);
        Ok(Delta {
            sender: answer.sender,
            seen: vector(&answer.seen),
            since: vector(&answer.since),
            upto: vector(&answer.upto),
            forgotten: vector(&answer.forgotten),
            all_of: match answer.range.as_slice() {
                [] => None,
                [range, ranges] if range < ranges => Some((*range as usize, *ranges as usize)),
                _ => return Err(DecodeError::Unknown("range of an answer")),
            },
            records: records.collect::<Result<_, _>>()?,
        })
    });
    deltas.collect()
}
