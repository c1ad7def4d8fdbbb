//! One component's part in a domain: the participant, and the thread of discovery.

use crate::configuration::Joining;
use crate::entities::WatchedEndpoint;
use crate::entities::WriterState;
use crate::opener::{Opener, PeerLimits};
use crate::watcher::{Discovered, ForwardDiscovery, Message, Watcher};
use crate::{EndpointInfo, EndpointKind, EndpointState, Peer, report, udp};
use rc_ddsc::{Discovery, Domain, Event, Listener, Participant, Qos, Writer};
use rc_middleware::{Environment, OpenError};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Weak};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long a component waits at least for endpoints on this machine, and for servers on other
/// machines.
const PATIENCE: PeerLimits = PeerLimits {
    local: Duration::from_secs(3),
    remote: Duration::from_millis(300),
};
/// How long all endpoints together wait for threads of the library that use them while they are
/// closed. Such a thread needs microseconds.
const CLOSING: Duration = Duration::from_secs(2);
/// The library's numbers for further domains of this process, see `domain`.
const FURTHER_DOMAINS: std::ops::Range<u32> = 1000..10_000;

/// Participant of one component, which its endpoints share.
pub struct Session {
    /// Environment of the component.
    pub environment: Environment,
    queue_limit: u64,
    pub(crate) opener: Opener,
    pub(crate) messages: Sender<Message>,
    discovered: Arc<Discovered>,
    watcher: Option<JoinHandle<()>>,
    writers: RefCell<Vec<Weak<WriterState>>>,
    /// Remaining time to close endpoints.
    pub(crate) patience: Cell<Duration>,
    /// Whether a thread has not let go of an endpoint in that time.
    pub(crate) is_stuck: Cell<bool>,
    // Fields are dropped in their order: the domain goes last.
    discoveries: Arc<[Discovery; 2]>,
    pub(crate) participant: Rc<Participant>,
    domain: Rc<Domain>,
}

impl Session {
    /// Joins a domain.
    pub fn open(environment: &Environment, joining: &Joining) -> Result<Self, OpenError> {
        rc_ddsc::set_log(report::library);
        let failed = |what: &str, error: &dyn std::fmt::Display| {
            refused(environment, format!("{what}: {error}"))
        };
        let folder = environment.directory.middleware(joining.middleware);
        let opener = Opener::new(
            environment,
            &folder,
            joining.domain,
            patience(joining.lease),
        );
        let domain = domain(joining.domain, &joining.configuration).map_err(|error| {
            let help = udp::advice(joining.domain);
            failed("Cyclone DDS does not start", &format!("{error}; {help}"))
        })?;
        let participant = domain
            .participant(joining.user_data.as_bytes())
            .map_err(|error| failed("the domain cannot be joined", &error))?;
        let (messages, received) = channel();
        let discovered = Arc::new(Discovered::new(opener.host(), joining.service));
        let discover = |kind| {
            let listener = Box::new(ForwardDiscovery {
                kind,
                discovered: Arc::clone(&discovered),
                messages: messages.clone(),
            });
            participant
                .discovery(kind == EndpointKind::Writer, listener)
                .map_err(|error| failed("endpoints cannot be discovered", &error))
        };
        let readers = discover(EndpointKind::Reader)?;
        let discoveries = Arc::new([readers, discover(EndpointKind::Writer)?]);
        let watcher = Watcher {
            discovered: Arc::clone(&discovered),
            discoveries: Arc::clone(&discoveries),
        };
        let watcher = std::thread::Builder::new()
            .name(format!("rc-{}", joining.middleware))
            .spawn(move || watcher.run(&received))
            .map_err(|error| failed("a thread cannot be started", &error))?;
        Ok(Self {
            queue_limit: queue_limit(environment, joining.middleware),
            environment: environment.clone(),
            opener,
            messages,
            discovered,
            watcher: Some(watcher),
            writers: RefCell::default(),
            patience: Cell::new(CLOSING),
            is_stuck: Cell::new(false),
            discoveries,
            participant: Rc::new(participant),
            domain: Rc::new(domain),
        })
    }

    /// Makes the endpoints that are opened from now on those of a tool, which components do not
    /// count as peers.
    pub fn observe(&self) {
        self.opener.observe();
    }

    /// The announcements of other participants' endpoints at `topic`.
    pub(crate) fn endpoints_at(&self, topic: &str) -> Vec<EndpointInfo> {
        self.discovered.endpoints_at(topic, self.guid())
    }

    /// Adds a writer whose samples `have_arrived` and `linger` wait for.
    pub(crate) fn add_writer(&self, writer: &Arc<WriterState>) {
        let mut writers = self.writers.borrow_mut();
        writers.retain(|writer| writer.strong_count() > 0);
        writers.push(Arc::downgrade(writer));
    }

    /// The most bytes that wait in the receive queue of each port.
    pub fn queue_limit(&self) -> u64 {
        self.queue_limit
    }

    /// The identity of the participant.
    pub fn guid(&self) -> crate::Guid {
        self.participant.guid().unwrap_or_default()
    }

    /// Opens a writer that no component of this network reads, so it is not announced to any.
    pub fn writer(
        &self,
        (topic, type_name): (&str, &str),
        qos: &rc_middleware::Qos,
    ) -> Result<Writer, OpenError> {
        let made = self.participant.topic(topic, type_name);
        let qos = Qos::of(qos);
        let made = made.and_then(|topic| {
            self.participant
                .writer(&topic, &qos, Box::new(IgnoreEvents))
        });
        made.map_err(|error| OpenError::Backend {
            address: topic.to_owned(),
            reason: error.to_string(),
        })
    }

    /// Compares an endpoint of this component with those that are discovered, from now on.
    pub(crate) fn watch(&self, endpoint: &Arc<dyn WatchedEndpoint>, type_name: &str) {
        let own = self.guid();
        self.discovered.watch(endpoint, type_name, own);
    }

    /// Waits until `found`, or until this component has run for as long as it waits for other
    /// machines, or stops.
    pub fn wait_for_remote(&self, state: &EndpointState, found: impl Fn() -> bool) {
        self.opener.wait_for_remote(state, found);
    }

    /// The reports about mismatched endpoints that are there.
    pub fn mismatches(&self) -> Vec<String> {
        self.discovered.mismatches()
    }

    /// Whether the endpoints of components have all samples. Waits for that at most `limit`.
    pub fn have_arrived(&self, limit: Duration) -> bool {
        let begin = Instant::now();
        self.writers().all(|shared| {
            let guid = |peer: &Peer| (!peer.is_external()).then_some(peer.guid);
            let mut readers = shared.state.usable(guid).into_iter();
            readers.all(|reader| {
                let left = limit.saturating_sub(begin.elapsed());
                let waited = |writer: &Writer| writer.wait_for_acks_of(&reader, left);
                // An endpoint that is closed has sent its last sample.
                !matches!(shared.writer.with(waited), Some(Err(error)) if error.is_timeout())
            })
        })
    }

    /// Waits until all samples have arrived, at most `limit`.
    pub fn linger(&self, limit: Duration) {
        let begin = Instant::now();
        for shared in self.writers() {
            let left = limit.saturating_sub(begin.elapsed());
            // A reader that does not confirm in time loses samples. The component ends, so the loss
            // cannot be reported.
            let _ = shared.writer.with(|writer| writer.wait_for_acks(left));
        }
    }

    /// The writers that are open.
    fn writers(&self) -> impl Iterator<Item = Arc<WriterState>> {
        let writers: Vec<_> = self
            .writers
            .borrow()
            .iter()
            .filter_map(Weak::upgrade)
            .collect();
        writers.into_iter()
    }
}

/// Ignores all events.
struct IgnoreEvents;

impl Listener for IgnoreEvents {
    fn event(&self, _event: Event) {}
}

/// The longest wait for endpoints on this machine, however long the lease is.
const MOST_PATIENCE: Duration = Duration::from_secs(10);

/// The limits of waiting for peers where a process announces itself several times in `lease`: all of
/// these, so that the loss of some of them costs no first messages.
fn patience(lease: Duration) -> PeerLimits {
    PeerLimits {
        local: lease.clamp(PATIENCE.local, MOST_PATIENCE),
        ..PATIENCE
    }
}

/// The setting `queue_mib`, in bytes.
fn queue_limit(environment: &Environment, middleware: &str) -> u64 {
    let mib = environment.settings.int(middleware, "queue_mib");
    mib.and_then(|mib| u64::try_from(mib).ok()).unwrap_or(1) << 20
}

/// The error of a component that cannot join.
pub fn refused(environment: &Environment, reason: String) -> OpenError {
    OpenError::Backend {
        address: environment.network.clone(),
        reason,
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let _ = self.messages.send(Message::End);
        if self.is_stuck.get() {
            // The join, or the deletion, would wait for the stuck thread without limit. The end of
            // the process deletes these.
            std::mem::forget(Arc::clone(&self.discoveries));
            std::mem::forget(Rc::clone(&self.participant));
            std::mem::forget(Rc::clone(&self.domain));
            return;
        }
        if let Some(watcher) = self.watcher.take() {
            let _ = watcher.join();
        }
    }
}

/// Joins domain `id`. The library has one domain for each of its numbers in a process; where
/// several components run in one process, each one joins under a number of its own.
fn domain(id: u32, xml: &str) -> Result<Domain, rc_ddsc::Error> {
    let mut domain = Domain::new(id, xml);
    for number in FURTHER_DOMAINS {
        match &domain {
            Err(error) if error.is_precondition() => domain = Domain::new(number, xml),
            _ => break,
        }
    }
    domain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endpoints_on_this_machine_have_all_announcements_of_a_lease_to_find_each_other() {
        let local = |lease| patience(Duration::from_secs(lease)).local;
        assert_eq!(local(1), Duration::from_secs(3));
        assert_eq!(local(7), Duration::from_secs(7));
        assert_eq!(local(86_400), MOST_PATIENCE);
    }
}
