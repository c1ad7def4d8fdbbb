//! `rcdeploy world at`: the world of a recording, as it was at a time.

use super::replica::topic_of;
use crate::cli::output::{Failure, print_note, system};
use rc_diagnostics::SourceMap;
use rc_diagnostics::foreign::clean;
use rc_middleware::Reader;
use rc_record::bag::{self, Selection};
use rc_record::{Channel, RecordError, definition, keys, reader};
use rc_world::property_graph::{Snapshot, Time};
use rc_world::{Message, Overheard, Setup, Topic, World};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// The topic of a world on which a channel has messages.
fn topic(channel: &Channel) -> Option<Topic> {
    topic_of(channel.get(keys::INTERFACE)?, channel.get(keys::OPERATION)?)
}

/// The world of a recording at a time after its beginning.
pub(super) fn world(
    after: Duration,
    file: &Path,
    schema_file: &Path,
) -> Result<Arc<Snapshot>, Failure> {
    let time = Arc::new(AtomicU64::new(0));
    let clock = Arc::clone(&time);
    let schema = graph_language::open(&mut SourceMap::new(), schema_file, rc_files::read);
    let unusable = |error| {
        let file = schema_file.display();
        Failure(1, format!("the schema {file} is not usable:\n{error}"))
    };
    let schema = schema.map_err(unusable)?;
    let setup = Setup::new("rcdeploy", Arc::new(schema))
        .without_tidying()
        .with_clock(move || Time::from_nanos(clock.load(Ordering::Relaxed)));
    let world = World::new(setup);
    let selection = Selection {
        topics: Vec::new(),
        from: None,
        to: Some(after),
    };
    let (mut count, mut now) = (0_u64, Duration::ZERO);
    let mut answers = Overheard::default();
    let faults = bag::each(file, selection, &mut |message, at| {
        let Some(topic) = topic(&message.channel) else {
            return Ok(true);
        };
        let body = definition::body(&message.data).map_err(RecordError::Value)?;
        let read = Message::decode(topic, &mut Reader::new(body));
        let read = read.map_err(|error| RecordError::Value(error.to_string()))?;
        count += 1;
        now = at;
        // Times of changes count, which are those of the network.
        time.store(u64::MAX / 2, Ordering::Relaxed);
        answers.take(&world, &read);
        world.receive(at, read);
        world.turn(at);
        while world.take().is_some() {}
        Ok(true)
    })?;
    if !faults.is_none() {
        print_note(&format_args!("the recording is incomplete: {faults}"));
    }
    if count == 0 {
        let message = format!(
            "{} has no messages of a world until then: record its network with `rcdeploy record` without names of topics, or name \
             those of the world too: `rcdeploy plan` shows them",
            file.display()
        );
        return Err(Failure(1, message));
    }
    let status = world.status(now);
    if status.changes == 0 && status.counts.refused > 0 {
        let reason = clean(&status.counts.last_refusal);
        return Err(system(&format_args!(
            "no message fits the schema {}: {reason}",
            schema_file.display()
        )));
    }
    if status.is_behind {
        let message = format!(
            "{} lacks changes until then: it has the world from some seconds after its begin on, if `rcdeploy record` \
             has recorded all topics. A ring keeps the last messages alone, so it has no world from before: record without `--ring`",
            file.display()
        );
        return Err(Failure(1, message));
    }
    if let Some(length) = length(file)?.filter(|length| *length < after) {
        let length = length.as_secs_f64();
        print_note(&format_args!(
            "the recording ends after {length:.3} s: this is the world at its end"
        ));
    }
    Ok(world.snapshot())
}

/// The length of a recording, if its summaries say so.
fn length(file: &Path) -> Result<Option<Duration>, Failure> {
    let times = reader::Reader::open(file)?.times();
    let length = times.first.zip(times.last);
    Ok(length.map(|(first, last)| Duration::from_nanos(last.saturating_sub(first))))
}
