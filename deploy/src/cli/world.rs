//! `rcdeploy world`: the replicas of a network's shared world, as they tell each other.

use super::look::look;
use super::messages::{interrupts, is_interrupted};
use super::output::{Failure, print_note, show};
use rc_deploy_client::Format;
use rc_diagnostics::foreign::{clean, clean_to};
use rc_observe::{Network, Observed, Observer, Topic};
use rc_values::Value;
use serde::Serialize;
use std::collections::BTreeMap;
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

/// The topic on which each replica tells once a second what it has.
const DIGESTS: (&str, &str) = ("RcWorld::World", "digest");
/// How long the command listens: each replica has told by then.
const LISTENING: Duration = Duration::from_millis(2500);
/// How many characters of a name are printed.
const MOST_NAME: usize = 40;

/// What a replica told last.
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
    conflicts: u64,
    /// Whether others have another schema.
    other_schema: bool,
    #[serde(skip)]
    schema: u64,
    #[serde(skip)]
    streams: u64,
    #[serde(skip)]
    seen: BTreeMap<u64, u64>,
}

#[derive(Serialize)]
struct World {
    network: String,
    is_equal: bool,
    replicas: Vec<Replica>,
}

/// Prints the replicas of a network.
pub(super) fn world(network: &str, format: Format) -> Result<u8, Failure> {
    let network = look(network)?;
    let topics = network.topics().into_iter();
    let topics = topics
        .filter(|topic| topic.interface.name == DIGESTS.0 && topic.operation.name == DIGESTS.1);
    let topics: Vec<Topic> = topics.collect();
    if topics.is_empty() {
        let message = format!("no component of `{}` has a world", clean(&network.name));
        return Err(Failure(1, message));
    }
    let Some(replicas) = listen(&network, &topics)? else {
        return Ok(0);
    };
    if replicas.is_empty() {
        let message = format!("no replica of `{}` told what it has", clean(&network.name));
        return Err(Failure(3, message));
    }
    let world = compare(&network.name, replicas);
    show(format, &world, table)
}

/// The last digest of each replica. `None` at Ctrl-C.
fn listen(network: &Network, topics: &[Topic]) -> Result<Option<Vec<Replica>>, Failure> {
    let interrupts = interrupts()?;
    let mut observer = Observer::new(network)?;
    let mut feeds = BTreeMap::new();
    for topic in topics {
        feeds.insert(observer.open(topic)?, topic);
    }
    let mut replicas: BTreeMap<u64, Replica> = BTreeMap::new();
    let mut take = |topic: &Topic, observed: &Observed<'_>| match topic.decode(observed) {
        Ok(value) => match digest(&value) {
            Some((writer, _, true)) => {
                replicas.remove(&writer);
            }
            Some((writer, replica, false)) => {
                replicas.insert(writer, replica);
            }
            None => print_note(&"a digest has other members"),
        },
        Err(error) => print_note(&format!("a digest cannot be decoded: {error}")),
    };
    let end = Instant::now() + LISTENING;
    while Instant::now() < end {
        if is_interrupted(&interrupts) {
            return Ok(None);
        }
        let more = observer.take(&mut |feed, observed| {
            if let Some(topic) = feeds.get(&feed) {
                take(topic, &observed);
            }
        });
        if !more {
            let left = end.saturating_duration_since(Instant::now());
            observer.wait(&[interrupts.as_fd()], left.min(Duration::from_millis(100)));
        }
    }
    Ok(Some(replicas.into_values().collect()))
}

/// The writer, what it has, and whether it leaves.
fn digest(value: &Value) -> Option<(u64, Replica, bool)> {
    let json = serde_json::to_value(value).ok()?;
    let digest = json.get("digest")?;
    let number = |name: &str| digest.get(name)?.as_u64();
    let list = |name: &str| digest.get(name)?.as_array();
    let ranges = list("ranges")?.iter().filter_map(serde_json::Value::as_u64);
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
        conflicts: number("conflicts")?,
        other_schema: false,
        schema: number("schema")?,
        streams: number("streams")?,
        seen,
    };
    Some((writer, replica, digest.get("leaving")?.as_bool()?))
}

/// Compares replicas with all that any of them has.
fn compare(network: &str, mut replicas: Vec<Replica>) -> World {
    let mut all: BTreeMap<u64, u64> = BTreeMap::new();
    for (writer, count) in replicas.iter().flat_map(|replica| &replica.seen) {
        let known = all.entry(*writer).or_default();
        *known = (*known).max(*count);
    }
    // The schema that most have.
    let mut schemas: BTreeMap<u64, usize> = BTreeMap::new();
    for replica in &replicas {
        *schemas.entry(replica.schema).or_default() += 1;
    }
    let usual = schemas.into_iter().max_by_key(|(_, count)| *count);
    let usual = usual.map(|(schema, _)| schema);
    for replica in &mut replicas {
        let lacks = |(writer, count): (&u64, &u64)| {
            count.saturating_sub(replica.seen.get(writer).copied().unwrap_or_default())
        };
        replica.behind = all.iter().map(lacks).fold(0, u64::saturating_add);
        replica.other_schema = Some(replica.schema) != usual;
    }
    replicas.sort_by(|a, b| (&a.name, &a.writer).cmp(&(&b.name, &b.writer)));
    let state = |replica: &Replica| (replica.digest.clone(), replica.streams);
    let first = replicas.first().map(state);
    World {
        network: clean(network),
        is_equal: replicas.iter().all(|own| Some(state(own)) == first),
        replicas,
    }
}

fn table(world: &World) -> String {
    let width = world.replicas.iter().map(|own| own.name.chars().count());
    let width = width.max().unwrap_or(0).max("REPLICA".len());
    let is_equal = if world.is_equal { "equal" } else { "different" };
    let mut text = format!("{} replicas, {is_equal}\n", world.replicas.len());
    text += &format!(
        "{:width$}  {:16}  {:>8}  {:>9}  {:>6}  {:>9}\n",
        "REPLICA", "DIGEST", "ELEMENTS", "CHANGES", "BEHIND", "CONFLICTS"
    );
    for own in &world.replicas {
        let note = if own.other_schema {
            "  another schema"
        } else {
            ""
        };
        text += &format!(
            "{:width$}  {}  {:>8}  {:>9}  {:>6}  {:>9}{note}\n",
            own.name, own.digest, own.elements, own.changes, own.behind, own.conflicts
        );
    }
    text
}
