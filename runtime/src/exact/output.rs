//! The thread that writes an exact recording. Neither a slow nor a full disk delays the worker:
//! then the recording ends, and the log says so.

use std::io::{self, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// From this size on, in bytes, what waits is written at once.
const BLOCK: usize = 64 * 1024;
/// The most bytes that wait for the disk.
const QUEUE: usize = 64 * 1024 * 1024;
/// How long something waits for more, at most.
const FLUSH: Duration = Duration::from_millis(500);
/// The longest recording, in bytes.
pub(super) const LONGEST: u64 = 4 << 30;

/// The thread, and what waits for it.
#[derive(Debug)]
pub(super) struct Output {
    queue: Arc<Queue>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Queue {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Waiting {
    bytes: Vec<u8>,
    /// No more bytes come.
    is_over: bool,
    /// No more bytes are written.
    has_ended: bool,
}

impl Queue {
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for bytes, and takes them. `None` at the end.
    fn take(&self) -> Option<Vec<u8>> {
        let is_early = |waiting: &mut Waiting| !waiting.is_over && waiting.bytes.len() < BLOCK;
        let waited = self
            .changed
            .wait_timeout_while(self.waiting(), FLUSH, is_early);
        let (mut waiting, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if waiting.bytes.is_empty() && waiting.is_over {
            return None;
        }
        Some(std::mem::take(&mut waiting.bytes))
    }

    /// Takes no more bytes.
    fn end(&self) {
        let mut waiting = self.waiting();
        waiting.has_ended = true;
        waiting.bytes = Vec::new();
    }
}

impl Output {
    /// Writes into `file`, at most `longest` bytes; `close` writes what belongs at the end of a
    /// recording that has become too long.
    pub(super) fn begin(
        mut file: impl Write + Send + 'static,
        longest: u64,
        close: fn(&mut Vec<u8>),
    ) -> io::Result<Self> {
        let queue = Arc::new(Queue::default());
        let taken = Arc::clone(&queue);
        let thread = std::thread::Builder::new().name("exact".to_owned());
        let thread = thread.spawn(move || {
            let mut written = 0;
            while let Some(bytes) = taken.take() {
                written += bytes.len() as u64;
                let mut result = file.write_all(&bytes);
                if result.is_ok() && written >= longest {
                    let mut end = Vec::new();
                    close(&mut end);
                    result = file.write_all(&end);
                    tracing::error!(
                        "the exact recording ends: it has {} MiB, which is the limit",
                        longest >> 20
                    );
                    taken.end();
                }
                if let Err(error) = result {
                    tracing::error!("the exact recording ends: it cannot be written: {error}");
                    taken.end();
                }
                if taken.waiting().has_ended {
                    return;
                }
            }
        })?;
        Ok(Self {
            queue,
            thread: Some(thread),
        })
    }

    /// Appends bytes. `false`: the recording has ended.
    pub(super) fn push(&self, append: impl FnOnce(&mut Vec<u8>)) -> bool {
        let mut waiting = self.queue.waiting();
        if waiting.has_ended {
            return false;
        }
        append(&mut waiting.bytes);
        if waiting.bytes.len() > QUEUE {
            drop(waiting);
            tracing::error!(
                "the exact recording ends: the disk is slower than the component, and {} MiB wait for it",
                QUEUE >> 20
            );
            self.queue.end();
            return false;
        }
        if waiting.bytes.len() >= BLOCK {
            drop(waiting);
            self.queue.changed.notify_one();
        }
        true
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        let mut waiting = self.queue.waiting();
        waiting.is_over = true;
        let has_ended = waiting.has_ended;
        drop(waiting);
        self.queue.changed.notify_one();
        // A recording that has ended early may be in the middle of a write to a slow disk, for
        // which the component does not wait.
        if let Some(thread) = self.thread.take().filter(|_| !has_ended) {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Sender, channel};

    /// Only a fault lets it pass.
    const LIMIT: Duration = Duration::from_mins(1);

    struct Told(Sender<Vec<u8>>);

    impl Write for Told {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let sent = self.0.send(bytes.to_vec());
            sent.map_err(|_| io::Error::other("no test"))?;
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn close(out: &mut Vec<u8>) {
        out.push(b'.');
    }

    #[test]
    fn a_few_bytes_are_written_although_no_more_follow() {
        let (told, written) = channel();
        let output = Output::begin(Told(told), LONGEST, close).expect("a thread");
        assert!(output.push(|out| out.extend(b"turn")));
        assert_eq!(written.recv_timeout(LIMIT).expect("to be written"), b"turn");
        assert!(output.push(|out| out.extend(b"last")));
        drop(output);
        assert_eq!(written.recv_timeout(LIMIT).expect("to be written"), b"last");
    }

    #[test]
    fn a_recording_has_a_limit_and_an_end() {
        let (told, written) = channel();
        let output = Output::begin(Told(told), 2 * BLOCK as u64, close).expect("a thread");
        let mut pushed = 0;
        while output.push(|out| out.extend([7; 1024])) {
            pushed += 1;
            assert!(pushed < 1_000_000, "it does not end");
            std::thread::yield_now();
        }
        drop(output);
        let all: Vec<u8> = written.into_iter().flatten().collect();
        assert!(all.len() > 2 * BLOCK);
        assert_eq!(all.last(), Some(&b'.'));
    }
}
