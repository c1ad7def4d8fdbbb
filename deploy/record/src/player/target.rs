//! A topic of the network to which recorded messages go.

use rc_observe::{Error, Network, Sender, Topic};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, SyncSender, TrySendError, channel, sync_channel,
};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The pause before a topic that could not be sent to is opened again.
const AGAIN: Duration = Duration::from_secs(5);
/// How many messages of a topic wait for subscribers on other hosts.
const QUEUE: usize = 64;
/// The most bytes of these messages. A longer message is sent when no other one waits.
const QUEUE_BYTES: usize = 16 << 20;
/// How long the player waits until a topic with subscribers on other hosts is open.
const OPENING: Duration = Duration::from_secs(1);
/// How long the last messages for other hosts may take.
const LINGER: Duration = Duration::from_secs(1);

/// A topic to which messages go.
pub(super) struct Target {
    pub(super) topic: Topic,
    route: Route,
}

enum Route {
    /// By middleware, which does not wait for subscribers.
    Direct(Box<Port>),
    /// Subscribers on other hosts confirm each message. A thread waits for them, so that one that
    /// hangs delays no other topic.
    Threaded(SendingThread),
}

/// A sender that is opened again after an error.
struct Port {
    network: Arc<Network>,
    topic: Topic,
    /// None after an error: its subscribers may have been restarted.
    sender: Option<Sender>,
    /// When it was tried last to open a sender.
    opened: Instant,
}

/// The sending ports of a thread.
trait Outlet {
    fn send(&mut self, body: &[u8]) -> Result<(), Error>;
    /// Waits until the last message has arrived.
    fn finish(self);
}

struct SendingThread {
    bodies: SyncSender<Vec<u8>>,
    /// The bytes that wait, or are being sent.
    waiting: Arc<AtomicUsize>,
    failures: Arc<Failures>,
    ended: Receiver<()>,
    thread: JoinHandle<()>,
}

/// The messages that a thread could not send.
#[derive(Default)]
struct Failures {
    count: AtomicU64,
    last: Mutex<Option<String>>,
}

impl Failures {
    fn add(&self, error: &Error) {
        self.count.fetch_add(1, Ordering::Relaxed);
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        *last = Some(error.to_string());
    }
}

impl Port {
    fn open(network: &Arc<Network>, topic: &Topic) -> Result<Self, Error> {
        Ok(Self {
            sender: Some(Sender::open(network, topic)?),
            network: Arc::clone(network),
            topic: topic.clone(),
            opened: Instant::now(),
        })
    }

    /// Opens a topic; after an error, the next message tries again.
    fn begin(network: Arc<Network>, topic: Topic) -> (Result<(), Error>, Self) {
        match Self::open(&network, &topic) {
            Ok(port) => (Ok(()), port),
            Err(error) => {
                let port = Self {
                    network,
                    topic,
                    sender: None,
                    opened: Instant::now(),
                };
                (Err(error), port)
            }
        }
    }
}

impl Outlet for Port {
    /// Sends a message. After an error, the next ones open the topic again, at most one in
    /// [`AGAIN`].
    fn send(&mut self, body: &[u8]) -> Result<(), Error> {
        if self.sender.is_none() && self.opened.elapsed() >= AGAIN {
            let opened = Sender::open(&self.network, &self.topic);
            // Sending to a hanging component takes time, which must not be most of the time.
            self.opened = Instant::now();
            self.sender = Some(opened?);
        }
        let Some(sender) = &mut self.sender else {
            return Err(unreachable_topic(&self.topic));
        };
        let sent = sender.send_body(body);
        if sent.is_err() {
            self.sender = None;
        }
        sent
    }

    fn finish(self) {
        if let Some(sender) = self.sender {
            sender.finish();
        }
    }
}

fn unreachable_topic(topic: &Topic) -> Error {
    Error::Component {
        component: topic.address.clone(),
        reason: "it is not reachable".to_owned(),
    }
}

impl Target {
    pub(super) fn open(network: &Arc<Network>, topic: Topic) -> Result<Self, Error> {
        let is_threaded = Sender::confirms(&topic);
        let route = if is_threaded {
            let (network, topic) = (Arc::clone(network), topic.clone());
            Route::Threaded(SendingThread::open(move || Port::begin(network, topic))?)
        } else {
            Route::Direct(Box::new(Port::open(network, &topic)?))
        };
        Ok(Self { topic, route })
    }

    /// Sends a message, or hands it to the thread that sends it. The error says why it is left out.
    pub(super) fn send(&mut self, body: &[u8]) -> Result<(), String> {
        match &mut self.route {
            Route::Direct(port) => port.send(body).map_err(|error| error.to_string()),
            Route::Threaded(thread) => thread.send(body),
        }
    }

    /// The number of messages since the last call that were handed over and could not be sent, and
    /// why.
    pub(super) fn failures(&self) -> Option<(u64, String)> {
        let Route::Threaded(SendingThread { failures, .. }) = &self.route else {
            return None;
        };
        let mut last = failures.last.lock().unwrap_or_else(PoisonError::into_inner);
        let error = last.take()?;
        Some((failures.count.swap(0, Ordering::Relaxed), error))
    }

    /// Waits until the last samples have arrived, but not for a subscriber that hangs.
    pub(super) fn finish(self) {
        match self.route {
            Route::Direct(port) => port.finish(),
            Route::Threaded(thread) => thread.finish(),
        }
    }
}

impl SendingThread {
    /// Begins a thread that opens the outlet and sends. Waits a moment for the opening.
    fn open<P: Outlet>(
        open: impl FnOnce() -> (Result<(), Error>, P) + Send + 'static,
    ) -> Result<Self, Error> {
        let (bodies, received) = sync_channel::<Vec<u8>>(QUEUE);
        let waiting = Arc::new(AtomicUsize::new(0));
        let left = Arc::clone(&waiting);
        let (opened, is_open) = channel();
        let (alive, ended) = channel::<()>();
        let failures = Arc::new(Failures::default());
        let failed = Arc::clone(&failures);
        let thread = std::thread::Builder::new().name("sending".to_owned());
        let thread = thread.spawn(move || {
            let _alive = alive;
            let (result, mut outlet) = open();
            // The player may not wait any more.
            if let Err(unheard) = opened.send(result)
                && let Err(error) = unheard.0
            {
                failed.add(&error);
            }
            for body in received {
                if let Err(error) = outlet.send(&body) {
                    failed.add(&error);
                }
                left.fetch_sub(body.len(), Ordering::Relaxed);
            }
            outlet.finish();
        });
        let thread = thread.map_err(|e| Error::Component {
            component: "the player".to_owned(),
            reason: format!("no thread can be started: {e}"),
        })?;
        if let Ok(Err(error)) = is_open.recv_timeout(OPENING) {
            return Err(error);
        }
        Ok(Self {
            bodies,
            waiting,
            failures,
            ended,
            thread,
        })
    }

    fn send(&self, body: &[u8]) -> Result<(), String> {
        let slow = || "a subscriber on another host is too slow".to_owned();
        // Only this thread adds to it.
        let waiting = self.waiting.load(Ordering::Relaxed);
        if waiting > 0 && waiting + body.len() > QUEUE_BYTES {
            return Err(slow());
        }
        self.waiting.fetch_add(body.len(), Ordering::Relaxed);
        self.bodies.try_send(body.to_vec()).map_err(|error| {
            self.waiting.fetch_sub(body.len(), Ordering::Relaxed);
            match error {
                TrySendError::Full(_) => slow(),
                TrySendError::Disconnected(_) => "it is not reachable".to_owned(),
            }
        })
    }

    fn finish(self) {
        drop(self.bodies);
        // The thread drops its end when it ends.
        if self.ended.recv_timeout(LINGER) != Err(RecvTimeoutError::Timeout) {
            let _ = self.thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hangs at each message until it is released.
    struct Hanging(Receiver<()>);

    impl Outlet for Hanging {
        fn send(&mut self, _: &[u8]) -> Result<(), Error> {
            let _ = self.0.recv();
            Ok(())
        }

        fn finish(self) {}
    }

    #[test]
    fn a_subscriber_that_hangs_delays_nobody() {
        let (release, released) = channel();
        let thread = SendingThread::open(move || (Ok(()), Hanging(released))).expect("a thread");
        // One is sent and the queue is full; the others are left out.
        let sent = (0..2 * QUEUE).filter(|_| thread.send(b"x").is_ok()).count();
        assert!((QUEUE..=QUEUE + 1).contains(&sent), "{sent}");
        // The thread may have taken its first one only now.
        let refused = (0..2).find_map(|_| thread.send(b"x").err());
        let refused = refused.expect("a full queue");
        assert!(refused.contains("too slow"), "{refused}");
        drop(release);
        thread.finish();
    }

    #[test]
    fn messages_for_a_subscriber_that_hangs_have_a_bound_in_bytes() {
        let (release, released) = channel();
        let thread = SendingThread::open(move || (Ok(()), Hanging(released))).expect("a thread");
        // One message may have any size.
        let large = vec![0; QUEUE_BYTES + 1];
        assert_eq!(thread.send(&large), Ok(()));
        let refused = thread.send(b"x").expect_err("a full queue");
        assert!(refused.contains("too slow"), "{refused}");
        release.send(()).expect("it hangs");
        let begun = Instant::now();
        while thread.waiting.load(Ordering::Relaxed) > 0 {
            assert!(begun.elapsed() < LINGER * 60, "it was sent");
            std::thread::yield_now();
        }
        let half = &large[..QUEUE_BYTES / 2];
        assert_eq!([half, half].map(|body| thread.send(body)), [Ok(()), Ok(())]);
        assert!(thread.send(b"x").is_err());
        drop(release);
        thread.finish();
    }

    #[test]
    fn an_outlet_that_does_not_open_is_an_error() {
        let error = || Error::Component {
            component: "a".to_owned(),
            reason: "it is not reachable".to_owned(),
        };
        let (_release, released) = channel();
        let refused = SendingThread::open(move || (Err(error()), Hanging(released))).map(drop);
        assert!(refused.is_err());
    }
}
