//! Serves late subscribers of a publisher that keeps values. iceoryx2 hands over what it keeps when its publisher
//! sends again; so that a value which is sent only once arrives too, a thread looks after each such publisher.

use crate::names;
use crate::notifier::{Listener, Notifier};
use crate::service::{EventPorts, PublisherPort};
use crate::session::Session;
use iceoryx2::port::update_connections::UpdateConnections;
use rc_middleware::{Endpoint, Interrupt, OpenError, wait};
use std::os::fd::AsFd;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// How often the thread looks even when nobody has rung.
const POLL_INTERVAL: Duration = Duration::from_millis(500);

/// The thread; it ends with this value.
pub(crate) struct LateJoinerThread {
    end: Interrupt,
    thread: Option<JoinHandle<()>>,
}

impl LateJoinerThread {
    /// Looks after `port` from now on.
    pub(crate) fn start(
        session: &Arc<Session>,
        endpoint: &Endpoint,
        port: Arc<PublisherPort>,
    ) -> Result<Self, OpenError> {
        let failed = |error: std::io::Error| OpenError::Backend {
            address: endpoint.address.to_string(),
            reason: error.to_string(),
        };
        let late = names::late_joiners(&endpoint.address);
        let listener = Listener::open(session, &late, EventPorts::LateJoiners, None)?;
        let topic = names::topic(&endpoint.address);
        let notifier = Notifier::open(session, &topic, EventPorts::Topic, Some(&endpoint.types))?;
        let end = Interrupt::new().map_err(failed)?;
        let ended = end.clone();
        let thread = std::thread::Builder::new()
            .name("iceoryx2-late".to_owned())
            .spawn(move || {
                while !ended.is_stopping() {
                    let readable = wait(&[listener.descriptor(), ended.as_fd()], POLL_INTERVAL);
                    let wakeup = listener.acknowledge(readable & 1 != 0);
                    // What cannot be delivered now is tried again with the next value.
                    let _ = port.update_connections();
                    if wakeup.any {
                        notifier.notify();
                    }
                }
            })
            .map_err(failed)?;
        Ok(Self {
            end,
            thread: Some(thread),
        })
    }
}

impl Drop for LateJoinerThread {
    fn drop(&mut self) {
        self.end.stop();
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been reported by the thread.
            let _ = thread.join();
        }
    }
}
