//! Contents of a recording, as lists and shorter recordings.

use crate::definition;
use crate::error::RecordError;
use crate::keys;
use crate::latched::Latched;
use crate::reader::files::PART;
use crate::reader::{self, Channel, Faults, Message, Record};
use crate::schema::Schema;
use crate::writer::{ChannelId, Limits, TABLE, Writer};
use rc_diagnostics::nearest;
use rc_mcap::Stamp;
use rc_middleware::{Cdr, Reader};
use rc_values::{Struct, Value};
use serde_json::Value as Json;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Which messages of a recording are meant.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Topics, or their ends. Empty for all.
    pub topics: Vec<String>,
    /// The time since the beginning of the file from which on messages are meant.
    pub from: Option<Duration>,
    /// The time since the beginning of the file until which messages are meant.
    pub to: Option<Duration>,
}

/// A selection while a recording is read.
#[derive(Clone, Debug, Default)]
pub struct Selecting {
    selection: Selection,
    first: Option<u64>,
}

impl Selection {
    /// Begins to read.
    pub fn begin(self, reader: &reader::Reader) -> Selecting {
        Selecting {
            selection: self,
            first: reader.times().first,
        }
    }

    /// Whether a topic is meant: it is named, or ends with a name that is given.
    pub fn has_topic(&self, topic: &str) -> bool {
        let is_meant = |name: &String| {
            let name = name.trim_start_matches('/');
            let topic = topic.trim_start_matches('/');
            topic == name
                || topic
                    .strip_suffix(name)
                    .is_some_and(|before| before.ends_with('/'))
        };
        self.topics.is_empty() || self.topics.iter().any(is_meant)
    }

    /// Fails for a name that no topic with messages has; the error names the nearest topic. Reads a
    /// recording to its end only if it has no summary.
    pub fn check(&self, path: &Path) -> Result<(), RecordError> {
        if self.topics.is_empty() {
            return Ok(());
        }
        let reader = reader::Reader::open(path)?;
        let topics: BTreeSet<String> = match reader.listed() {
            Some(listed) => listed.iter().map(|one| one.topic.clone()).collect(),
            None => Info::read(path)?.topics.into_keys().collect(),
        };
        for name in &self.topics {
            let one = Self {
                topics: vec![name.clone()],
                ..Self::default()
            };
            let topics = topics.iter();
            if !topics.clone().any(|topic| one.has_topic(topic)) {
                let ends = topics
                    .clone()
                    .flat_map(|topic| topic.rsplit('/').take(1).chain([topic.as_str()]));
                let hint = match nearest(name, ends) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!(
                        "there are {}",
                        topics.cloned().collect::<Vec<_>>().join(", ")
                    ),
                };
                return Err(RecordError::Value(format!(
                    "the recording has no topic `{name}`; {hint}"
                )));
            }
        }
        Ok(())
    }
}

impl Selecting {
    /// Whether a message is meant.
    pub fn takes(&mut self, message: &Message) -> bool {
        let after = self.after(message);
        let is_early = self.selection.to.is_none_or(|to| after <= to);
        is_early && !self.is_before(message) && self.selection.has_topic(&message.channel.topic)
    }

    /// Whether a message is earlier than those that are meant.
    pub fn is_before(&mut self, message: &Message) -> bool {
        let after = self.after(message);
        self.selection.from.is_some_and(|from| after < from)
    }

    /// Whether the value of a message holds when the selection begins, until another one follows.
    pub fn holds_before(&mut self, message: &Message) -> bool {
        message.channel.is_latched()
            && self.is_before(message)
            && self.selection.has_topic(&message.channel.topic)
    }

    /// The time at which the selection begins. `None` before the first message.
    pub fn begin(&self) -> Option<u64> {
        let from = self.selection.from.unwrap_or_default().as_nanos();
        let from = u64::try_from(from).unwrap_or(u64::MAX);
        Some(self.first?.saturating_add(from))
    }

    /// Lets a reader leave out everything later than the selected messages, also attachments and
    /// tables there.
    pub fn limit(&self, reader: &mut reader::Reader) {
        if let (Some(first), Some(to)) = (self.first, self.selection.to) {
            let to = u64::try_from(to.as_nanos()).unwrap_or(u64::MAX);
            reader.end_after(first.saturating_add(to));
        }
    }

    /// The time since the beginning of the file.
    fn after(&mut self, message: &Message) -> Duration {
        let first = *self.first.get_or_insert(message.log_time);
        Duration::from_nanos(message.log_time.saturating_sub(first))
    }
}

/// Figures of one topic.
#[derive(Clone, Debug)]
pub struct Topic {
    /// First channel of the topic.
    pub channel: Arc<Channel>,
    /// The number of its messages.
    pub count: u64,
    /// Their bytes.
    pub bytes: u64,
    /// The number of its channels: one for each sender.
    pub channels: usize,
    /// The first and the last time, in nanoseconds.
    pub times: Option<(u64, u64)>,
}

impl Topic {
    /// Messages a second between the first and the last one.
    pub fn rate(&self) -> Option<f64> {
        let (first, last) = self.times?;
        let length = last.checked_sub(first).filter(|length| *length > 0)?;
        let intervals = self.count.checked_sub(1).filter(|count| *count > 0)?;
        Some(intervals as f64 * 1e9 / length as f64)
    }
}

/// Summary of a recording.
#[derive(Clone, Debug, Default)]
pub struct Info {
    /// The first and the last time, in nanoseconds.
    pub times: Option<(u64, u64)>,
    /// Topics by name.
    pub topics: BTreeMap<String, Topic>,
    /// Attachments: name and size.
    pub attachments: Vec<(String, usize)>,
    /// Tables of texts, by name (metadata records of MCAP).
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// The files and their sizes, in bytes.
    pub files: Vec<(PathBuf, u64)>,
    /// Why less was read than was recorded.
    pub faults: Faults,
}

fn spread(times: Option<(u64, u64)>, time: u64) -> (u64, u64) {
    let (first, last) = times.unwrap_or((time, time));
    (first.min(time), last.max(time))
}

impl Info {
    /// Reads a recording to its end.
    pub fn read(path: &Path) -> Result<Self, RecordError> {
        let mut reader = reader::Reader::open(path)?;
        let mut info = Self::default();
        while let Some(record) = reader.next() {
            match record {
                Record::Message(message) => {
                    let time = message.log_time;
                    info.times = Some(spread(info.times, time));
                    let topic = info.topic(&message.channel);
                    topic.times = Some(spread(topic.times, time));
                    topic.count += 1;
                    topic.bytes += message.data.len() as u64;
                }
                Record::Attachment(file) => info.attachments.push((file.name, file.data.len())),
                Record::Metadata(name, table) => {
                    info.metadata.insert(name, table);
                }
            }
        }
        for channel in reader.channels() {
            info.topic(channel).channels += 1;
        }
        let size = |path: &PathBuf| std::fs::metadata(path).map_or(0, |file| file.len());
        let files = reader.files().iter();
        info.files = files.map(|path| (path.clone(), size(path))).collect();
        info.faults = reader.faults().clone();
        Ok(info)
    }

    fn topic(&mut self, channel: &Arc<Channel>) -> &mut Topic {
        let new = || Topic {
            channel: Arc::clone(channel),
            count: 0,
            bytes: 0,
            channels: 0,
            times: None,
        };
        self.topics.entry(channel.topic.clone()).or_insert_with(new)
    }

    /// The number of messages.
    pub fn messages(&self) -> u64 {
        self.topics.values().map(|topic| topic.count).sum()
    }
}

/// Decodes the messages of a recording, each by the type of its channel.
#[derive(Default)]
pub struct Decoder {
    /// By the number of the channel.
    types: BTreeMap<u32, Type>,
    /// The bytes of the definitions that were read.
    read: usize,
}

/// The most bytes of definitions that a decoder reads. A type takes many times these.
const MOST_DEFINITIONS: usize = 8 << 20;

struct Type {
    channel: Arc<Channel>,
    ty: Result<Arc<Struct>, String>,
}

impl Decoder {
    /// The value of a message.
    pub fn value(&mut self, message: &Message) -> Result<Value, RecordError> {
        let ty = self.ty(&message.channel)?;
        definition::decode(&ty, message)
    }

    /// The type of a channel.
    pub fn ty(&mut self, channel: &Arc<Channel>) -> Result<Arc<Struct>, RecordError> {
        if let Some(known) = self.types.get(&channel.id) {
            return known.ty.clone().map_err(RecordError::Value);
        }
        let is_same = |known: &&Type| {
            let known = &known.channel;
            Arc::ptr_eq(&known.schema, &channel.schema)
                && (&known.type_name, &known.encoding) == (&channel.type_name, &channel.encoding)
        };
        let known = self.types.values().find(is_same);
        let ty = if let Some(known) = known {
            known.ty.clone()
        } else {
            self.read += channel.schema.len();
            if self.read > MOST_DEFINITIONS {
                Err(format!(
                    "the definitions of the recording have more than {} MiB",
                    MOST_DEFINITIONS >> 20
                ))
            } else {
                definition::of_channel(channel).map_err(|e| e.to_string())
            }
        };
        let new = Type {
            channel: Arc::clone(channel),
            ty: ty.clone(),
        };
        self.types.insert(channel.id, new);
        ty.map_err(RecordError::Value)
    }
}

/// The JSON document that a message holds: an event, parameters, or what others record as JSON.
pub fn document(message: &Message) -> Option<Json> {
    let channel = &message.channel;
    if channel.encoding == "json" {
        return serde_json::from_slice(&message.data).ok();
    }
    let is_document = channel.type_name == "std_msgs/msg/String"
        && channel.get(keys::KIND).is_some_and(|kind| kind != "sample");
    if !is_document {
        return None;
    }
    let body = definition::body(&message.data).ok()?;
    let text = String::decode(&mut Reader::new(body)).ok()?;
    serde_json::from_str(&text).ok()
}

/// Hands all messages of a selection to `take`, each with its time since the beginning of the
/// recording, until it says that it is enough. Returns why less was read than was recorded.
pub fn each(
    path: &Path,
    selection: Selection,
    take: &mut dyn FnMut(Message, Duration) -> Result<bool, RecordError>,
) -> Result<Faults, RecordError> {
    let mut reader = reader::Reader::open(path)?;
    let mut selecting = selection.begin(&reader);
    selecting.limit(&mut reader);
    while let Some(record) = reader.next() {
        let Record::Message(message) = record else {
            continue;
        };
        let after = selecting.after(&message);
        if selecting.takes(&message) && !take(message, after)? {
            break;
        }
    }
    Ok(reader.faults().clone())
}

/// Writes the messages of a selection, with all attachments and tables, into a new recording. The
/// values of states, parameters and latched topics that hold at its beginning come first, with the
/// time of the beginning.
///
/// Returns the number of messages, and why less was read than was recorded. Fails if the selection
/// has no messages.
pub fn cut(path: &Path, selection: Selection, to: &Path) -> Result<(u64, Faults), RecordError> {
    let mut reader = reader::Reader::open(path)?;
    let mut writer = Writer::create(to, Limits::default())?;
    let done = cut_into(&mut reader, selection, &mut writer).and_then(|count| {
        if count > 0 {
            return Ok(count);
        }
        let faults = reader.faults();
        let why = if faults.is_none() {
            String::new()
        } else {
            format!(" ({faults})")
        };
        let text = format!("the selection has no messages{why}, so nothing is written");
        Err(RecordError::Value(text))
    });
    let done = done.and_then(|count| writer.finish().map(|()| count));
    if done.is_err() {
        let _ = std::fs::remove_file(to);
    }
    Ok((done?, reader.faults().clone()))
}

fn cut_into(
    reader: &mut reader::Reader,
    selection: Selection,
    writer: &mut Writer,
) -> Result<u64, RecordError> {
    let mut selecting = selection.begin(reader);
    let mut channels: BTreeMap<u32, ChannelId> = BTreeMap::new();
    let mut latched = Latched::default();
    let mut counts = None;
    let mut count = 0;
    while let Some(record) = reader.next() {
        match record {
            // Attachments and tables may follow the messages that the selection leaves out.
            Record::Message(message) => {
                if selecting.takes(&message) {
                    let begin = selecting.begin().unwrap_or(message.log_time);
                    for held in latched.take(begin) {
                        copy(writer, &mut channels, &held)?;
                        count += 1;
                    }
                    copy(writer, &mut channels, &message)?;
                    count += 1;
                } else if selecting.holds_before(&message) {
                    latched.keep(message);
                }
            }
            Record::Attachment(file) => writer.attach(&file.name, &file.media_type, file.data)?,
            Record::Metadata(name, table) if name == TABLE => counts = Some(table),
            Record::Metadata(name, table) if name != PART => writer.metadata(&name, &table)?,
            Record::Metadata(..) => {}
        }
    }
    // The other counts are of the whole recording.
    if let Some(network) = counts.and_then(|mut table| table.remove("network")) {
        let messages = ("messages".to_owned(), count.to_string());
        let table = BTreeMap::from([("network".to_owned(), network), messages]);
        writer.metadata(TABLE, &table)?;
    }
    Ok(count)
}

fn copy(
    writer: &mut Writer,
    channels: &mut BTreeMap<u32, ChannelId>,
    message: &Message,
) -> Result<(), RecordError> {
    let channel = &message.channel;
    let id = *channels.entry(channel.id).or_insert_with(|| {
        let schema = (!channel.type_name.is_empty()).then(|| Schema {
            name: channel.type_name.clone(),
            encoding: channel.schema_encoding.clone(),
            text: channel.schema.to_vec(),
        });
        writer.channel(
            &channel.topic,
            &channel.encoding,
            schema,
            channel.metadata.clone(),
        )
    });
    let stamp = Stamp {
        log_time: message.log_time,
        publish_time: message.publish_time,
        sequence: message.sequence,
    };
    writer.write(id, stamp, &message.data)
}

/// Nanoseconds as seconds, with all digits.
pub fn seconds(nanoseconds: u64) -> String {
    format!(
        "{}.{:09}",
        nanoseconds / 1_000_000_000,
        nanoseconds % 1_000_000_000
    )
}

/// A length of time as people read it, in its two largest units: `2 min 5 s`, `1 year 40 days`.
pub fn length_text(length: Duration) -> String {
    let seconds = length.as_secs();
    if seconds < 60 {
        return format!("{:.3} s", length.as_secs_f64());
    }
    let units = [
        (365 * 86_400, "year", "years"),
        (86_400, "day", "days"),
        (3600, "h", "h"),
        (60, "min", "min"),
        (1, "s", "s"),
    ];
    let mut left = seconds;
    let mut parts = Vec::new();
    for (size, one, many) in units {
        let count = left / size;
        left %= size;
        if count > 0 || !parts.is_empty() {
            parts.push((count, if count == 1 { one } else { many }));
        }
    }
    let shown = parts.iter().take(2).filter(|(count, _)| *count > 0);
    let shown = shown.map(|(count, unit)| format!("{count} {unit}"));
    shown.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_time_have_two_units() {
        for (seconds, expected) in [
            (0, "0.000 s"),
            (59, "59.000 s"),
            (125, "2 min 5 s"),
            (3600, "1 h"),
            (400 * 86_400, "1 year 35 days"),
        ] {
            assert_eq!(length_text(Duration::from_secs(seconds)), expected);
        }
    }
}
