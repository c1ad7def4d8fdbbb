//! Contents of a recording, as lists, tables and shorter recordings.

use crate::definition;
use crate::error::RecordError;
use crate::keys;
use crate::reader::{self, Channel, Message, Record};
use crate::schema::Schema;
use crate::writer::{ChannelId, Limits, Writer};
use rc_diagnostics::nearest;
use rc_mcap::Stamp;
use rc_middleware::{Cdr, Reader};
use rc_values::{Columns, Struct, Value, cells};
use serde_json::Value as Json;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufWriter, Write};
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

    /// Fails for a name that no topic of the recording has; the error names the nearest topic.
    pub fn check(&self, info: &Info) -> Result<(), RecordError> {
        for name in &self.topics {
            let one = Self {
                topics: vec![name.clone()],
                ..Self::default()
            };
            let topics = info.topics.keys();
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
        let is_late = self.selection.from.is_none_or(|from| after >= from);
        is_early && is_late && self.selection.has_topic(&message.channel.topic)
    }

    /// Lets a reader leave out what is later than any message that is meant, also the attachments
    /// and tables there.
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
    /// Why it ends before its end, if it does.
    pub cut: Option<String>,
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
                    let (first, last) = info.times.unwrap_or((time, time));
                    info.times = Some((first.min(time), last.max(time)));
                    let topic = info.topic(&message.channel);
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
        info.cut = reader.cut().map(str::to_owned);
        Ok(info)
    }

    fn topic(&mut self, channel: &Arc<Channel>) -> &mut Topic {
        let new = || Topic {
            channel: Arc::clone(channel),
            count: 0,
            bytes: 0,
            channels: 0,
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
    types: BTreeMap<(String, String), Result<Arc<Struct>, String>>,
}

impl Decoder {
    /// The value of a message.
    pub fn value(&mut self, message: &Message) -> Result<Value, RecordError> {
        let ty = self.ty(&message.channel)?;
        definition::decode(&ty, message)
    }

    /// The type of a channel.
    pub fn ty(&mut self, channel: &Channel) -> Result<Arc<Struct>, RecordError> {
        let key = (channel.topic.clone(), channel.type_name.clone());
        let read = || definition::of_channel(channel).map_err(|e| e.to_string());
        let ty = self.types.entry(key).or_insert_with(read);
        ty.clone().map_err(RecordError::Value)
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

/// Hands all messages of a selection to `take`, until it says that it is enough.
pub fn each(
    path: &Path,
    selection: Selection,
    take: &mut dyn FnMut(Message) -> Result<bool, RecordError>,
) -> Result<Option<String>, RecordError> {
    let mut reader = reader::Reader::open(path)?;
    let mut selecting = selection.begin(&reader);
    selecting.limit(&mut reader);
    while let Some(record) = reader.next() {
        let Record::Message(message) = record else {
            continue;
        };
        if selecting.takes(&message) && !take(message)? {
            return Ok(None);
        }
    }
    Ok(reader.cut().map(str::to_owned))
}

/// Writes the messages of a selection, with all attachments and tables, into a new recording.
/// Returns their number, and why the recording ends before its end, if it does.
pub fn cut(
    path: &Path,
    selection: Selection,
    to: &Path,
) -> Result<(u64, Option<String>), RecordError> {
    let mut reader = reader::Reader::open(path)?;
    let mut writer = Writer::create(to, Limits::default())?;
    let mut selecting = selection.begin(&reader);
    let mut channels: BTreeMap<u16, ChannelId> = BTreeMap::new();
    let mut count = 0;
    while let Some(record) = reader.next() {
        match record {
            // Attachments and tables may follow what the selection leaves out.
            Record::Message(message) => {
                if selecting.takes(&message) {
                    copy(&mut writer, &mut channels, &message)?;
                    count += 1;
                }
            }
            Record::Attachment(file) => writer.attach(&file.name, &file.media_type, file.data)?,
            Record::Metadata(name, table) => writer.metadata(&name, &table)?,
        }
    }
    writer.finish()?;
    Ok((count, reader.cut().map(str::to_owned)))
}

fn copy(
    writer: &mut Writer,
    channels: &mut BTreeMap<u16, ChannelId>,
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

/// The tables that were written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tables {
    /// The files, one for each topic.
    pub files: Vec<PathBuf>,
    /// Topics with a column that their table lacks, because the first message did not have it.
    pub incomplete: Vec<(String, String)>,
    /// Why the recording ends before its end, if it does.
    pub cut: Option<String>,
}

/// The table of a topic.
struct Table {
    file: Option<(PathBuf, BufWriter<File>)>,
    columns: Columns,
}

/// Whether a message is a row of a table.
fn is_row(message: &Message) -> bool {
    message.channel.encoding == "cdr"
}

/// Remembers the first topic, and refuses each other one.
fn only(first: &mut Option<String>, topic: &str) -> Result<(), RecordError> {
    let first = first.get_or_insert_with(|| topic.to_owned());
    if first == topic {
        return Ok(());
    }
    Err(RecordError::Value(format!(
        "the selection has several topics, {first} and {topic} for example; name one with --topics, \
         or a folder with --out"
    )))
}

/// Writes a table of the messages of each selected topic as CSV: into `folder`, a file for each, or
/// to `out` if there is one topic.
pub fn csv(
    path: &Path,
    selection: Selection,
    folder: Option<&Path>,
    out: &mut dyn Write,
) -> Result<Tables, RecordError> {
    let mut first = None;
    if folder.is_none() {
        // Nothing is printed of a selection of several topics.
        each(path, selection.clone(), &mut |message| {
            if is_row(&message) {
                only(&mut first, &message.channel.topic)?;
            }
            Ok(true)
        })?;
    }
    let mut decoder = Decoder::default();
    let mut tables: BTreeMap<String, Table> = BTreeMap::new();
    let mut names: BTreeSet<String> = BTreeSet::new();
    let mut incomplete = Vec::new();
    let cut = each(path, selection, &mut |message| {
        let topic = &message.channel.topic;
        if !is_row(&message) {
            return Ok(true);
        }
        if folder.is_none() {
            // The file of a recording that runs may have grown.
            only(&mut first, topic)?;
        }
        let cells = cells("", &decoder.value(&message)?);
        let mut text = String::new();
        if !tables.contains_key(topic) {
            let file = folder.map(|folder| {
                let path = folder.join(file_name(topic, &mut names));
                let file = File::create(&path).map_err(|e| RecordError::file(&path, &e))?;
                Ok((path, BufWriter::new(file)))
            });
            let file: Option<Result<_, RecordError>> = file;
            let file = file.transpose()?;
            let columns = Columns::new("log_time_s,publish_time_s", &cells);
            text += columns.header();
            tables.insert(topic.clone(), Table { file, columns });
        }
        let Some(table) = tables.get_mut(topic) else {
            return Ok(true);
        };
        if let Some(column) = table.columns.missing(&cells) {
            incomplete.push((topic.clone(), column.to_owned()));
        }
        let times = [message.log_time, message.publish_time].map(seconds);
        text += &table.columns.row(&times.join(","), &cells);
        let written = match &mut table.file {
            Some((_, file)) => file.write_all(text.as_bytes()),
            None => out.write_all(text.as_bytes()),
        };
        written.map_err(|e| RecordError::Value(format!("the table cannot be written: {e}")))?;
        Ok(true)
    })?;
    let mut files = Vec::new();
    for (_, table) in tables {
        if let Some((path, mut file)) = table.file {
            file.flush().map_err(|e| RecordError::file(&path, &e))?;
            files.push(path);
        }
    }
    Ok(Tables {
        files,
        incomplete,
        cut,
    })
}

/// The file of a topic: its name without what no file system likes, and a number where another
/// topic has the same one.
fn file_name(topic: &str, taken: &mut BTreeSet<String>) -> String {
    let plain = topic.trim_matches('/').chars().take(200);
    let plain = plain.map(|c| if c.is_ascii_alphanumeric() { c } else { '_' });
    let plain: String = plain.collect();
    let mut name = format!("{plain}.csv");
    let mut number = 1;
    while !taken.insert(name.clone()) {
        number += 1;
        name = format!("{plain}-{number}.csv");
    }
    name
}

/// Nanoseconds as seconds, with all digits.
pub fn seconds(nanoseconds: u64) -> String {
    format!(
        "{}.{:09}",
        nanoseconds / 1_000_000_000,
        nanoseconds % 1_000_000_000
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_topics_never_have_one_file() {
        let mut taken = BTreeSet::new();
        let names = ["/a/b", "/a_b", "/../x"].map(|topic| file_name(topic, &mut taken));
        assert_eq!(names, ["a_b.csv", "a_b-2.csv", "___x.csv"]);
    }
}
