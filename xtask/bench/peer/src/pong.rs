//! The subscriber and server.

use crate::services::{Failure, calls, event_service, node, topic, wait};
use bench_protocol::{LARGEST, now, ready, report};

/// Replies, and records times, until a signal ends the process.
pub(crate) fn run(root: &str, prefix: &str) -> Result<(), Failure> {
    let node = node(root, prefix)?;
    let (samples, pictures) = (topic(&node, "sample")?, topic(&node, "picture")?);
    let calls = calls(&node, "echo")?;
    let (sampled, asked, answered) = (
        event_service(&node, "sample")?,
        event_service(&node, "asked")?,
        event_service(&node, "answered")?,
    );
    let sampled = sampled.listener_builder().create()?;
    let pictured = event_service(&node, "picture")?
        .listener_builder()
        .create()?;
    let asked = asked.listener_builder().create()?;
    let client = answered.notifier_builder().create()?;
    let subscriber = samples.subscriber_builder().buffer_size(10).create()?;
    let watcher = pictures.subscriber_builder().buffer_size(10).create()?;
    let server = calls
        .server_builder()
        .initial_max_slice_len(LARGEST)
        .create()?;
    let mut times = Vec::new();
    let mut data = Vec::new();
    ready()?;
    loop {
        wait([&sampled, &pictured, &asked])?;
        while let Some(picture) = watcher.receive()? {
            // The sample is read in place.
            std::hint::black_box(picture.payload());
            times.push(now() - *picture.user_header());
        }
        while let Some(sample) = subscriber.receive()? {
            data.clear();
            data.extend_from_slice(sample.payload());
            if data.is_empty() {
                report(&times)?;
                times.clear();
            } else {
                times.push(now() - *sample.user_header());
            }
        }
        while let Some(request) = server.receive()? {
            data.clear();
            data.extend_from_slice(request.payload());
            let loan = request.loan_slice_uninit(data.len())?;
            loan.write_from_slice(&data).send()?;
            client.notify()?;
        }
    }
}
