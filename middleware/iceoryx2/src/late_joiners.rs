//! Delivers the history of a transient-local publisher to late joiners.
//!
//! iceoryx2 delivers history only when the publisher sends again. A thread for each transient-local
//! publisher delivers it as soon as a subscriber joins, so that a sample that is sent only once
//! arrives, too.

use crate::names;
use crate::notifier::{Listener, Notifier};
use crate::ports::PublisherPort;
use crate::service::EventPorts;
use crate::session::Session;
use iceoryx2::port::update_connections::UpdateConnections;
use rc_middleware::{Endpoint, OpenError, WakeEvent, qos, wait};
use std::os::fd::AsFd;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// Interval at which the thread looks for late joiners without a notification.
const POLL_INTERVAL: Duration = Duration::from_millis(500);

/// The thread of one publisher. Ends when this value is dropped.
pub(crate) struct LateJoinerThread {
    end: WakeEvent,
    thread: Option<JoinHandle<()>>,
}

impl LateJoinerThread {
    /// Starts the thread for `port`.
    pub(crate) fn start(
        session: &Arc<Session>,
        endpoint: &Endpoint,
        port: Arc<PublisherPort>,
    ) -> Result<Self, OpenError> {
        let failed = |error: std::io::Error| OpenError::Backend {
            address: endpoint.address.to_string(),
            reason: error.to_string(),
        };
        let publishers = qos::publishers(endpoint.qos.depth as usize);
        let late = names::late_joiners(&endpoint.address);
        let listener = Listener::open(session, &late, EventPorts::LateJoiners(publishers), None)?;
        let topic = names::topic(&endpoint.address);
        let (ports, types) = (EventPorts::Topic(publishers), Some(&endpoint.types));
        let notifier = Notifier::open(session, &topic, ports, types)?;
        let end = WakeEvent::new().map_err(failed)?;
        let ended = end.clone();
        let thread = std::thread::Builder::new()
            .name("iceoryx2-late".to_owned())
            .spawn(move || {
                while !ended.is_stopping() {
                    let readable = wait(&[listener.descriptor(), ended.as_fd()], POLL_INTERVAL);
                    let wakeup = listener.acknowledge(readable & 1 != 0);
                    // iceoryx2 retries with the next sample.
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
            // The panic handler of the thread has reported a panic.
            let _ = thread.join();
        }
    }
}
