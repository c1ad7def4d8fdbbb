//! Messages of a recording as tables in CSV.

use crate::bag::{Decoder, Selection, each, seconds};
use crate::error::RecordError;
use crate::meaning::Converter;
use crate::reader::{Faults, Message};
use rc_diagnostics::foreign::without_number;
use rc_values::{Columns, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The tables that were written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tables {
    /// The files, one for each topic.
    pub files: Vec<PathBuf>,
    /// Messages with values that have no counterpart in the wanted prototype.
    pub refused: u64,
    /// Topics with a column that their table lacks, because it has too many.
    pub incomplete: Vec<(String, String)>,
    /// Why less was read than was recorded.
    pub faults: Faults,
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
/// to `out` if there is one topic. Reads the recording twice: a table has the columns that any of
/// its messages needs. `meaning` converts all values.
pub fn csv(
    path: &Path,
    selection: Selection,
    meaning: Option<&Converter>,
    folder: Option<&Path>,
    out: &mut dyn Write,
) -> Result<Tables, RecordError> {
    let mut first = None;
    let mut decoder = Decoder::default();
    let mut tables: BTreeMap<String, Table> = BTreeMap::new();
    each(path, selection.clone(), &mut |message, _| {
        if !is_row(&message) {
            return Ok(true);
        }
        let topic = &message.channel.topic;
        if folder.is_none() {
            // Nothing is printed for a selection of several topics.
            only(&mut first, topic)?;
        }
        let Some(value) = row(&mut decoder, meaning, &message)? else {
            return Ok(true);
        };
        let new = || Table {
            file: None,
            columns: Columns::new("log_time_s,publish_time_s"),
        };
        if !tables.contains_key(topic) {
            tables.insert(topic.clone(), new());
        }
        if let Some(table) = tables.get_mut(topic) {
            table.columns.add(&value);
        }
        Ok(true)
    })?;
    let mut names: BTreeSet<String> = BTreeSet::new();
    for (topic, table) in &mut tables {
        let header = table.columns.header();
        let Some(folder) = folder else {
            write(out, &header)?;
            continue;
        };
        let path = folder.join(file_name(topic, &mut names));
        let file = File::create(&path).map_err(|e| RecordError::file(&path, &e))?;
        let mut file = BufWriter::new(file);
        write(&mut file, &header)?;
        table.file = Some((path, file));
    }
    let mut incomplete = Vec::new();
    let mut refused = 0;
    let faults = each(path, selection, &mut |message, _| {
        let topic = &message.channel.topic;
        // The file of a recording that runs may have grown.
        let Some(table) = tables.get_mut(topic).filter(|_| is_row(&message)) else {
            return Ok(true);
        };
        let Some(value) = row(&mut decoder, meaning, &message)? else {
            refused += 1;
            return Ok(true);
        };
        if let Some(column) = table.columns.missing(&value) {
            incomplete.push((topic.clone(), column));
        }
        let times = [message.log_time, message.publish_time].map(seconds);
        let row = table.columns.row(&times.join(","), &value);
        match &mut table.file {
            Some((_, file)) => write(file, &row)?,
            None => write(out, &row)?,
        }
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
        refused,
        incomplete,
        faults,
    })
}

/// The value of a message. `None` if it has no counterpart in the wanted prototype.
fn row(
    decoder: &mut Decoder,
    meaning: Option<&Converter>,
    message: &Message,
) -> Result<Option<[(String, Value); 1]>, RecordError> {
    let value = decoder.value(message)?;
    let Some(meaning) = meaning else {
        return Ok(Some([(String::new(), value)]));
    };
    let ty = decoder.ty(&message.channel)?;
    if !meaning.converts(&ty) {
        return Err(meaning.no_conversion_error(&ty));
    }
    Ok(meaning
        .value(value)
        .ok()
        .map(|value| [(String::new(), value)]))
}

fn write(out: &mut dyn Write, text: &str) -> Result<(), RecordError> {
    let written = out.write_all(text.as_bytes());
    written.map_err(|e| RecordError::Table(without_number(&e.to_string()).into_owned()))
}

/// The file of a topic: its name without characters that file systems refuse, and a number if
/// another topic has the same one.
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
