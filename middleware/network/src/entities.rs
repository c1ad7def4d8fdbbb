//! State that an endpoint shares with the library's threads and with the thread of
//! discovery.

use crate::shared_entity::SharedEntity;
use crate::{Backlog, EndpointInfo, EndpointState, GuidPrefix, Peer, Presence, lock, types_match};
use rc_ddsc::{End, Reader, Sample, Writer};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The destination of samples from a reader, on a thread of the library.
pub trait Inbox: Backlog {
    /// Adds a sample. `from`: the participant of its writer, if the thread of discovery has added
    /// the writer by now.
    fn put(&self, sample: Sample, from: Option<GuidPrefix>);
}

/// The sender of a sample.
pub struct Sender {
    /// It stays the same when the sender is lost and found again.
    pub id: u128,
    /// The hash of its types; 0 of an endpoint of another program.
    pub type_hash: u64,
    /// How long its samples are valid.
    pub lifespan: Option<Duration>,
}

/// An endpoint that the thread of discovery looks after.
pub(crate) trait WatchedEndpoint: Send + Sync {
    /// Peers, errors and readiness of the endpoint.
    fn state(&self) -> &EndpointState;

    /// Looks up the peer with this handle in the library.
    fn look_up(&self, handle: u64) -> Option<End>;
}

/// Adds a peer that the library has found; gives it where its types differ.
pub(crate) fn matched(endpoint: &dyn WatchedEndpoint, handle: u64) -> Option<Peer> {
    let peer = peer(endpoint, handle)?;
    endpoint.state().insert(handle, peer.clone());
    (!peer.matches).then_some(peer)
}

fn peer(endpoint: &dyn WatchedEndpoint, handle: u64) -> Option<Peer> {
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
        lifespan: end.lifespan,
    })
}

/// A writer.
pub struct WriterState {
    /// Peers, errors and readiness of the endpoint.
    pub state: EndpointState,
    pub(crate) writer: SharedEntity<Writer>,
}

impl WatchedEndpoint for WriterState {
    fn state(&self) -> &EndpointState {
        &self.state
    }

    fn look_up(&self, handle: u64) -> Option<End> {
        let found = self.writer.with_opened(|writer| writer.matched(handle));
        found.flatten()
    }
}

/// A reader.
pub struct ReaderState {
    /// Peers, errors and readiness of the endpoint.
    pub state: EndpointState,
    pub(crate) reader: SharedEntity<Reader>,
    inbox: Arc<dyn Inbox>,
    /// Held while samples are taken, so that they keep their order.
    taking: Mutex<()>,
}

impl WatchedEndpoint for ReaderState {
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
            let put = |sample: Sample| {
                let from = self.state.with(sample.writer(), Peer::prefix);
                self.inbox.put(sample, from);
            };
            // A flood does not keep the reader from being closed.
            while !self.reader.is_closed() {
                let Ok(batch) = reader.take_batch(put) else {
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
    pub fn sender(&self, handle: u64) -> Option<Sender> {
        let of = |peer: &Peer| {
            peer.matches.then_some(Sender {
                id: u128::from_be_bytes(peer.guid),
                type_hash: peer.info.as_ref().map_or(0, |info| info.types.hash),
                lifespan: peer.lifespan,
            })
        };
        let known = self.state.with(handle, of);
        // The thread of discovery may not have added it yet.
        let known = known.or_else(|| Some(of(&peer(self, handle)?)));
        known.unwrap_or(Some(Sender {
            id: handle.into(),
            type_hash: 0,
            lifespan: None,
        }))
    }

    /// The peer that sent a sample, as far as it is known.
    pub fn peer(&self, handle: u64) -> Option<Peer> {
        let known = self.state.with(handle, Peer::clone);
        // The thread of discovery may not have added it yet.
        known.or_else(|| peer(self, handle))
    }

    /// Whether the sender of a sample has left, or its types differ. A sender that the thread of
    /// discovery has not added yet counts as present.
    pub fn has_lost(&self, handle: u64) -> bool {
        let lost = self.state.with(handle, |peer| !peer.is_usable());
        lost.unwrap_or(false)
    }

    /// The participant of the sender of a sample.
    pub fn participant(&self, handle: u64) -> Option<GuidPrefix> {
        let known = self.state.with(handle, Peer::prefix);
        known.or_else(|| Some(peer(self, handle)?.prefix()))
    }
}
