//! Polls on a thread of its own: a component or a supervisor that hangs delays no message.

use std::sync::mpsc::RecvTimeoutError::Disconnected;
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::time::Duration;

/// A thread that polls, every two seconds and when it is asked to. It ends when this is dropped.
///
/// At most one result waits: the thread pauses until it is taken.
#[derive(Debug)]
pub struct Poller<T> {
    found: Receiver<T>,
    wake: Sender<()>,
}

impl<T: Send + 'static> Poller<T> {
    /// The time between two polls.
    const PAUSE: Duration = Duration::from_secs(2);

    /// Begins; the first poll is after a pause. `notify` runs after each result.
    ///
    /// # Errors
    /// The system starts no thread.
    pub fn begin(
        mut poll: impl FnMut() -> T + Send + 'static,
        mut notify: impl FnMut() + Send + 'static,
    ) -> std::io::Result<Self> {
        let (send, found) = sync_channel(1);
        let (wake, woken) = channel::<()>();
        let thread = std::thread::Builder::new().name("poll".to_owned());
        thread.spawn(move || {
            while woken.recv_timeout(Self::PAUSE) != Err(Disconnected) {
                if send.send(poll()).is_err() {
                    return;
                }
                notify();
            }
        })?;
        Ok(Self { found, wake })
    }

    /// Polls at once, or once the present poll has ended.
    pub fn poll_now(&self) {
        // The thread has ended if nobody receives.
        let _ = self.wake.send(());
    }

    /// The results since the last call.
    pub fn take(&self) -> Vec<T> {
        self.found.try_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{RecvTimeoutError, channel};

    /// Longest wait of the test.
    const LIMIT: Duration = Duration::from_secs(30);

    #[test]
    fn results_are_taken_in_order_and_the_thread_ends_with_its_owner() {
        let (notified, notifications) = channel();
        let mut number = 0;
        let poll = move || {
            number += 1;
            number
        };
        let poller = Poller::begin(poll, move || {
            let _ = notified.send(());
        })
        .expect("a thread");
        let mut taken = Vec::new();
        for _ in 0..2 {
            notifications.recv_timeout(LIMIT).expect("a result");
            taken.extend(poller.take());
        }
        assert_eq!(taken, [1, 2]);
        drop(poller);
        // The thread drops its functions when it ends.
        let mut last = notifications.recv_timeout(LIMIT);
        while last == Ok(()) {
            last = notifications.recv_timeout(LIMIT);
        }
        assert_eq!(last, Err(RecvTimeoutError::Disconnected));
    }
}
