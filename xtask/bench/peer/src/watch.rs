//! A second subscriber, which prints what it receives.

use crate::services::{Failure, event_service, node, topic, wait};
use std::io::{BufWriter, Write as _};

/// Prints a line of JSON for each value, until a signal ends the process.
pub(crate) fn run(root: &str, prefix: &str) -> Result<(), Failure> {
    let node = node(root, prefix)?;
    let samples = topic(&node, "sample")?;
    let sampled = event_service(&node, "sample")?;
    let sampled = sampled.listener_builder().create()?;
    let subscriber = samples.subscriber_builder().buffer_size(10).create()?;
    let mut out = BufWriter::new(std::io::stdout().lock());
    loop {
        wait([&sampled])?;
        while let Some(sample) = subscriber.receive()? {
            write!(out, "{{\"sent\":{},\"data\":[", sample.user_header())?;
            for (at, byte) in sample.payload().iter().enumerate() {
                let comma = if at == 0 { "" } else { "," };
                write!(out, "{comma}{byte}")?;
            }
            writeln!(out, "]}}")?;
        }
        out.flush()?;
    }
}
