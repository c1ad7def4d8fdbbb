//! `rcdeploy bag`: looks into recordings.

use super::arguments::format;
use super::meaning::ConversionOptions;
use super::output::{Failure, counted, print_line, print_note, show, system, visible};
use clap::{Args, Subcommand};
use rc_command_line::{files, words};
use rc_deploy_client::Format;
use rc_diagnostics::foreign::{clean, escape_to};
use rc_diagnostics::print;
use rc_management::event::time_text;
use rc_record::bag::{self, Decoder, Info, Selection, length_text};
use rc_record::reader::Message;
use rc_record::table::csv;
use rc_record::{Faults, RecordError, keys};
use rc_values::Style;
use rc_vocabulary::duration;
use serde_json::{Value as Json, json};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

impl From<RecordError> for Failure {
    fn from(error: RecordError) -> Self {
        let code = match error {
            RecordError::File { .. } | RecordError::Table(_) => 3,
            RecordError::Network(error) => return error.into(),
            _ => 1,
        };
        Self(code, error.to_string())
    }
}

/// Which messages of a recording a command means.
#[derive(Args, Clone)]
pub(super) struct Selected {
    /// Only these topics: their names or the ends of their names, with commas.
    #[arg(long, value_name = "TOPIC", value_delimiter = ',')]
    pub(super) topics: Vec<String>,
    /// From this time after the beginning on, as in `10s`.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(super) from: Option<Duration>,
    /// Until this time after the beginning.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(super) to: Option<Duration>,
}

impl Selected {
    /// The selection. Fails for a topic that the recording does not have.
    pub(super) fn into_selection(self, file: &Path) -> Result<Selection, Failure> {
        let selection = Selection {
            topics: self.topics,
            from: self.from,
            to: self.to,
        };
        selection.check(file)?;
        Ok(selection)
    }
}

/// Says that less was read than was recorded. Returns the exit code that says so, too.
pub(super) fn note_faults(faults: &Faults) -> u8 {
    if faults.is_none() {
        return 0;
    }
    print_note(&format_args!("the recording is incomplete: {faults}"));
    1
}

/// Parses `10s`, `1.5min`, `250ms`.
pub(super) fn duration(text: &str) -> Result<Duration, String> {
    let parsed = duration::parse(text).map(Duration::from_nanos);
    let help =
        || duration::unknown_unit(text).unwrap_or("a time looks like `10s`, `1.5min` or `250ms`");
    parsed.ok_or_else(|| help().to_owned())
}

/// Parses a time above 0.
pub(super) fn positive_duration(text: &str) -> Result<Duration, String> {
    match duration(text)? {
        Duration::ZERO => Err("a time above 0 is expected".to_owned()),
        time => Ok(time),
    }
}

#[derive(Subcommand)]
pub(super) enum Bag {
    /// Shows the contents of a recording: duration, topics, types, losses, attachments.
    Info {
        /// The recording.
        #[arg(value_name = "FILE.mcap", add = files(&["mcap"]))]
        file: PathBuf,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Prints the messages of a recording.
    List {
        /// The recording.
        #[arg(value_name = "FILE.mcap", add = files(&["mcap"]))]
        file: PathBuf,
        #[command(flatten)]
        selected: Selected,
        /// Prints this many messages.
        #[arg(short = 'n', long)]
        count: Option<u64>,
        /// The form of the output: human or json (one object a line).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Writes a part of a recording into a new one.
    Cut {
        /// The recording.
        #[arg(value_name = "FILE.mcap", add = files(&["mcap"]))]
        file: PathBuf,
        #[command(flatten)]
        selected: Selected,
        /// The new recording.
        #[arg(short, long, value_name = "FILE.mcap")]
        output: PathBuf,
    },
    /// Writes messages as a table.
    Export {
        /// The form of the table: csv.
        #[arg(value_name = "FORMAT", value_parser = ["csv"])]
        table: String,
        /// The recording.
        #[arg(value_name = "FILE.mcap", add = files(&["mcap"]))]
        file: PathBuf,
        #[command(flatten)]
        selected: Selected,
        /// The folder of the tables, one for each topic. Without it, the table of one topic is
        /// printed.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        #[command(flatten)]
        meaning: ConversionOptions,
    },
}

pub(super) fn bag(command: Bag) -> Result<u8, Failure> {
    match command {
        Bag::Info { file, format } => {
            let info = Info::read(&file)?;
            show(format, &document(&info), |_| table(&info))
        }
        Bag::List {
            file,
            selected,
            count,
            format,
        } => {
            let selection = selected.into_selection(&file)?;
            list(&file, selection, count, format)
        }
        Bag::Cut {
            file,
            selected,
            output,
        } => {
            let selection = selected.into_selection(&file)?;
            let (count, faults) = bag::cut(&file, selection, &output)?;
            let code = note_faults(&faults);
            let count = counted(count, "message");
            print_line(format_args!("{}: {count}", output.display()));
            Ok(code)
        }
        Bag::Export {
            file,
            selected,
            out,
            meaning,
            ..
        } => {
            let meaning = meaning.converter()?;
            let selection = selected.into_selection(&file)?;
            if let Some(folder) = &out {
                std::fs::create_dir_all(folder).map_err(|e| system(&e))?;
            }
            let out = out.as_deref();
            let tables = csv(
                &file,
                selection,
                meaning.as_ref(),
                out,
                &mut print::output(),
            )?;
            let mut code = note_faults(&tables.faults);
            if tables.refused > 0 {
                let refused = counted(tables.refused, "message");
                print_note(&format_args!(
                    "{refused} left out: a value has no counterpart in the prototype"
                ));
                code = 1;
            }
            for (topic, column) in tables.incomplete {
                let (topic, column) = (clean(&topic), clean(&column));
                print_note(&format_args!(
                    "the table of {topic} has no room for {column}"
                ));
            }
            for file in tables.files {
                print_line(format_args!("{}", file.display()));
            }
            Ok(code)
        }
    }
}

fn list(
    file: &Path,
    selection: Selection,
    count: Option<u64>,
    format: Format,
) -> Result<u8, Failure> {
    let mut decoder = Decoder::default();
    let mut left = count.unwrap_or(u64::MAX);
    let out = &mut print::output();
    let faults = bag::each(file, selection, &mut |message, after| {
        if left == 0 {
            return Ok(false);
        }
        left -= 1;
        let topic = &message.channel.topic;
        let document = bag::document(&message);
        let is_document = document.is_some();
        let value = document.map_or_else(
            || {
                let value = decoder.value(&message);
                value.map(|value| serde_json::to_value(&value).unwrap_or_default())
            },
            Ok,
        );
        let text = match (format, value) {
            (Format::Json, value) => {
                let mut line = json!({
                    "topic": topic,
                    "log_time": bag::seconds(message.log_time),
                    "publish_time": bag::seconds(message.publish_time),
                });
                match value {
                    Ok(value) => line["value"] = value,
                    Err(error) => line["error"] = Json::from(error.to_string()),
                }
                visible(line.to_string()) + "\n"
            }
            (Format::Human, Ok(value)) if is_document => {
                let value = escape_to(&value.to_string(), usize::MAX);
                format!("{}\n{value}\n", headline(&message, after))
            }
            (Format::Human, Ok(_)) => {
                let text = decoder.value(&message)?.text(&Style::default());
                format!("{}\n{text}", headline(&message, after))
            }
            (Format::Human, Err(error)) => {
                let (headline, bytes) = (headline(&message, after), message.data.len());
                format!("{headline}\n{bytes} bytes: {error}\n")
            }
        };
        Ok(out.write_all(text.as_bytes()).is_ok())
    })?;
    Ok(note_faults(&faults))
}

/// The first line of a message: its date, its time since the beginning as `--from` takes it, and
/// its topic.
fn headline(message: &Message, after: Duration) -> String {
    let (date, topic) = (date(message.log_time), &message.channel.topic);
    let (seconds, nanoseconds) = (after.as_secs(), after.subsec_nanos());
    format!("{date} +{seconds}.{nanoseconds:09}s {topic}")
}

/// The document of `bag info --format json`.
fn document(info: &Info) -> Json {
    let topics = info.topics.iter().map(|(name, topic)| {
        let channel = &topic.channel;
        json!({
            "topic": name,
            "type": channel.type_name,
            "encoding": channel.encoding,
            "schema": channel.schema_encoding,
            "kind": channel.get(keys::KIND),
            "hash": channel.get(keys::HASH),
            "middleware": channel.get(keys::MIDDLEWARE),
            "exact": channel.get(keys::EXACT),
            "senders": topic.channels,
            "messages": topic.count,
            "bytes": topic.bytes,
            "rate_hz": topic.rate(),
        })
    });
    let attachments = info.attachments.iter();
    let attachments = attachments.map(|(name, size)| json!({ "name": name, "bytes": size }));
    json!({
        "begin": info.times.map(|(first, _)| bag::seconds(first)),
        "end": info.times.map(|(_, last)| bag::seconds(last)),
        "messages": info.messages(),
        "topics": topics.collect::<Vec<_>>(),
        "attachments": attachments.collect::<Vec<_>>(),
        "metadata": info.metadata,
        "duration_s": info.times.map(|(first, last)| {
            Duration::from_nanos(last.saturating_sub(first)).as_secs_f64()
        }),
        "files": info.files.iter().map(|(file, size)| {
            json!({ "file": file.to_string_lossy(), "bytes": size })
        }).collect::<Vec<_>>(),
        "cut": info.faults.cut,
        "damaged": info.faults.damaged,
        "damage": info.faults.damage,
        "messages_without_channel": info.faults.without_channel,
    })
}

fn table(info: &Info) -> String {
    let mut text = String::new();
    if let Some((first, last)) = info.times {
        let length = Duration::from_nanos(last.saturating_sub(first));
        text += &format!("begin        {}\n", date(first));
        text += &format!("end          {}\n", date(last));
        text += &format!("length       {}\n", length_text(length));
    }
    let size: u64 = info.files.iter().map(|(_, size)| size).sum();
    text += &format!("size         {}", size_text(size));
    match info.files.len() {
        1 => text.push('\n'),
        count => text += &format!(" in {count} files\n"),
    }
    text += &format!("messages     {}\n", info.messages());
    if !info.faults.is_none() {
        text += &format!("incomplete   {}\n", info.faults);
    }
    for (name, size) in &info.attachments {
        text += &format!("attachment   {name} ({})\n", size_text(*size as u64));
    }
    for (name, entries) in &info.metadata {
        for (key, value) in entries {
            text += &format!("{name:<12} {}: {}\n", clean(key), clean(value));
        }
    }
    let width = info.topics.keys().map(|name| name.chars().count());
    let width = width.max().unwrap_or(0);
    for (name, topic) in &info.topics {
        let ty = match topic.channel.type_name.as_str() {
            "" => &topic.channel.encoding,
            ty => ty,
        };
        let rate = topic
            .rate()
            .map_or(String::new(), |rate| format!("{rate:.1} Hz"));
        let (count, size) = (topic.count, size_text(topic.bytes));
        text += &format!("{name:<width$}  {count:>8}  {rate:>10}  {size:>9}  {ty}\n");
    }
    text
}

/// A time of a recording as people read it.
fn date(nanoseconds: u64) -> String {
    let time = SystemTime::UNIX_EPOCH.checked_add(Duration::from_nanos(nanoseconds));
    let text = time_text(time.unwrap_or(SystemTime::UNIX_EPOCH));
    text.replacen('T', " ", 1).replace('Z', " UTC")
}

/// A number of bytes as people read it.
fn size_text(bytes: u64) -> String {
    let units = [(1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    match units.iter().find(|(size, _)| bytes >= *size) {
        Some((size, unit)) => format!("{:.1} {unit}", bytes as f64 / *size as f64),
        None => format!("{bytes} B"),
    }
}
