//! Messages as bytes: the structures of `World.idsl`, encoded as CDR.

use crate::content::{Content, DigestOf, Topic};
use graph_merge::{Change, Delta, Record, Vector};
use property_graph::{Time, Value};
use rc_middleware::{Cdr, DecodeError, Reader, Writer, cdr_struct};
use samples::{put_samples, samples};
use steps::{put_steps, records};

mod samples;
mod steps;

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
            change,
        } => {
            writer.put(schema);
            writer.put(&change.writer);
            writer.put(&nanos(*time));
            writer.put(&change.since);
            writer.put(&change.upto);
            put_steps(writer, &change.records);
        }
        Content::Samples {
            schema,
            sender,
            time,
            samples,
        } => {
            writer.put(schema);
            writer.put(sender);
            writer.put(&nanos(*time));
            put_samples(writer, samples);
        }
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
        } => {
            // As `Chunk`, without a copy.
            for number in [sender, to, number] {
                writer.put(number);
            }
            writer.put(at);
            writer.put(count);
            writer.put(bytes);
        }
    }
}

pub(crate) fn decode(topic: Topic, reader: &mut Reader<'_>) -> Result<Content, DecodeError> {
    Ok(match topic {
        Topic::Change => {
            let schema = reader.get()?;
            let sender = reader.get()?;
            let made: i64 = reader.get()?;
            Content::Change {
                schema,
                time: time(made),
                change: Change {
                    writer: sender,
                    since: reader.get()?,
                    upto: reader.get()?,
                    records: records(reader)?,
                },
            }
        }
        Topic::Samples => {
            let schema = reader.get()?;
            let sender = reader.get()?;
            let made: i64 = reader.get()?;
            Content::Samples {
                schema,
                sender,
                time: time(made),
                samples: samples(reader)?,
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

/// The bytes of an answer: a `sequence<Answer>`.
pub(crate) fn answer(deltas: &[Delta]) -> Vec<u8> {
    let sizes = deltas.iter().map(size_of);
    let mut writer = Writer::over(Vec::with_capacity(sizes.sum()));
    writer.length(deltas.len());
    for delta in deltas {
        put_answer(&mut writer, delta);
    }
    writer.into_bytes()
}

fn put_answer(writer: &mut Writer<'_>, delta: &Delta) {
    writer.put(&delta.sender);
    for vector in [&delta.seen, &delta.since, &delta.upto, &delta.forgotten] {
        writer.put(&keys(vector));
    }
    let range = delta.all_of.map(|(range, ranges)| [range, ranges]);
    let range = range.into_iter().flatten().map(|number| number as u32);
    writer.put(&range.collect::<Vec<u32>>());
    put_steps(writer, &delta.records);
}

#[derive(Clone)]
struct Answer(Delta);

impl Cdr for Answer {
    fn encode(&self, writer: &mut Writer<'_>) {
        put_answer(writer, &self.0);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let sender = reader.get()?;
        let mut next = || reader.get::<Vec<Key>>().map(|keys| vector(&keys));
        let [seen, since, upto, forgotten] = [next()?, next()?, next()?, next()?];
        let all_of = match reader.get::<Vec<u32>>()?[..] {
            [] => None,
            [range, ranges] if range < ranges => Some((range as usize, ranges as usize)),
            _ => return Err(DecodeError::Unknown("range of an answer")),
        };
        Ok(Self(Delta {
            sender,
            seen,
            since,
            upto,
            forgotten,
            all_of,
            records: records(reader)?,
        }))
    }
}

/// Reads an answer.
pub(crate) fn read_answer(bytes: &[u8]) -> Result<Vec<Delta>, DecodeError> {
    let answers: Vec<Answer> = Reader::new(bytes).get()?;
    Ok(answers.into_iter().map(|answer| answer.0).collect())
}
