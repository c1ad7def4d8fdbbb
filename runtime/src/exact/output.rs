//! The thread that writes an exact recording. Neither a slow nor a full disk delays the worker:
//! then the recording ends, and the log says so. It ends before the disk is full.

use rc_files::{Disk, DiskChange};
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// From this size on, in bytes, what waits is written at once.
const BLOCK: usize = 64 * 1024;
/// The most bytes that wait for the disk.
const QUEUE: usize = 64 * 1024 * 1024;
/// How long data wait for more, at most.
const FLUSH: Duration = Duration::from_millis(500);
/// The longest recording, in bytes.
pub(super) const LONGEST: u64 = 4 << 30;

/// The file of a recording.
pub(super) trait Target: Write + Send + 'static {
    /// Truncates to the first bytes. Later writes follow them.
    fn cut(&mut self, length: u64) -> io::Result<()>;
}

impl Target for File {
    fn cut(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)?;
        self.seek(SeekFrom::Start(length)).map(drop)
    }
}

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
    /// Writes into `file`, at most `longest` bytes, while `disk` is not full, of which so many bytes
    /// are `free`. `close` writes what belongs at the end of a recording that ends early.
    pub(super) fn begin(
        mut file: impl Target,
        longest: u64,
        mut disk: Disk,
        free: impl Fn() -> u64 + Send + 'static,
        close: fn(&mut Vec<u8>),
    ) -> io::Result<Self> {
        let queue = Arc::new(Queue::default());
        let taken = Arc::clone(&queue);
        let thread = std::thread::Builder::new().name("exact".to_owned());
        let thread = thread.spawn(move || {
            let mut end = Vec::new();
            close(&mut end);
            let mut written = 0;
            while let Some(bytes) = taken.take() {
                let length = bytes.len() as u64;
                let reason = if let Some(DiskChange::Full { .. }) = disk.look(free()) {
                    let kept = disk.floor() >> 20;
                    format!("its disk has less than {kept} MiB free, which are kept (--keep-free)")
                } else if written + length + end.len() as u64 > longest {
                    format!("it has {} MiB, which is the limit", written >> 20)
                } else if let Err(error) = file.write_all(&bytes) {
                    format!("it cannot be written: {error}")
                } else {
                    written += length;
                    continue;
                };
                tracing::error!("the exact recording ends: {reason}");
                taken.end();
                // A file that is full holds whole turns, and an end if that has room.
                // Nothing has begun on a disk that was full before.
                let whole = file.cut(written);
                if whole.is_ok() && written > 0 && file.write_all(&end).is_err() {
                    let _ = file.cut(written);
                }
                return;
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
    use std::collections::VecDeque;
    use std::sync::mpsc::{Sender, channel};
    use std::time::Instant;

    /// Only a fault lets it pass.
    const LIMIT: Duration = Duration::from_mins(1);

    /// Reports the written data, and that they are cut.
    struct ReportedWrites(Sender<Vec<u8>>);

    impl Target for ReportedWrites {
        fn cut(&mut self, _: u64) -> io::Result<()> {
            Ok(())
        }
    }

    impl Write for ReportedWrites {
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
        let output = Output::begin(ReportedWrites(told), LONGEST, Disk::new(0), || 0, close);
        let output = output.expect("a thread");
        assert!(output.push(|out| out.extend(b"turn")));
        assert_eq!(written.recv_timeout(LIMIT).expect("to be written"), b"turn");
        assert!(output.push(|out| out.extend(b"last")));
        drop(output);
        assert_eq!(written.recv_timeout(LIMIT).expect("to be written"), b"last");
    }

    #[test]
    fn a_recording_has_a_limit_and_an_end() {
        let (told, written) = channel();
        let longest = 2 * BLOCK as u64 + 1;
        let output = Output::begin(ReportedWrites(told), longest, Disk::new(0), || 0, close);
        let output = output.expect("a thread");
        let block = || output.push(|out| out.resize(BLOCK, 7));
        for _ in 0..2 {
            assert!(block());
            assert_eq!(written.recv_timeout(LIMIT).map(|it| it.len()), Ok(BLOCK));
        }
        assert!(block());
        assert_eq!(written.recv_timeout(LIMIT), Ok(b".".to_vec()));
        assert!(!block());
        drop(output);
        assert!(written.recv().is_err(), "nothing follows the end");
    }

    /// A file on a disk with so much room.
    struct Full {
        file: File,
        room: usize,
    }

    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let fits = bytes.len().min(self.room);
            if fits == 0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            let written = self.file.write(&bytes[..fits])?;
            self.room -= written;
            Ok(written)
        }

        fn flush(&mut self) -> io::Result<()> {
            self.file.flush()
        }
    }

    impl Target for Full {
        fn cut(&mut self, length: u64) -> io::Result<()> {
            self.room += (self.file.metadata()?.len() - length) as usize;
            self.file.cut(length)
        }
    }

    #[test]
    fn a_file_on_a_full_disk_holds_whole_turns_and_an_end() {
        let file = tempfile::tempfile().expect("a file");
        let target = Full {
            file: file.try_clone().expect("the file"),
            room: BLOCK + BLOCK / 2,
        };
        let output = Output::begin(target, LONGEST, Disk::new(0), || 0, close);
        let output = output.expect("a thread");
        // Data without room are not part of the file.
        for expected in [BLOCK, BLOCK + 1] {
            assert!(output.push(|out| out.resize(BLOCK, 7)));
            let begun = Instant::now();
            while file.metadata().expect("the file").len() as usize != expected {
                assert!(begun.elapsed() < LIMIT, "it is never {expected} long");
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        let mut last = [0; 2];
        let at = BLOCK as u64 - 1;
        std::os::unix::fs::FileExt::read_exact_at(&file, &mut last, at).expect("to read");
        assert_eq!(&last, b"\x07.");
        drop(output);
    }

    /// The output while `free` bytes are free at successive checks of the disk.
    fn written_with(free: &[u64]) -> Vec<u8> {
        let (told, written) = channel();
        let looks = Mutex::new(free.iter().copied().collect::<VecDeque<u64>>());
        let free = move || {
            let mut looks = looks.lock().expect("no panic");
            looks
                .pop_front()
                .expect("it looks no more once it has ended")
        };
        let output = Output::begin(ReportedWrites(told), LONGEST, Disk::new(100), free, close);
        let output = output.expect("a thread");
        let begun = Instant::now();
        while output.push(|out| out.resize(out.len() + BLOCK, 7)) {
            assert!(begun.elapsed() < LIMIT, "it does not end");
            std::thread::sleep(Duration::from_millis(1));
        }
        drop(output);
        written.into_iter().flatten().collect()
    }

    #[test]
    fn a_recording_ends_before_its_disk_is_full() {
        let all = written_with(&[500, 100, 99]);
        assert!(all.len() > 2 * BLOCK);
        assert_eq!(
            all.iter().position(|byte| *byte == b'.'),
            Some(all.len() - 1)
        );
        assert_eq!(
            written_with(&[99]),
            b"",
            "an empty file replaces no recording"
        );
    }
}
