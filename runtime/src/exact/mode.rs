//! Mode of a component: recorded, repeated, or neither.

use super::entry::{Entry, Kind};
use super::ports;
use super::recorder::Recorder;
use super::replay::Replay;
use crate::clock::Time;
use crate::error::StartError;
use crate::worker_error::WorkerError;
use rc_middleware::{Client, Header, Publisher, Reply, Server, Subscriber};
use std::borrow::Cow;
use std::rc::Rc;

/// Whether the life of a component is recorded, repeated, or neither. Its clones are the same.
#[derive(Clone, Debug, Default)]
pub(crate) enum Exact {
    /// Neither.
    #[default]
    Off,
    /// It is recorded.
    Record(Rc<Recorder>),
    /// It is repeated.
    Replay(Rc<Replay>),
}

impl Exact {
    /// A number that influences the worker: `real` finds it if nothing is repeated.
    pub(crate) fn number(&self, kind: Kind, real: impl FnOnce() -> u64) -> u64 {
        match self {
            Self::Off => real(),
            Self::Record(recorder) => {
                let value = real();
                recorder.push(&Entry {
                    value,
                    ..Entry::of(kind)
                });
                value
            }
            Self::Replay(replay) if !replay.is_in_turn() => real(),
            Self::Replay(replay) => replay.take(kind, 0, 0).value,
        }
    }

    /// The next input while the worker waits.
    pub(crate) fn awaited(&self, real: impl FnOnce() -> Entry<'static>) -> Entry<'static> {
        match self {
            Self::Off => real(),
            Self::Record(recorder) => {
                let entry = real();
                recorder.push(&entry);
                entry
            }
            Self::Replay(replay) if !replay.is_in_turn() => real(),
            Self::Replay(replay) => replay.take(Kind::Awaited, 0, 0),
        }
    }

    /// A text that influences the worker.
    pub(crate) fn text(&self, kind: Kind, real: impl FnOnce() -> String) -> String {
        match self {
            Self::Off => real(),
            Self::Record(recorder) => {
                let text = real();
                recorder.push(&Entry {
                    text: Cow::Borrowed(&text),
                    ..Entry::of(kind)
                });
                text
            }
            Self::Replay(replay) if !replay.is_in_turn() => real(),
            Self::Replay(replay) => replay.take(kind, 0, 0).text.into_owned(),
        }
    }

    /// The present time of the network.
    pub(crate) fn now(&self, real: impl FnOnce() -> Time) -> Time {
        Time::from_nanos(self.number(Kind::Now, || real().as_nanos()))
    }

    /// Whether the component is to end.
    pub(crate) fn is_stopping(&self, real: impl FnOnce() -> bool) -> bool {
        self.number(Kind::Stopping, || u64::from(real())) != 0
    }

    /// The worker does something that others notice.
    pub(crate) fn output(&self, entry: &Entry<'_>) {
        match self {
            Self::Off => {}
            Self::Record(recorder) => recorder.push(entry),
            Self::Replay(replay) => replay.compare(entry),
        }
    }

    /// The state machine takes an event of a tool.
    pub(crate) fn fired(&self, event: u16) {
        if let Self::Record(recorder) = self {
            recorder.push(&Entry {
                value: u64::from(event),
                ..Entry::of(Kind::Fired)
            });
        }
    }

    /// The next event of a tool in a repeated run.
    pub(crate) fn next_fired(&self) -> Option<u16> {
        match self {
            Self::Replay(replay) => replay.fired().map(|entry| entry.value as u16),
            Self::Off | Self::Record(_) => None,
        }
    }

    /// The worker ends its component.
    pub(crate) fn stop(&self, reason: &str) {
        self.output(&Entry {
            text: Cow::Borrowed(reason),
            ..Entry::of(Kind::Stop)
        });
    }

    /// The worker sets the time of the network.
    pub(crate) fn advance(&self, time: Time) {
        self.output(&Entry {
            value: time.as_nanos(),
            ..Entry::of(Kind::Advance)
        });
    }

    /// The port of a publisher, recorded if the component is.
    pub(crate) fn publisher(
        &self,
        slot: usize,
        operation: usize,
        port: Box<dyn Publisher>,
    ) -> Box<dyn Publisher> {
        match self {
            Self::Record(recorder) => {
                Box::new(ports::Publishing::new(recorder, slot, operation, port))
            }
            Self::Off | Self::Replay(_) => port,
        }
    }

    /// The port of a client, recorded if the component is.
    pub(crate) fn client(&self, slot: usize, port: Box<dyn Client>) -> Box<dyn Client> {
        match self {
            Self::Record(recorder) => Box::new(ports::Calling::new(recorder, slot, port)),
            Self::Off | Self::Replay(_) => port,
        }
    }

    /// The port of a subscriber, recorded if the component is.
    pub(crate) fn subscriber(
        &self,
        slot: usize,
        operation: usize,
        port: Box<dyn Subscriber>,
    ) -> Box<dyn Subscriber> {
        match self {
            Self::Record(recorder) => {
                Box::new(ports::Subscribing::new(recorder, slot, operation, port))
            }
            Self::Off | Self::Replay(_) => port,
        }
    }

    /// The port of a server, recorded if the component is.
    pub(crate) fn server(&self, slot: usize, port: Box<dyn Server>) -> Box<dyn Server> {
        match self {
            Self::Record(recorder) => Box::new(ports::Serving::new(recorder, slot, port)),
            Self::Off | Self::Replay(_) => port,
        }
    }

    /// Lets the worker initialise, the first turn of a recording.
    pub(crate) fn initialize<T>(
        &self,
        start: impl FnOnce() -> Result<T, StartError>,
    ) -> Result<T, StartError> {
        let Self::Record(recorder) = self else {
            return start();
        };
        recorder.begin_turn(&Entry::of(Kind::Initialize));
        let result = start();
        if let Err(StartError::Worker(reason)) = &result {
            recorder.result(&Err(WorkerError::Failed(reason.clone())));
        }
        recorder.end_turn();
        result
    }

    /// Lets `handle` handle the sample of a tool, as one of a peer.
    pub(crate) fn sample<R>(
        &self,
        slot: usize,
        operation: usize,
        header: Header,
        body: &[u8],
        handle: impl FnOnce() -> R,
    ) -> R {
        match self {
            Self::Record(recorder) => recorder.sample(slot, operation, header, body, handle),
            Self::Off | Self::Replay(_) => handle(),
        }
    }

    /// Lets `answer` reply to the request of a tool, as to one of a peer.
    pub(crate) fn request<R>(
        &self,
        slot: usize,
        header: Header,
        body: &[u8],
        reply: &mut dyn Reply,
        answer: impl FnOnce(&mut dyn Reply) -> R,
    ) -> R {
        match self {
            Self::Record(recorder) => recorder.request(slot, header, body, reply, answer),
            Self::Off | Self::Replay(_) => answer(reply),
        }
    }

    /// The ports of a component that is repeated.
    pub(crate) fn replay(&self) -> Option<&Rc<Replay>> {
        match self {
            Self::Replay(replay) => Some(replay),
            Self::Off | Self::Record(_) => None,
        }
    }
}
