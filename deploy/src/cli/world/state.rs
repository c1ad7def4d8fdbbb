//! The announced states of the replicas of a world, how late they are, and what they send.

use super::replica::{Listener, ReceivedMessage, kind_name};
use crate::cli::output::{Failure, counted, show};
use rc_deploy_client::Format;
use rc_diagnostics::foreign::{clean, clean_to};
use rc_world::Topic;
use rc_world::property_graph::Id;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// How long the command listens: each replica has announced its state by then.
const LISTENING: Duration = Duration::from_millis(2500);
/// How many characters of a name are printed.
const MOST_NAME: usize = 40;
/// How many changes are remembered to compute how late replicas are.
const MOST_CHANGES: usize = 1 << 16;

/// The last announcement of a replica.
#[derive(Clone, Serialize)]
struct Replica {
    name: String,
    writer: String,
    /// Equal for equal replicas.
    digest: String,
    elements: u64,
    /// How many changes it has seen.
    changes: u64,
    /// How many changes it has not seen that others have.
    behind: u64,
    /// The age of the oldest change that it had not seen at its announcement; 0 if it had all.
    behind_ms: u64,
    conflicts: u64,
    /// Whether others have another schema.
    other_schema: bool,
    #[serde(skip)]
    schema: u64,
    /// Equal for replicas that have the same newest values of streams.
    streams: String,
    #[serde(skip)]
    seen: BTreeMap<u64, u64>,
}

/// The messages of a component about one type.
#[derive(Serialize)]
struct Rate {
    writer: String,
    /// The type; for streams, with the attribute.
    what: String,
    is_stream: bool,
    /// Steps of changes, or values of streams, in a second.
    per_s: f64,
}

#[derive(Serialize)]
struct State {
    network: String,
    is_equal: bool,
    replicas: Vec<Replica>,
    rates: Vec<Rate>,
    /// The bytes of all messages in a second.
    bytes_per_s: f64,
    /// Values that lost against others, with the winners.
    conflicts: Vec<String>,
}

/// The received messages.
#[derive(Default)]
struct Record {
    replicas: BTreeMap<u64, Replica>,
    /// When a change arrived: its writer, and up to which of its steps it goes.
    changes: Vec<(u64, u64, Instant)>,
    /// Steps and values: the sender, the element or the type, the attribute of a stream.
    sent: BTreeMap<(u64, Subject, String), u64>,
    bytes: u64,
}

/// The subject of a step.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Subject {
    Type(String),
    Element(u64, u64),
}

pub(super) fn state(network: &str, format: Format) -> Result<u8, Failure> {
    let mut listener = Listener::open(network, None)?;
    let mut record = Record::default();
    let begin = Instant::now();
    while begin.elapsed() < LISTENING {
        if !listener.turn(&mut |heard| record.note(heard))? {
            return Ok(0);
        }
    }
    let name = listener.network.name.clone();
    if record.replicas.is_empty() {
        let message = format!("no replica of `{}` has announced its state", clean(&name));
        return Err(Failure(3, message));
    }
    let state = record.state(&listener, begin.elapsed());
    show(format, &state, table)
}

impl Record {
    fn note(&mut self, heard: &ReceivedMessage) {
        self.bytes += heard.bytes as u64;
        let json = serde_json::to_value(&heard.value).unwrap_or_default();
        let inner = &json[kind_name(heard.kind)];
        match heard.kind {
            Topic::Digest => self.digest(inner),
            Topic::Change => self.change(inner),
            Topic::Samples => self.samples(inner),
            Topic::Ask | Topic::Chunk => {}
        }
    }

    fn change(&mut self, change: &Value) {
        let number = |of: &Value, name: &str| of[name].as_u64().unwrap_or_default();
        let sender = number(change, "sender");
        if self.changes.len() < MOST_CHANGES {
            self.changes
                .push((sender, number(change, "upto"), Instant::now()));
        }
        for step in change["steps"].as_array().into_iter().flatten() {
            let of = match number(step, "what") {
                0 | 1 => Subject::Type(step["name"].as_str().unwrap_or_default().to_owned()),
                _ => Subject::Element(number(&step["of"], "writer"), number(&step["of"], "count")),
            };
            *self.sent.entry((sender, of, String::new())).or_default() += 1;
        }
    }

    fn samples(&mut self, samples: &Value) {
        let number = |of: &Value, name: &str| of[name].as_u64().unwrap_or_default();
        for value in samples["values"].as_array().into_iter().flatten() {
            let of = Subject::Element(
                number(&value["of"], "writer"),
                number(&value["of"], "count"),
            );
            let name = value["name"].as_str().unwrap_or_default().to_owned();
            *self
                .sent
                .entry((number(samples, "sender"), of, name))
                .or_default() += 1;
        }
    }

    fn digest(&mut self, digest: &Value) {
        let Some((writer, mut replica)) = replica(digest) else {
            return;
        };
        if digest["leaving"] == true {
            self.replicas.remove(&writer);
            return;
        }
        let unseen = self.changes.iter().find(|(writer, upto, _)| {
            replica.seen.get(writer).copied().unwrap_or_default() < *upto
        });
        let late = unseen.map(|(_, _, arrived)| arrived.elapsed());
        replica.behind_ms = late.map_or(0, |late| late.as_millis() as u64);
        self.replicas.insert(writer, replica);
    }

    /// Compares replicas with all that any of them has.
    fn state(mut self, listener: &Listener, over: Duration) -> State {
        let mut all: BTreeMap<u64, u64> = BTreeMap::new();
        for (writer, count) in self.replicas.values().flat_map(|replica| &replica.seen) {
            let known = all.entry(*writer).or_default();
            *known = (*known).max(*count);
        }
        // The schema that most have.
        let mut schemas: BTreeMap<u64, usize> = BTreeMap::new();
        for replica in self.replicas.values() {
            *schemas.entry(replica.schema).or_default() += 1;
        }
        let usual = schemas.into_iter().max_by_key(|(_, count)| *count);
        let usual = usual.map(|(schema, _)| schema);
        for replica in self.replicas.values_mut() {
            let lacks = |(writer, count): (&u64, &u64)| {
                count.saturating_sub(replica.seen.get(writer).copied().unwrap_or_default())
            };
            replica.behind = all.iter().map(lacks).fold(0, u64::saturating_add);
            replica.other_schema = Some(replica.schema) != usual;
        }
        // Replicas announce at different moments what goes on between them.
        let is_streaming = self
            .sent
            .keys()
            .any(|(.., attribute)| !attribute.is_empty());
        let state = |replica: &Replica| {
            let streams = (!is_streaming).then(|| replica.streams.clone());
            (replica.digest.clone(), streams)
        };
        let first = self.replicas.values().next().map(state);
        let is_equal = self.replicas.values().all(|own| Some(state(own)) == first);
        let seconds = over.as_secs_f64();
        let per_s = |count: u64| (count as f64 / seconds * 10.0).round() / 10.0;
        let rates = self.rates(listener, per_s);
        let mut replicas: Vec<Replica> = self.replicas.into_values().collect();
        replicas.sort_by(|a, b| (&a.name, &a.writer).cmp(&(&b.name, &b.writer)));
        State {
            network: clean(&listener.network.name),
            is_equal,
            replicas,
            rates,
            bytes_per_s: per_s(self.bytes),
            conflicts: listener.world.health().first_conflicts,
        }
    }

    /// How often each component sends something of a type.
    fn rates(&self, listener: &Listener, per_s: impl Fn(u64) -> f64) -> Vec<Rate> {
        let world = listener.world.snapshot();
        let mut counts: BTreeMap<(String, String, bool), u64> = BTreeMap::new();
        for ((sender, of, attribute), count) in &self.sent {
            let kind = match of {
                Subject::Type(kind) => clean(kind),
                Subject::Element(writer, number) => {
                    let element = world.find(Id::new(*writer, *number));
                    let kind = element.map(|element| super::elements::kind(&world, element));
                    clean(kind.unwrap_or("removed elements"))
                }
            };
            let writer = match self.replicas.get(sender) {
                Some(replica) => replica.name.clone(),
                None => format!("{sender:016x}"),
            };
            let is_stream = !attribute.is_empty();
            let what = if is_stream {
                format!("{kind}.{}", clean(attribute))
            } else {
                kind
            };
            *counts.entry((writer, what, is_stream)).or_default() += count;
        }
        let rates = counts
            .into_iter()
            .map(|((writer, what, is_stream), count)| Rate {
                writer,
                what,
                is_stream,
                per_s: per_s(count),
            });
        rates.collect()
    }
}

/// The writer, and its state.
fn replica(digest: &Value) -> Option<(u64, Replica)> {
    let number = |name: &str| digest.get(name)?.as_u64();
    let list = |name: &str| digest.get(name)?.as_array();
    let ranges = list("ranges")?.iter().filter_map(Value::as_u64);
    let one = ranges.fold(0, u64::wrapping_add);
    let seen = list("seen")?.iter().filter_map(|key| {
        let number = |name: &str| key.get(name)?.as_u64();
        Some((number("writer")?, number("count")?))
    });
    let seen: BTreeMap<u64, u64> = seen.collect();
    let writer = number("sender")?;
    let replica = Replica {
        name: clean_to(digest.get("name")?.as_str()?, MOST_NAME),
        writer: format!("{writer:016x}"),
        digest: format!("{one:016x}"),
        elements: number("elements")?,
        changes: seen.values().copied().fold(0, u64::saturating_add),
        behind: 0,
        behind_ms: 0,
        conflicts: number("conflicts")?,
        other_schema: false,
        schema: number("schema")?,
        streams: format!("{:016x}", number("streams")?),
        seen,
    };
    Some((writer, replica))
}

fn table(state: &State) -> String {
    let width = state.replicas.iter().map(|own| own.name.chars().count());
    let width = width.max().unwrap_or(0).max("REPLICA".len());
    let is_equal = if state.is_equal { "equal" } else { "different" };
    let mut text = format!(
        "{}, {is_equal}\n",
        counted(state.replicas.len() as u64, "replica")
    );
    text += &format!(
        "{:width$}  {:16}  {:>8}  {:>9}  {:>6}  {:>8}  {:>9}\n",
        "REPLICA", "DIGEST", "ELEMENTS", "CHANGES", "BEHIND", "FOR", "CONFLICTS"
    );
    for own in &state.replicas {
        let note = if own.other_schema {
            "  another schema"
        } else {
            ""
        };
        let late = match own.behind_ms {
            0 => String::new(),
            ms => format!("{ms} ms"),
        };
        text += &format!(
            "{:width$}  {}  {:>8}  {:>9}  {:>6}  {late:>8}  {:>9}{note}\n",
            own.name, own.digest, own.elements, own.changes, own.behind, own.conflicts
        );
    }
    if !state.rates.is_empty() {
        text += &format!("\nsent, {} bytes/s in all\n", state.bytes_per_s);
        for rate in &state.rates {
            let unit = if rate.is_stream { "values" } else { "steps" };
            text += &format!(
                "{:width$}  {}  {} {unit}/s\n",
                rate.writer, rate.what, rate.per_s
            );
        }
    }
    if !state.conflicts.is_empty() {
        text += "\nnot shown\n";
        for conflict in &state.conflicts {
            text += &format!("{conflict}\n");
        }
    }
    text
}
