//! Sends samples to a topic.

use crate::backends::{Backends, sending};
use crate::error::Error;
use crate::network::{End, Network, Topic, connect, failed};
use crate::reach::{is_inside_process, shares_memory};
use rc_management::Client;
use rc_management::component::{Done, Request};
use rc_middleware::{Header, Publisher, now};
use rc_values::{Value, encode_body};
use std::time::{Duration, Instant};

/// How long a component on another machine may take to handle a sample.
const LIMIT: Duration = Duration::from_secs(5);
/// How long a sender waits for the first subscriber.
const MATCHING: Duration = Duration::from_secs(2);
/// How long the last samples may take to arrive.
const LINGER: Duration = Duration::from_secs(1);

/// Whether a subscriber gets samples by its management: inside its process, on another middleware
/// than the sender, or in the shared memory of another machine.
fn is_apart(middleware: &str, end: &End) -> bool {
    let is_elsewhere = !end.meets_over(middleware);
    end.is_inside() || is_elsewhere || shares_memory(middleware) && end.host.is_some()
}

/// Sends samples to a topic.
pub struct Sender {
    port: Option<Box<dyn Publisher>>,
    /// Subscribers inside their processes, or in the shared memory of other machines.
    others: Vec<(String, String, Client)>,
    topic: Topic,
    sent: u64,
    /// Dropped after the port.
    backends: Backends,
}

impl Sender {
    /// Whether sending waits for a subscriber: each one inside its process, or in the shared memory of
    /// another machine, confirms each sample.
    pub fn confirms(topic: &Topic) -> bool {
        topic
            .subscribers
            .iter()
            .any(|end| is_apart(&topic.middleware, end))
    }

    /// Opens the topic for sending, and waits for the first subscriber.
    pub fn open(network: &Network, topic: &Topic) -> Result<Self, Error> {
        let mut backends = Backends::new(&network.name)?;
        let (there, here): (Vec<_>, Vec<_>) = topic
            .subscribers
            .iter()
            .partition(|end| is_apart(&topic.middleware, end));
        let mut others = Vec::new();
        for end in there {
            let client = connect(&network.name, &end.component, LIMIT)?;
            others.push((end.component.clone(), end.slot.clone(), client));
        }
        let is_bound = shares_memory(&topic.middleware) || is_inside_process(&topic.middleware);
        let port = if here.is_empty() && is_bound {
            if others.is_empty() {
                return Err(Error::Component {
                    component: topic.address.clone(),
                    reason: "no component subscribes to it".to_owned(),
                });
            }
            None
        } else {
            let endpoint = sending(topic)?;
            let port = backends.of(topic)?.publisher(&endpoint)?;
            let end = Instant::now() + MATCHING;
            while port.peers() == 0 && Instant::now() < end {
                std::thread::sleep(Duration::from_millis(5));
            }
            Some(port)
        };
        Ok(Self {
            port,
            others,
            topic: topic.clone(),
            sent: 0,
            backends,
        })
    }

    /// The number of subscribers that the samples reach.
    pub fn subscribers(&self) -> usize {
        self.others.len() + self.port.as_ref().map_or(0, |port| port.peers())
    }

    /// Sends a sample.
    pub fn send(&mut self, value: &Value) -> Result<(), Error> {
        self.send_body(&encode_body(value)?)
    }

    /// Sends a sample whose body was encoded before.
    pub fn send_body(&mut self, body: &[u8]) -> Result<(), Error> {
        self.sent += 1;
        if let Some(port) = &mut self.port {
            let header = Header {
                type_hash: self.topic.operation.hash,
                sequence: self.sent,
                sent: now(),
                ..Header::default()
            };
            let sent = port.publish(header, body);
            sent.map_err(|error| Error::system("send", &error))?;
        }
        for (component, slot, client) in &mut self.others {
            let request = Request::Sample {
                slot: slot.clone(),
                operation: self.topic.operation.name.clone(),
                body: body.to_vec(),
            };
            let sent = client.call(&request, LIMIT);
            let Done {} = sent.map_err(|error| failed(component, &error))?;
        }
        Ok(())
    }

    /// Waits until the last samples have arrived.
    pub fn finish(self) {
        self.backends.linger(LINGER);
    }
}

#[cfg(test)]
mod tests {
    use super::is_apart;
    use crate::network::End;

    #[test]
    fn subscribers_on_other_middlewares_get_samples_by_their_management() {
        for (host, middlewares, apart) in [
            (None, &["iceoryx2"][..], false),
            (None, &["iceoryx2", "dds"], false),
            (None, &["dds"], true),
            (None, &["local"], true),
            (Some("arm"), &["iceoryx2"], true),
            // The topics of time name none.
            (None, &[], false),
        ] {
            let end = End {
                component: "a".to_owned(),
                slot: "s".to_owned(),
                host: host.map(str::to_owned),
                middlewares: middlewares.iter().map(|word| (*word).to_owned()).collect(),
            };
            assert_eq!(is_apart("iceoryx2", &end), apart, "{end:?}");
        }
    }
}
