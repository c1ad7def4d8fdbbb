//! The pending requests of a client, and the replies that it waits for.

use crate::{GuidPrefix, lock};
use rc_middleware::QueueGauge;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// The pending requests of one client, each by its identity `K`, and the replies to its
/// calls.
///
/// Every participant of a domain may write replies. A reply counts only if its request is pending
/// and its writer belongs to the server of that request. A reply ends its request; its content is
/// kept only if a call waits for it. All replies together have at most as many bytes as the limit
/// of the queue.
#[derive(Debug)]
pub struct ReplyQueue<K, S> {
    calls: Mutex<Calls<K, S>>,
    gauge: QueueGauge,
}

#[derive(Debug)]
struct Calls<K, S> {
    /// The server that has the requests.
    server: Option<GuidPrefix>,
    /// Requests without a reply, and when they were sent.
    pending: BTreeMap<K, Instant>,
    /// The requests whose replies are kept, and those that have come.
    awaited: BTreeMap<K, Option<Awaited<S>>>,
}

/// The reply to a call.
#[derive(Debug)]
struct Awaited<S> {
    size: usize,
    /// `None` if there was no room for it.
    sample: Option<S>,
}

impl<K: Copy + Ord, S> ReplyQueue<K, S> {
    /// A queue with room for `limit` bytes.
    pub fn new(limit: u64) -> Self {
        Self {
            calls: Mutex::new(Calls {
                server: None,
                pending: BTreeMap::new(),
                awaited: BTreeMap::new(),
            }),
            gauge: QueueGauge::new(limit),
        }
    }

    /// Gauge of the bytes and replies in the queue.
    pub fn gauge(&self) -> &QueueGauge {
        &self.gauge
    }

    /// The server of the last request.
    pub fn server(&self) -> Option<GuidPrefix> {
        lock(&self.calls).server
    }

    /// Sets the server of the following requests. Requests to another one end.
    pub fn set_server(&self, server: GuidPrefix) {
        let mut calls = lock(&self.calls);
        if calls.server != Some(server) {
            calls.server = Some(server);
            calls.pending.clear();
        }
    }

    /// Adds a request before it is sent. `is_awaited`: whether a call waits for its reply, until
    /// [`ReplyQueue::finish`].
    pub fn begin(&self, request: K, is_awaited: bool) {
        let mut calls = lock(&self.calls);
        calls.pending.insert(request, Instant::now());
        if is_awaited {
            calls.awaited.insert(request, None);
        }
    }

    /// Removes a request that could not be sent.
    pub fn cancel(&self, request: K) {
        let mut calls = lock(&self.calls);
        calls.pending.remove(&request);
        // The next request may have the same number; its reply is not that of this call.
        calls.awaited.remove(&request);
    }

    /// Ends the call of a request. A reply that comes later only ends its request.
    pub fn finish(&self, request: K) {
        let mut calls = lock(&self.calls);
        if let Some(Some(reply)) = calls.awaited.remove(&request) {
            self.free(&reply);
        }
    }

    /// Whether the request of a condition is pending.
    pub fn is_pending(&self, condition: impl Fn(&K) -> bool) -> bool {
        lock(&self.calls).pending.keys().any(condition)
    }

    /// The number of pending requests.
    pub fn pending(&self) -> usize {
        lock(&self.calls).pending.len()
    }

    /// Ends the requests that were sent at least `age` ago.
    pub fn expire(&self, age: Duration) {
        let mut calls = lock(&self.calls);
        calls.pending.retain(|_, sent| sent.elapsed() < age);
    }

    /// Adds the reply to `request`, with `size` bytes, whose writer belongs to the participant
    /// `from`. It is dropped unless it counts, see the type.
    pub fn put(&self, request: K, from: Option<GuidPrefix>, size: usize, sample: S) {
        let mut calls = lock(&self.calls);
        // A client sends a request only after it has found the writer of the replies.
        let is_server = from.is_some() && from == calls.server;
        if !is_server || calls.pending.remove(&request).is_none() {
            self.gauge.drop_one();
            return;
        }
        if let Some(reply) = calls.awaited.get_mut(&request) {
            let sample = self.gauge.add(size).then_some(sample);
            *reply = Some(Awaited { size, sample });
        }
    }

    /// Takes the reply to the call of a request. It is an error with the reason if there was no
    /// room for the reply.
    pub fn take(&self, request: K) -> Option<Result<S, String>> {
        let mut calls = lock(&self.calls);
        let reply = calls.awaited.get_mut(&request)?.take()?;
        self.free(&reply);
        Some(reply.sample.ok_or_else(|| {
            let (size, limit) = (reply.size, self.gauge.limit());
            format!(
                "the reply has {size} bytes, and the setting `queue_mib` allows {limit} for all that wait"
            )
        }))
    }

    fn free(&self, reply: &Awaited<S>) {
        if reply.sample.is_some() {
            self.gauge.remove(reply.size);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SERVER: GuidPrefix = [1; 12];
    const STRANGER: GuidPrefix = [2; 12];

    fn asked() -> ReplyQueue<u64, &'static str> {
        let queue = ReplyQueue::new(100);
        queue.set_server(SERVER);
        queue.begin(1, false);
        queue.begin(2, true);
        queue
    }

    #[test]
    fn a_reply_counts_only_from_the_server_and_once() {
        let queue = asked();
        for from in [None, Some(STRANGER)] {
            queue.put(2, from, 10, "forged");
            assert_eq!((queue.take(2), queue.pending()), (None, 2));
        }
        queue.put(3, Some(SERVER), 10, "unasked");
        assert_eq!(queue.gauge().dropped(), 3);
        queue.put(2, Some(SERVER), 10, "right");
        queue.put(2, Some(SERVER), 10, "again");
        assert_eq!((queue.gauge().bytes(), queue.gauge().dropped()), (10, 4));
        assert_eq!((queue.take(2), queue.take(2)), (Some(Ok("right")), None));
        assert_eq!((queue.gauge().bytes(), queue.pending()), (0, 1));
    }

    #[test]
    fn a_call_whose_request_was_not_sent_waits_for_no_reply() {
        let queue = asked();
        queue.begin(6, true);
        queue.cancel(6);
        queue.begin(6, false);
        queue.put(6, Some(SERVER), 10, "to the command of the same number");
        assert_eq!((queue.take(2), queue.gauge().bytes()), (None, 0));
    }

    #[test]
    fn only_the_awaited_reply_is_kept() {
        let queue = asked();
        queue.put(1, Some(SERVER), 10, "to a command");
        assert_eq!((queue.gauge().bytes(), queue.pending()), (0, 1));
        queue.finish(2);
        queue.put(2, Some(SERVER), 10, "late");
        assert_eq!((queue.gauge().bytes(), queue.pending()), (0, 0));
        queue.begin(4, true);
        queue.put(4, Some(SERVER), 10, "in time");
        queue.finish(4);
        assert_eq!((queue.gauge().bytes(), queue.take(4)), (0, None));
    }

    #[test]
    fn each_call_has_its_own_reply() {
        let queue = asked();
        queue.begin(3, true);
        queue.put(3, Some(SERVER), 60, "third");
        queue.put(2, Some(SERVER), 60, "second");
        let error = queue.take(2).expect("a result").expect_err("no room");
        assert!(error.contains("60 bytes"), "{error}");
        assert_eq!(
            (queue.gauge().bytes(), queue.take(3)),
            (60, Some(Ok("third")))
        );
        assert_eq!((queue.gauge().bytes(), queue.take(3)), (0, None));
    }

    #[test]
    fn a_reply_without_room_is_an_error() {
        let queue = asked();
        queue.put(2, Some(SERVER), 101, "large");
        let error = queue.take(2).expect("a result").expect_err("no room");
        assert!(
            error.contains("101 bytes") && error.contains("queue_mib"),
            "{error}"
        );
        assert_eq!(queue.gauge().bytes(), 0);
    }

    #[test]
    fn requests_end_with_their_server() {
        let queue = asked();
        queue.set_server(SERVER);
        assert_eq!(queue.pending(), 2);
        queue.set_server(STRANGER);
        queue.put(2, Some(SERVER), 10, "of the last server");
        assert_eq!((queue.take(2), queue.pending()), (None, 0));
        queue.begin(5, false);
        queue.expire(Duration::ZERO);
        assert_eq!(queue.pending(), 0);
    }
}
