//! Writes records.

use crate::{Stamp, op};

/// Appends a record: `content` appends its body.
pub fn record(out: &mut Vec<u8>, code: u8, content: impl FnOnce(&mut Vec<u8>)) {
    out.push(code);
    let at = out.len();
    out.extend([0; 8]);
    content(out);
    let length = (out.len() - at - 8) as u64;
    out[at..at + 8].copy_from_slice(&length.to_le_bytes());
}

/// Appends data after its length.
pub fn counted(out: &mut Vec<u8>, content: impl FnOnce(&mut Vec<u8>)) {
    let at = out.len();
    out.extend([0; 4]);
    content(out);
    let length = (out.len() - at - 4) as u32;
    out[at..at + 4].copy_from_slice(&length.to_le_bytes());
}

/// Appends a text.
pub fn text(out: &mut Vec<u8>, text: &str) {
    counted(out, |out| out.extend(text.as_bytes()));
}

/// Appends numbers.
pub fn numbers(out: &mut Vec<u8>, numbers: &[u64]) {
    numbers.iter().for_each(|n| out.extend(n.to_le_bytes()));
}

fn table<'t>(out: &mut Vec<u8>, table: impl IntoIterator<Item = (&'t str, &'t str)>) {
    counted(out, |out| {
        for (key, value) in table {
            text(out, key);
            text(out, value);
        }
    });
}

/// The first record.
pub fn header(out: &mut Vec<u8>, profile: &str, library: &str) {
    record(out, op::HEADER, |out| {
        text(out, profile);
        text(out, library);
    });
}

/// A definition of a type. `id` is not 0.
pub fn schema(out: &mut Vec<u8>, id: u16, name: &str, encoding: &str, data: &[u8]) {
    record(out, op::SCHEMA, |out| {
        out.extend(id.to_le_bytes());
        text(out, name);
        text(out, encoding);
        counted(out, |out| out.extend(data));
    });
}

/// A channel; `schema` is 0 for none.
pub fn channel<'t>(
    out: &mut Vec<u8>,
    id: u16,
    schema: u16,
    topic: &str,
    encoding: &str,
    metadata: impl IntoIterator<Item = (&'t str, &'t str)>,
) {
    record(out, op::CHANNEL, |out| {
        out.extend(id.to_le_bytes());
        out.extend(schema.to_le_bytes());
        text(out, topic);
        text(out, encoding);
        table(out, metadata);
    });
}

/// A message in parts, which follow each other.
pub fn message(out: &mut Vec<u8>, channel: u16, stamp: Stamp, parts: &[&[u8]]) {
    record(out, op::MESSAGE, |out| {
        out.extend(channel.to_le_bytes());
        out.extend(stamp.sequence.to_le_bytes());
        numbers(out, &[stamp.log_time, stamp.publish_time]);
        parts.iter().for_each(|part| out.extend(*part));
    });
}

/// A table of texts.
pub fn metadata<'t>(
    out: &mut Vec<u8>,
    name: &str,
    entries: impl IntoIterator<Item = (&'t str, &'t str)>,
) {
    record(out, op::METADATA, |out| {
        text(out, name);
        table(out, entries);
    });
}

/// A file inside the file, without checksum.
pub fn attachment(
    out: &mut Vec<u8>,
    log_time: u64,
    create_time: u64,
    name: &str,
    media_type: &str,
    data: &[u8],
) {
    record(out, op::ATTACHMENT, |out| {
        numbers(out, &[log_time, create_time]);
        text(out, name);
        text(out, media_type);
        numbers(out, &[data.len() as u64]);
        out.extend(data);
        out.extend([0; 4]);
    });
}

/// The end of the data, without checksum.
pub fn data_end(out: &mut Vec<u8>) {
    record(out, op::DATA_END, |out| out.extend([0; 4]));
}

/// The last record and the last bytes. `summary` is where the summary begins, 0 for none.
pub fn end(out: &mut Vec<u8>, summary: u64) {
    record(out, op::FOOTER, |out| {
        numbers(out, &[summary, 0]);
        out.extend([0; 4]);
    });
    out.extend(crate::MAGIC);
}
