//! Opening endpoints: a new endpoint is compared with those that are there, registered on this
//! machine, and introduced to its peers before its component uses it.

use crate::local_registry::Listing;
use crate::{
    EndpointInfo, EndpointKind, EndpointState, Guid, Identity, LocalRegistry, OpenLock,
    Registration, Role, host, types_match,
};
use rc_middleware::{Environment, OpenError, TypeIdentity, WakeEvent};
use std::cell::Cell;
use std::fmt::Display;
use std::path::Path;
use std::time::{Duration, Instant};

/// Pause between two looks at the registrations of others while an endpoint waits for them: at
/// first, and at most.
const LOOK: Duration = Duration::from_millis(2);
const LONGEST_LOOK: Duration = Duration::from_millis(32);

/// Limits of waiting for peers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PeerLimits {
    /// How long a component waits, in all, for endpoints on this machine that discovery does not
    /// find.
    pub(crate) local: Duration,
    /// How long after its start a client without a server waits for a server on another machine.
    pub(crate) remote: Duration,
}

/// Opens the endpoints of one component in one domain.
#[derive(Debug)]
pub(crate) struct Opener {
    registry: LocalRegistry,
    host: String,
    instance: String,
    wake_event: WakeEvent,
    started: Instant,
    remote_patience: Duration,
    /// Whether it opens endpoints of a tool, for which no component waits.
    observes: Cell<bool>,
    /// Remaining time to wait for endpoints on this machine.
    patience: Cell<Duration>,
}

impl Opener {
    /// Registers endpoints of `domain` in `folder`, the folder of the backend in the run directory.
    pub(crate) fn new(
        environment: &Environment,
        folder: &Path,
        domain: u32,
        patience: PeerLimits,
    ) -> Self {
        Self {
            registry: LocalRegistry::new(folder, domain),
            host: host(folder),
            instance: environment.instance.clone(),
            wake_event: environment.wake_event.clone(),
            started: Instant::now(),
            remote_patience: patience.remote,
            observes: Cell::new(false),
            patience: Cell::new(patience.local),
        }
    }

    /// Makes all endpoints from now on those of a tool.
    pub(crate) fn observe(&self) {
        self.observes.set(true);
    }

    /// This machine, see [`host`].
    pub(crate) fn host(&self) -> &str {
        &self.host
    }

    /// The announcement of an endpoint of this component.
    pub(crate) fn info(&self, role: Role, types: TypeIdentity) -> EndpointInfo {
        let role = if self.observes.get() {
            Role::Observer
        } else {
            role
        };
        EndpointInfo {
            role,
            types,
            instance: self.instance.clone(),
            pid: std::process::id(),
            host: self.host.clone(),
        }
    }

    /// Begins to open the endpoints of `address`. Other components of this machine wait until
    /// [`Opening::meet`].
    pub(crate) fn begin(&self, address: &str) -> Result<Opening<'_>, OpenError> {
        let lock = self.registry.open_lock();
        let lock = lock.map_err(|error| failed(address, &error))?;
        Ok(Opening {
            opener: self,
            // No other endpoint registers while the lock is held.
            listing: self.registry.listing(),
            lock,
            address: address.to_owned(),
        })
    }

    /// Waits until `found`, or until this component has run for as long as it waits for other
    /// machines, or stops.
    pub(crate) fn wait_for_remote(&self, state: &EndpointState, found: impl Fn() -> bool) {
        while !found()
            && self.started.elapsed() < self.remote_patience
            && !self.wake_event.is_stopping()
        {
            state.wait_for_change(LOOK);
        }
    }

    /// The first of these endpoints that has peers on this machine with which it has not found each
    /// other.
    fn unmet<'s>(&self, endpoints: &[&'s EndpointState]) -> Option<&'s EndpointState> {
        let listing = self.registry.listing();
        let mut endpoints = endpoints.iter().copied();
        endpoints.find(|state| !has_met(state, &listing))
    }
}

/// Whether an endpoint and all its peers on this machine have found each other.
fn has_met(state: &EndpointState, listing: &Listing<'_>) -> bool {
    let Identity {
        topic,
        kind,
        contract,
        ..
    } = &state.identity;
    let own = state.guid();
    let found_us =
        |registration: &Registration| own.is_none_or(|own| registration.found.contains(&own));
    let peers = listing.registrations(topic, kind.opposite());
    peers.iter().all(|peer| {
        let (offered, requested) = match kind {
            EndpointKind::Writer => (contract, &peer.contract),
            EndpointKind::Reader => (&peer.contract, contract),
        };
        !offered.differences(requested).is_empty()
            || state.any(|known| known.guid == peer.guid && (!known.matches || found_us(peer)))
    })
}

/// Endpoints of one address that are being opened. No other component of this machine opens one at
/// the same time, so of two servers one is first.
#[derive(Debug)]
pub(crate) struct Opening<'a> {
    opener: &'a Opener,
    listing: Listing<'a>,
    lock: OpenLock,
    address: String,
}

impl Opening<'_> {
    /// The error of this address for an error of the library.
    pub(crate) fn failed(&self, reason: &dyn Display) -> OpenError {
        failed(&self.address, reason)
    }

    /// Refuses a new endpoint at `topic` whose types differ from those of an endpoint that is
    /// there, and a second server. `remote`: the endpoints on other machines that discovery has
    /// found at `topic`.
    pub(crate) fn check(
        &self,
        topic: &str,
        info: &EndpointInfo,
        remote: impl IntoIterator<Item = EndpointInfo>,
    ) -> Result<(), OpenError> {
        let both = [EndpointKind::Writer, EndpointKind::Reader];
        let local = both.map(|kind| self.listing.registrations(topic, kind));
        let local = local.into_iter().flatten().map(|local| local.info);
        // On this machine, registrations are certain. Discovery still knows a process for a while
        // after it was killed.
        let remote = remote.into_iter().filter(|r| r.host != self.opener.host);
        for other in local.chain(remote) {
            if !types_match(&other.types, &info.types) {
                return Err(OpenError::TypeMismatch {
                    address: self.address.clone(),
                    ours: info.types.to_string(),
                    theirs: other.types.to_string(),
                });
            }
            if (info.role, other.role) == (Role::Server, Role::Server) {
                return Err(OpenError::AddressTaken {
                    address: self.address.clone(),
                    holder: other.describe(&self.opener.host),
                });
            }
        }
        Ok(())
    }

    /// Registers a new endpoint on this machine.
    pub(crate) fn register(&self, state: &EndpointState, guid: &Guid) -> Result<(), OpenError> {
        if self.opener.observes.get() {
            return Ok(());
        }
        let registration = self.opener.registry.register(guid, &state.identity);
        state.register(registration.map_err(|error| self.failed(&error))?);
        Ok(())
    }

    /// Lets other components open endpoints, and waits until these endpoints and their peers on
    /// this machine have found each other. Peers that cannot be reached cost a component its
    /// patience once.
    pub(crate) fn meet(self, endpoints: &[&EndpointState]) {
        let Self { opener, lock, .. } = self;
        drop(lock);
        let begin = Instant::now();
        let mut pause = LOOK;
        let mut unmet = opener.unmet(endpoints);
        while let Some(state) = unmet
            && begin.elapsed() < opener.patience.get()
            && !opener.wake_event.is_stopping()
        {
            state.wait_for_change(pause);
            pause = (pause * 2).min(LONGEST_LOOK);
            unmet = opener.unmet(endpoints);
        }
        if let Some(state) = unmet {
            // A component whose patience is over does not wait again, and has told why.
            if !opener.patience.get().is_zero() && !opener.wake_event.is_stopping() {
                tracing::warn!(
                    "`{}`: an endpoint on this machine was not found in {:.1} s; first messages may be lost",
                    state.topic(),
                    begin.elapsed().as_secs_f64()
                );
            }
            let left = opener.patience.get().saturating_sub(begin.elapsed());
            opener.patience.set(left);
        }
    }
}

fn failed(address: &str, reason: &dyn Display) -> OpenError {
    OpenError::Backend {
        address: address.to_owned(),
        reason: reason.to_string(),
    }
}
