//! Waking: who receives listens, who sends rings. A ring carries no data.

use crate::service::{
    EventPorts, EventService, ListenerPort, NotifierPort, event, existing_event, refusal,
};
use crate::session::Session;
use iceoryx2::port::EventId;
use iceoryx2::service::port_factory::PortFactory as _;
use rc_middleware::{OpenError, TypeIdentity};
use std::os::fd::BorrowedFd;

/// The event that says: look into your queue.
const DATA: usize = 0;
/// The event that says: there is a publisher that keeps values.
pub(crate) const TRANSIENT_LOCAL: usize = 1;

/// Most passes to take rings back, see [`Listener::acknowledge`].
const PASSES: usize = 100;

/// The ringing end.
pub(crate) struct Notifier {
    event: EventService,
    port: NotifierPort,
}

/// The listening end.
pub(crate) struct Listener {
    port: ListenerPort,
    _event: EventService,
}

/// What was rung for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Wakeup {
    /// Something was rung for.
    pub(crate) any: bool,
    /// There is a publisher that keeps values.
    pub(crate) transient_local: bool,
}

impl Notifier {
    /// The ringing end of `name`, which is made if it is not there.
    pub(crate) fn open(
        session: &Session,
        name: &str,
        ports: EventPorts,
        types: Option<&TypeIdentity>,
    ) -> Result<Self, OpenError> {
        let event = event(session, name, ports, types)?;
        let port = event
            .notifier_builder()
            .default_event_id(EventId::new(DATA))
            .create()
            .map_err(|error| refusal(name)(format!("{error:?}")))?;
        Ok(Self { event, port })
    }

    /// The ringing end of `name`, where that is there.
    pub(crate) fn existing(session: &Session, name: &str) -> Option<Self> {
        let event = existing_event(session, name)?;
        let port = event.notifier_builder().create().ok()?;
        Some(Self { event, port })
    }

    /// Wakes all who listen.
    pub(crate) fn notify(&self) {
        self.send(DATA);
    }

    /// Tells all who listen that there is a publisher that keeps values.
    pub(crate) fn announce_transient_local(&self) {
        self.send(TRANSIENT_LOCAL);
    }

    /// Whether anybody listens.
    pub(crate) fn has_listeners(&self) -> bool {
        self.event.dynamic_config().number_of_listeners() > 0
    }

    fn send(&self, id: usize) {
        if self.has_listeners() {
            // A listener that cannot be reached is dead or has been rung for already; those who wait look into
            // their queues from time to time all the same.
            let _ = self.port.notify_with_custom_event_id(EventId::new(id));
        }
    }
}

impl Listener {
    /// The listening end of `name`, which is made if it is not there.
    pub(crate) fn open(
        session: &Session,
        name: &str,
        ports: EventPorts,
        types: Option<&TypeIdentity>,
    ) -> Result<Self, OpenError> {
        let event = event(session, name, ports, types)?;
        let port = event
            .listener_builder()
            .create()
            .map_err(|error| refusal(name)(format!("{error:?}")))?;
        Ok(Self {
            port,
            _event: event,
        })
    }

    /// Readable when it was rung for.
    pub(crate) fn descriptor(&self) -> BorrowedFd<'_> {
        crate::descriptor::of(&self.port)
    }

    /// Takes the rings back; `woken`: whether the descriptor was readable.
    ///
    /// Before one sleeps, the state that says "rung for" must be unset, or no later ring is heard. In iceoryx2 0.10.0 a
    /// ring that comes during a pass can be swallowed while this state stays set. So passes are made until one finds
    /// nothing, which costs two system calls; a single one is enough where the ring that woke is the only one that it
    /// found, for then none came during it. (Rung for without a pause, the descriptor would stay readable. What is left
    /// of the defect takes two such coincidences one after the other, and the next look after it, which is never far:
    /// rung for by two and three at once, none of 3.0 million wakes was lost so, none of 2.6 million with passes until
    /// nothing is found, 7 of 3.0 million with a single pass.)
    pub(crate) fn acknowledge(&self, woken: bool) -> Wakeup {
        let mut wakeup = Wakeup::default();
        for pass in 0..PASSES {
            match self.pass(&mut wakeup) {
                0 => break,
                1 if woken && pass == 0 => break,
                _ => {}
            }
        }
        wakeup
    }

    /// Gives the number of rings.
    fn pass(&self, wakeup: &mut Wakeup) -> u64 {
        let pass = self.port.try_wait(|event| {
            wakeup.any = true;
            wakeup.transient_local |= event.id.as_value() == TRANSIENT_LOCAL;
        });
        pass.unwrap_or_default()
    }
}
