//! The messages of topics and of tapped slots, in one stream.

use crate::backends::{Backends, receiving};
use crate::error::Error;
use crate::network::{End, Network, Topic, connect, failed};
use crate::reach::{is_inside_process, shares_memory};
use rc_management::component::{Done, Request};
use rc_management::observation::{Notification, Tapped, TappedKind};
use rc_management::{Client, Incoming, rpc};
use rc_middleware::backend::Profile;
use rc_middleware::{Encoding, Gaps, Header, Subscriber};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::collections::BTreeMap;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

/// How long a component may take to switch a tap.
const LIMIT: Duration = Duration::from_secs(3);
/// The most messages of one feed that are taken in a turn.
const TURN: usize = 1024;

/// Identifies a feed of an [`Observer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FeedId(pub usize);

/// Kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageKind {
    /// A sample of a topic.
    Sample,
    /// A request, with its envelope.
    Request,
    /// The reply to a request, with its envelope.
    Reply,
}

/// A message as it was sent.
#[derive(Clone, Copy, Debug)]
pub struct Observed<'m> {
    /// Sample, request or reply.
    pub kind: MessageKind,
    /// The operation of a sample that was tapped; none if the feed has one topic, or for calls.
    pub operation: Option<&'m str>,
    /// The header.
    pub header: Header,
    /// Where a body follows its envelope.
    pub profile: Profile,
    /// Messages of this feed that were lost right before this one.
    pub lost: u64,
    /// The message.
    pub body: &'m [u8],
}

/// Receives the messages of several topics and slots.
pub struct Observer {
    network: String,
    feeds: BTreeMap<usize, Feed>,
    /// The number of the next feed.
    next: usize,
    /// Dropped after all ports.
    backends: Backends,
}

struct Feed {
    source: Source,
    gaps: Gaps,
    /// Dropped messages that are not reported yet.
    lost: u64,
    errors: Vec<String>,
    ended: bool,
}

enum Source {
    Port(Box<dyn Subscriber>),
    /// Tapped slots; with an operation, only its samples.
    Taps(Vec<Tap>, Option<String>),
}

/// A slot whose component copies its messages.
struct Tap {
    client: Box<Client>,
    /// Messages that the component has not copied, as far as they were counted.
    dropped: u64,
    ended: bool,
}

impl Source {
    fn descriptors(&self) -> Vec<BorrowedFd<'_>> {
        match self {
            Self::Port(port) => vec![port.descriptor()],
            Self::Taps(taps, _) => {
                let open = taps.iter().filter(|tap| !tap.ended);
                open.map(|tap| tap.client.as_fd()).collect()
            }
        }
    }
}

impl Observer {
    /// Observes nothing yet.
    pub fn new(network: &Network) -> Result<Self, Error> {
        Ok(Self {
            network: network.name.clone(),
            feeds: BTreeMap::new(),
            next: 0,
            backends: Backends::new(&network.name)?,
        })
    }

    /// Observes a topic from now on.
    pub fn open(&mut self, topic: &Topic) -> Result<FeedId, Error> {
        let ends = copied_by(&topic.middleware, &topic.publishers, &topic.subscribers);
        if ends.is_empty() {
            let endpoint = receiving(topic)?;
            let port = self.backends.of(topic)?.subscriber(&endpoint)?;
            return Ok(self.add(Source::Port(port)));
        }
        let taps = ends
            .iter()
            .map(|end| self.tapped(&end.component, &end.slot));
        let (taps, failed): (Vec<_>, Vec<_>) = taps.partition(Result::is_ok);
        let taps: Vec<Tap> = taps.into_iter().flatten().collect();
        // A component that is being restarted does not hide the others.
        if let Some(error) = failed.into_iter().find_map(Result::err)
            && taps.is_empty()
        {
            return Err(error);
        }
        Ok(self.add(Source::Taps(taps, Some(topic.operation.name.clone()))))
    }

    /// Lets a component copy all messages of a slot: requests and replies, or samples.
    pub fn tap(&mut self, component: &str, slot: &str) -> Result<FeedId, Error> {
        let tap = self.tapped(component, slot)?;
        Ok(self.add(Source::Taps(vec![tap], None)))
    }

    fn tapped(&self, component: &str, slot: &str) -> Result<Tap, Error> {
        let mut client = connect(&self.network, component, LIMIT)?;
        let request = Request::Tap {
            slot: slot.to_owned(),
            on: true,
        };
        let tapped = client.call(&request, LIMIT);
        let Done {} = tapped.map_err(|error| failed(component, &error))?;
        Ok(Tap {
            client: Box::new(client),
            dropped: 0,
            ended: false,
        })
    }

    fn add(&mut self, source: Source) -> FeedId {
        let id = self.next;
        self.next += 1;
        let feed = Feed {
            source,
            gaps: Gaps::default(),
            lost: 0,
            errors: Vec::new(),
            ended: false,
        };
        self.feeds.insert(id, feed);
        FeedId(id)
    }

    /// Observes this feed no longer.
    pub fn close(&mut self, feed: FeedId) {
        self.feeds.remove(&feed.0);
    }

    /// Whether the component of a tapped slot has ended.
    pub fn has_ended(&self, feed: FeedId) -> bool {
        let feed = self.feeds.get(&feed.0);
        feed.is_none_or(|feed| feed.ended)
    }

    /// Takes the number of lost messages that no [`Observed::lost`] reports, because no message has
    /// followed them.
    pub fn lost(&mut self, feed: FeedId) -> u64 {
        let feed = self.feeds.get_mut(&feed.0);
        feed.map(|feed| std::mem::take(&mut feed.lost))
            .unwrap_or_default()
    }

    /// Takes the errors of receiving since the last call.
    pub fn errors(&mut self, feed: FeedId) -> Vec<String> {
        let feed = self.feeds.get_mut(&feed.0);
        feed.map(|feed| std::mem::take(&mut feed.errors))
            .unwrap_or_default()
    }

    /// The descriptors that are readable when a message may have arrived.
    pub fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        let feeds = self.feeds.values().filter(|feed| !feed.ended);
        feeds.flat_map(|feed| feed.source.descriptors())
    }

    /// Waits until a message may have arrived, or `others` are readable, at most `limit`.
    pub fn wait(&self, others: &[BorrowedFd<'_>], limit: Duration) {
        let all = self.descriptors().chain(others.iter().copied());
        let mut polled: Vec<PollFd<'_>> = all
            .map(|descriptor| PollFd::from_borrowed_fd(descriptor, PollFlags::IN))
            .collect();
        let limit = Timespec::try_from(limit).ok();
        // An interrupted wait is a short one.
        let _ = poll(&mut polled, limit.as_ref());
    }

    /// Takes the messages of one feed that are there, as [`Observer::take`] does.
    pub fn take_of(&mut self, feed: FeedId, take: &mut dyn FnMut(Observed<'_>)) {
        if let Some(feed) = self.feeds.get_mut(&feed.0) {
            feed.take(take);
        }
    }

    /// Takes the received messages, at most 1024 of each feed. Returns whether there may be more.
    pub fn take(&mut self, take: &mut dyn FnMut(FeedId, Observed<'_>)) -> bool {
        let mut more = false;
        for (id, feed) in &mut self.feeds {
            more |= feed.take(&mut |observed| take(FeedId(*id), observed));
        }
        more
    }
}

/// The ends that have to copy the samples of a topic: those inside a process, or in the shared memory
/// of another machine. All publishers, or a subscriber if there is none; none if the topic is within reach.
fn copied_by<'t>(middleware: &str, publishers: &'t [End], subscribers: &'t [End]) -> Vec<&'t End> {
    // Ends on other middlewares of a fan-out are not in the memory.
    let meets = |end: &&End| end.meets_over(middleware);
    let publishers: Vec<&End> = publishers.iter().filter(meets).collect();
    let subscribers: Vec<&End> = subscribers.iter().filter(meets).collect();
    let is_here = || {
        let mut all = publishers.iter().chain(&subscribers);
        all.any(|end| end.host.is_none())
    };
    if !is_inside_process(middleware) && (!shares_memory(middleware) || is_here()) {
        return Vec::new();
    }
    if publishers.is_empty() {
        return subscribers.into_iter().take(1).collect();
    }
    publishers
}

impl Feed {
    fn take(&mut self, take: &mut dyn FnMut(Observed<'_>)) -> bool {
        match &mut self.source {
            Source::Port(port) => {
                let gaps = &mut self.gaps;
                let mut taken = drain(port.as_mut(), gaps, &mut self.errors, take);
                if taken < TURN {
                    port.acknowledge(true);
                    taken += drain(port.as_mut(), gaps, &mut self.errors, take);
                }
                taken >= TURN
            }
            Source::Taps(taps, operation) => {
                for tap in taps.iter_mut().filter(|tap| !tap.ended) {
                    self.lost += tap.take(operation.as_deref(), take);
                }
                if !self.ended && taps.iter().all(|tap| tap.ended) {
                    self.errors.push("the component has ended".to_owned());
                    self.ended = true;
                }
                false
            }
        }
    }
}

impl Tap {
    /// Takes the messages. Returns the number of lost ones that no message reports.
    fn take(&mut self, operation: Option<&str>, take: &mut dyn FnMut(Observed<'_>)) -> u64 {
        let mut more_lost = 0;
        let (received, is_open) = self.client.receive();
        for incoming in received {
            let Incoming::Notification(method, params) = incoming else {
                continue;
            };
            match rpc::message(&method, params) {
                Ok(Notification::Tapped(tapped)) => {
                    let lost = newly_lost(&mut self.dropped, tapped.dropped);
                    hand_over(&tapped, lost, operation, take);
                }
                Ok(Notification::Dropped { dropped, .. }) => {
                    more_lost += newly_lost(&mut self.dropped, dropped);
                }
                Err(_) => {}
            }
        }
        self.ended = !is_open;
        more_lost
    }
}

/// The losses since the count was `known`. A copy may have been counted before the last one.
fn newly_lost(known: &mut u64, count: u64) -> u64 {
    let before = std::mem::replace(known, count.max(*known));
    count.saturating_sub(before)
}

fn drain(
    port: &mut dyn Subscriber,
    gaps: &mut Gaps,
    errors: &mut Vec<String>,
    take: &mut dyn FnMut(Observed<'_>),
) -> usize {
    for count in 0..TURN {
        let received = port.receive(&mut |header, body| {
            let lost = gaps.note(&header);
            take(Observed {
                kind: MessageKind::Sample,
                operation: None,
                header,
                profile: Profile::Rpc,
                lost,
                body,
            });
        });
        match received {
            Ok(true) => {}
            Ok(false) => return count,
            Err(error) => {
                if errors.len() < 8 {
                    errors.push(error.to_string());
                }
            }
        }
    }
    TURN
}

fn hand_over(tapped: &Tapped, lost: u64, wanted: Option<&str>, take: &mut dyn FnMut(Observed<'_>)) {
    let operation = tapped.operation.as_deref();
    if wanted.is_some() && wanted != operation {
        return;
    }
    take(Observed {
        kind: match tapped.kind {
            TappedKind::Request => MessageKind::Request,
            TappedKind::Reply => MessageKind::Reply,
            TappedKind::Sample => MessageKind::Sample,
        },
        operation,
        header: Header {
            type_hash: tapped.type_hash,
            sequence: tapped.sequence,
            sent: tapped.sent,
            encoding: if tapped.image {
                Encoding::Image
            } else {
                Encoding::Cdr
            },
            sender: 0,
        },
        profile: if tapped.ros {
            Profile::Bare
        } else {
            Profile::Rpc
        },
        lost,
        body: &tapped.body,
    });
}

impl Topic {
    /// Decodes a sample. It fails if the sender has other types than the description.
    pub fn decode(&self, observed: &Observed<'_>) -> Result<rc_values::Value, Error> {
        let (theirs, ours) = (observed.header.type_hash, self.operation.hash);
        if theirs != 0 && theirs != ours {
            return Err(Error::OtherTypes {
                topic: self.address.clone(),
                sender: "the sender",
                theirs,
                ours,
            });
        }
        let encoding = observed.header.encoding;
        Ok(rc_values::decode(
            &self.operation.request,
            encoding,
            observed.body,
        )?)
    }
}

#[cfg(test)]
mod tests {
    use super::copied_by;
    use crate::network::End;

    fn end(component: &str, host: Option<&str>, middlewares: &[&str]) -> End {
        End {
            component: component.to_owned(),
            slot: "s".to_owned(),
            host: host.map(str::to_owned),
            middlewares: middlewares.iter().map(|word| (*word).to_owned()).collect(),
        }
    }

    /// The memory is where an end is that uses it: a subscriber here that hears over DDS has none.
    #[test]
    fn samples_are_copied_where_their_memory_is() {
        let sender = end("a", Some("arm"), &["iceoryx2", "dds"]);
        let there = end("b", Some("arm"), &["iceoryx2"]);
        let here = end("c", None, &["dds"]);
        let other = end("d", Some("arm"), &["iceoryx2"]);
        let by = |middleware: &str, publishers: &[End], subscribers: &[End]| {
            let found = copied_by(middleware, publishers, subscribers);
            let names = found.into_iter().map(|end| end.component.clone());
            names.collect::<Vec<_>>()
        };
        let one = std::slice::from_ref;
        let ends = [there.clone(), here.clone()];
        assert_eq!(by("iceoryx2", one(&sender), &ends), ["a"]);
        // Each publisher copies its own samples.
        let both = [sender.clone(), other];
        assert_eq!(by("iceoryx2", &both, &ends), ["a", "d"]);
        assert_eq!(by("iceoryx2", &[], &ends), ["b"]);
        let near = end("d", None, &["iceoryx2"]);
        assert!(by("iceoryx2", &[near], one(&there)).is_empty());
        assert!(by("dds", one(&sender), one(&here)).is_empty());
        assert_eq!(by("local", &[end("e", None, &["local"])], &[]), ["e"]);
        // The topics of time name none.
        assert_eq!(by("iceoryx2", &[end("f", Some("arm"), &[])], &[]), ["f"]);
    }
}
