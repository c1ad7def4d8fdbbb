//! What an endpoint of the library shares with the library's threads and with the thread of
//! discovery.

use crate::shared_entity::SharedEntity;
use rc_ddsc::{End, Reader, Sample, Writer};
use rc_network::{Backlog, EndpointInfo, GuidPrefix, Presence, lock, types_match};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What is known of a peer besides: how long its samples are valid; `None` for ever.
pub(crate) type Lifespan = Option<Duration>;
/// Another endpoint that was discovered.
pub(crate) type Peer = rc_network::Peer<Lifespan>;
/// The state of an endpoint. The library names peers by handles.
pub(crate) type EndpointState = rc_network::EndpointState<u64, Lifespan>;

/// Where a reader puts samples, on a thread of the library.
pub(crate) trait Inbox: Backlog {
    /// Adds a sample.
    fn put(&self, sample: Sample);
}

/// The sender of a sample.
pub(crate) struct Sender {
    /// It stays the same when the sender is lost and found again.
    pub(crate) id: u128,
    /// The hash of its types; 0 of an endpoint of another program.
    pub(crate) type_hash: u64,
    /// How long its samples are valid.
    pub(crate) lifespan: Lifespan,
}

/// An endpoint that the thread of discovery looks after.
pub(crate) trait Watched: Send + Sync {
    /// Its state.
    fn state(&self) -> &EndpointState;

    /// What the library knows of the peer with this handle.
    fn look_up(&self, handle: u64) -> Option<End>;
}

/// Adds a peer that the library has found; gives it where its types differ.
pub(crate) fn matched(endpoint: &dyn Watched, handle: u64) -> Option<Peer> {
    let peer = peer(endpoint, handle)?;
    endpoint.state().insert(handle, peer.clone());
    (!peer.matches).then_some(peer)
}

fn peer(endpoint: &dyn Watched, handle: u64) -> Option<Peer> {
    let end = endpoint.look_up(handle)?;
    let info = EndpointInfo::parse(&end.user_data);
    let ours = &endpoint.state().identity.info.types;
    let matches = info
        .as_ref()
        .is_none_or(|info| types_match(&info.types, ours));
    Some(Peer {
        guid: end.guid,
        info,
        matches,
        presence: Presence::Present,
        details: end.lifespan,
    })
}

/// A writer.
pub(crate) struct WriterState {
    pub(crate) state: EndpointState,
    pub(crate) writer: SharedEntity<Writer>,
}

impl Watched for WriterState {
    fn state(&self) -> &EndpointState {
        &self.state
    }

    fn look_up(&self, handle: u64) -> Option<End> {
        let found = self.writer.with_opened(|writer| writer.matched(handle));
        found.flatten()
    }
}

/// A reader.
pub(crate) struct ReaderState {
    pub(crate) state: EndpointState,
    pub(crate) reader: SharedEntity<Reader>,
    inbox: Arc<dyn Inbox>,
    /// Held while samples are taken, so that they keep their order.
    taking: Mutex<()>,
}

impl Watched for ReaderState {
    fn state(&self) -> &EndpointState {
        &self.state
    }

    fn look_up(&self, handle: u64) -> Option<End> {
        let found = self.reader.with_opened(|reader| reader.matched(handle));
        found.flatten()
    }
}

impl ReaderState {
    pub(crate) fn new(state: EndpointState, inbox: Arc<dyn Inbox>) -> Self {
        Self {
            state,
            reader: SharedEntity::default(),
            inbox,
            taking: Mutex::default(),
        }
    }

    /// Puts received samples into the inbox. Samples that arrive before the reader is open stay in
    /// the library until it is.
    pub(crate) fn receive(&self) {
        let received = self.reader.with(|reader| {
            let _taking = lock(&self.taking);
            let mut received = false;
            // A flood does not keep the reader from being closed.
            while !self.reader.is_closed() {
                let Ok(batch) = reader.take_batch(|sample| self.inbox.put(sample)) else {
                    break;
                };
                received |= batch.count > 0;
                if !batch.more {
                    break;
                }
            }
            received
        });
        if received == Some(true) {
            self.state.signal.wake();
        }
    }

    /// The sender of a sample; `None` if its types differ.
    pub(crate) fn sender(&self, handle: u64) -> Option<Sender> {
        let of = |peer: &Peer| {
            peer.matches.then_some(Sender {
                id: u128::from_be_bytes(peer.guid),
                type_hash: peer.info.as_ref().map_or(0, |info| info.types.hash),
                lifespan: peer.details,
            })
        };
        let known = self.state.with(&handle, of);
        // The thread of discovery may not have added it yet.
        let known = known.or_else(|| Some(of(&peer(self, handle)?)));
        known.unwrap_or(Some(Sender {
            id: handle.into(),
            type_hash: 0,
            lifespan: None,
        }))
    }

    /// The participant of the sender of a sample.
    pub(crate) fn participant(&self, handle: u64) -> Option<GuidPrefix> {
        let known = self.state.with(&handle, Peer::prefix);
        known.or_else(|| Some(peer(self, handle)?.prefix()))
    }
}
