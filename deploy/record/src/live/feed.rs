//! From a message of the network to a message of the recording.

use super::output::{ChannelKey, Output};
use crate::content::NewChannel;
use crate::{envelope, keys, qos, schema};
use rc_middleware::Qos;
use rc_observe::{End, MessageKind, Observed, SendingClock, Service, TimeTopic, Topic};
use rc_values::{Interface, Operation};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// How many senders of a feed are remembered.
const SENDERS: usize = 256;

/// A feed of the observer, and what becomes of its messages.
pub(super) struct Feed {
    what: FeedSource,
    /// The channels of the messages: by the sender, or by operation, kind and client.
    channels: BTreeMap<(i32, bool, u128), usize>,
}

/// Source of a feed.
pub(super) enum FeedSource {
    Topic(Box<Topic>),
    Calls(Calls),
    /// The time of the network, which is in the stamps of other messages.
    Time(Box<TimeTopic>),
}

/// The calls of a tapped slot.
pub(super) struct Calls {
    /// The end that copies them.
    end: End,
    address: String,
    middleware: String,
    interface: Arc<Interface>,
    /// The operations that are recorded; none for all.
    only: Option<BTreeSet<String>>,
}

impl FeedSource {
    pub(super) fn topic(topic: Topic) -> Self {
        Self::Topic(Box::new(topic))
    }

    pub(super) fn calls(end: &End, service: &Service, only: Option<BTreeSet<String>>) -> Self {
        Self::Calls(Calls {
            end: end.clone(),
            address: service.address.clone(),
            middleware: service.middleware.clone(),
            interface: Arc::clone(&service.interface),
            only,
        })
    }
}

impl Feed {
    pub(super) fn new(what: FeedSource) -> Self {
        Self {
            what,
            channels: BTreeMap::new(),
        }
    }

    /// The address of its messages.
    pub(super) fn address(&self) -> &str {
        match &self.what {
            FeedSource::Topic(topic) => &topic.address,
            FeedSource::Calls(calls) => &calls.address,
            FeedSource::Time(time) => &time.topic().address,
        }
    }

    /// Puts a message into the recording.
    pub(super) fn take(&mut self, observed: &Observed<'_>, output: &mut Output) {
        if self.channels.len() > SENDERS {
            // They are found again; the later ones of a topic share a channel.
            self.channels.clear();
        }
        let recorded = match &self.what {
            FeedSource::Time(time) => {
                if let Some(time) = time.read(observed) {
                    output.simulated = Some(time);
                }
                return;
            }
            FeedSource::Topic(topic) => {
                output.note_loss(&topic.address, observed.lost);
                sample(topic, &mut self.channels, observed, output)
            }
            FeedSource::Calls(calls) => {
                output.note_loss(&calls.address, observed.lost);
                call(calls, &mut self.channels, observed, output)
            }
        };
        if recorded.is_none() {
            output.progress.unread += 1;
        }
    }
}

type Channels = BTreeMap<(i32, bool, u128), usize>;

/// Records a sample. `None` if the description does not fit it.
fn sample(
    topic: &Topic,
    channels: &mut Channels,
    observed: &Observed<'_>,
    output: &mut Output,
) -> Option<()> {
    let header = &observed.header;
    let data = envelope::sample(topic, observed)?;
    let at = *channels
        .entry((0, false, header.sender))
        .or_insert_with(|| {
            let name = format!("/{}", topic.address);
            let key = ChannelKey::new(&name, topic.operation.hash, header.sender);
            output.channel(key, |sender| {
                let mut metadata = metadata(
                    &topic.address,
                    &topic.middleware,
                    &topic.interface,
                    &topic.operation,
                    "sample",
                );
                let profile = qos::profile(&topic.description.qos);
                metadata.insert(keys::QOS.to_owned(), profile);
                let publishers: Vec<String> = topic.publishers.iter().map(End::to_string).collect();
                metadata.insert(keys::ENDS.to_owned(), publishers.join(", "));
                metadata.extend(sender.map(|sender| (keys::SENDER.to_owned(), sender)));
                let external = topic.description.external_type.as_deref();
                NewChannel {
                    topic: name,
                    encoding: "cdr",
                    schema: Some(schema::sample(
                        &topic.interface.name,
                        &topic.operation,
                        external,
                    )),
                    metadata,
                }
            })
        });
    let is_here = topic.sending_clock() == SendingClock::Here;
    let stamp = output.stamp(header.sent, is_here, header.sequence);
    output.put(at, stamp, data, &topic.address);
    Some(())
}

/// Records a request or a reply. `None` if the description does not fit it.
fn call(
    calls: &Calls,
    channels: &mut Channels,
    observed: &Observed<'_>,
    output: &mut Output,
) -> Option<()> {
    let (body, interface) = (observed.body, &calls.interface);
    let is_reply = observed.kind == MessageKind::Reply;
    let opened = match observed.kind {
        MessageKind::Request => envelope::request(interface, observed.profile, body)?,
        MessageKind::Reply => {
            let encoding = observed.header.encoding;
            match envelope::reply(interface, observed.profile, encoding, body)? {
                envelope::Reply::Opened(opened) => opened,
                envelope::Reply::Refused(reason) => {
                    output.refused(&calls.address, &reason);
                    return Some(());
                }
            }
        }
        MessageKind::Sample => return None,
    };
    let operation = opened.operation;
    if calls
        .only
        .as_ref()
        .is_some_and(|only| !only.contains(&operation.name))
    {
        return Some(());
    }
    let client = u128::from_be_bytes(opened.id.writer);
    let at = *channels
        .entry((operation.id, is_reply, client))
        .or_insert_with(|| {
            let kind = if is_reply { "reply" } else { "request" };
            let name = format!("/{}/{}/_{kind}", calls.address, operation.name);
            let key = ChannelKey::new(&name, operation.hash, client);
            output.channel(key, |client| {
                let schema = if is_reply {
                    schema::reply(&interface.name, operation)
                } else {
                    schema::request(&interface.name, operation)
                };
                let mut metadata = metadata(
                    &calls.address,
                    &calls.middleware,
                    interface,
                    operation,
                    kind,
                );
                metadata.insert(keys::QOS.to_owned(), qos::profile(&Qos::CALL));
                metadata.insert(keys::ENDS.to_owned(), calls.end.to_string());
                metadata.extend(client.map(|client| (keys::SENDER.to_owned(), client)));
                NewChannel {
                    topic: name,
                    encoding: "cdr",
                    schema: Some(schema),
                    metadata,
                }
            })
        });
    let is_here = calls.end.host.is_none();
    let stamp = output.stamp(observed.header.sent, is_here, opened.id.sequence);
    output.put(at, stamp, opened.data, &calls.address);
    Some(())
}

fn metadata(
    address: &str,
    middleware: &str,
    interface: &Interface,
    operation: &Operation,
    kind: &str,
) -> BTreeMap<String, String> {
    let entries = [
        (keys::ADDRESS, address.to_owned()),
        (keys::MIDDLEWARE, middleware.to_owned()),
        (keys::INTERFACE, interface.name.clone()),
        (keys::OPERATION, operation.name.clone()),
        (keys::HASH, format!("{:016x}", operation.hash)),
        (keys::KIND, kind.to_owned()),
    ];
    entries.map(|(key, value)| (key.to_owned(), value)).into()
}
