//! Values of streams as bytes.

use super::steps::{put_value, read_value};
use crate::streams::Sample;
use property_graph::Id;
use rc_middleware::{DecodeError, Reader, Writer, cdr};

/// A value has more bytes than this.
const LEAST_SAMPLE: usize = 48;

/// Writes values.
pub(super) fn put_samples(writer: &mut Writer<'_>, samples: &[Sample]) {
    writer.length(samples.len());
    for sample in samples {
        writer.put(&sample.of.writer());
        writer.put(&sample.of.count());
        cdr::text(&sample.name, writer);
        writer.put(&sample.count);
        writer.put(&sample.writer);
        put_value(writer, Some(&sample.value));
    }
}

/// Reads values, but for those that are none.
pub(super) fn samples(reader: &mut Reader<'_>) -> Result<Vec<Sample>, DecodeError> {
    let count = reader.length()?;
    // A false count allocates no memory.
    let mut samples = Vec::with_capacity(count.min(reader.rest().len() / LEAST_SAMPLE));
    for _ in 0..count {
        let of = Id::new(reader.get()?, reader.get()?);
        let name = reader.text()?.to_owned();
        let (count, writer) = (reader.get()?, reader.get()?);
        if let Some(value) = read_value(reader)? {
            samples.push(Sample {
                of,
                name,
                count,
                writer,
                value,
            });
        }
    }
    Ok(samples)
}
