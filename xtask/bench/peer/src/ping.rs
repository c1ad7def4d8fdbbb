//! The publisher and client.

use crate::services::{Failure, Ipc, Stamp, Topic, calls, event_service, node, topic, wait};
use bench_protocol::{Kind, LARGEST, keep_pace, next_command, now, pause, ready, report};
use iceoryx2::port::client::Client;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;

/// Upper limit of waits for one reply.
const WAITS: usize = 100;

struct Ping {
    publisher: Publisher<Ipc, [u8], Stamp>,
    pictures: Publisher<Ipc, [u8], Stamp>,
    watcher: Notifier<Ipc>,
    client: Client<Ipc, [u8], (), [u8], ()>,
    subscriber: Notifier<Ipc>,
    server: Notifier<Ipc>,
    answered: Listener<Ipc>,
}

/// Executes commands until the standard input ends.
pub(crate) fn run(root: &str, prefix: &str) -> Result<(), Failure> {
    let node = node(root, prefix)?;
    let (samples, pictures) = (topic(&node, "sample")?, topic(&node, "picture")?);
    let calls = calls(&node, "echo")?;
    let (sampled, asked, answered) = (
        event_service(&node, "sample")?,
        event_service(&node, "asked")?,
        event_service(&node, "answered")?,
    );
    let publisher = |topic: &Topic| {
        topic
            .publisher_builder()
            .initial_max_slice_len(LARGEST)
            .max_loaned_samples(1)
            .create()
    };
    let ping = Ping {
        publisher: publisher(&samples)?,
        pictures: publisher(&pictures)?,
        watcher: event_service(&node, "picture")?
            .notifier_builder()
            .create()?,
        client: calls
            .client_builder()
            .initial_max_slice_len(LARGEST)
            .create()?,
        subscriber: sampled.notifier_builder().create()?,
        server: asked.notifier_builder().create()?,
        answered: answered.listener_builder().create()?,
    };
    let data = vec![7; LARGEST];
    let mut times = Vec::new();
    let mut answer = Vec::new();
    ready()?;
    while let Some(command) = next_command()? {
        times.clear();
        let data = &data[..command.size];
        let begin = now();
        for number in 0..command.count {
            match command.kind {
                Kind::Publish => {
                    pause(command.size);
                    ping.publish(now(), data)?;
                }
                Kind::InPlace => {
                    pause(command.size);
                    ping.picture(now(), data)?;
                }
                Kind::Lent | Kind::Cloud => {
                    return Err("no hand-written program has this".into());
                }
                Kind::Flood => ping.publish(now(), data)?,
                Kind::Steady => {
                    keep_pace(begin, number);
                    ping.publish(now(), data)?;
                }
                Kind::Query | Kind::Rested | Kind::Awake => {
                    if command.kind == Kind::Rested {
                        pause(command.size);
                    }
                    let start = now();
                    ping.query(data, &mut answer)?;
                    times.push(now() - start);
                    if answer.len() != data.len() {
                        return Err("another echo".into());
                    }
                }
            }
        }
        if command.kind == Kind::Flood {
            times.push(now() - begin);
        }
        if !command.kind.is_query() {
            pause(command.size);
            ping.publish(0, &[])?;
        }
        report(&times)?;
    }
    Ok(())
}

impl Ping {
    fn publish(&self, sent: Stamp, data: &[u8]) -> Result<(), Failure> {
        let mut loan = self.publisher.loan_slice_uninit(data.len())?;
        *loan.user_header_mut() = sent;
        loan.write_from_slice(data).send()?;
        self.subscriber.notify()?;
        Ok(())
    }

    /// Writes the data once, where the subscriber reads them.
    fn picture(&self, sent: Stamp, data: &[u8]) -> Result<(), Failure> {
        let mut loan = self.pictures.loan_slice_uninit(data.len())?;
        *loan.user_header_mut() = sent;
        loan.write_from_slice(data).send()?;
        self.watcher.notify()?;
        Ok(())
    }

    fn query(&self, data: &[u8], answer: &mut Vec<u8>) -> Result<(), Failure> {
        let loan = self.client.loan_slice_uninit(data.len())?;
        let pending = loan.write_from_slice(data).send()?;
        self.server.notify()?;
        for _ in 0..WAITS {
            wait([&self.answered])?;
            if let Some(response) = pending.receive()? {
                answer.clear();
                answer.extend_from_slice(response.payload());
                return Ok(());
            }
        }
        Err("no answer".into())
    }
}
