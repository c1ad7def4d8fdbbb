//! Bytes that wait until the other side reads.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Write};
use std::time::Instant;

/// The output queue of one connection. It has a bound in bytes, and a message may have a deadline.
///
/// Nothing is dropped silently: after a message without room, or whose deadline has passed,
/// [`Output::write`] returns an error, and the connection is lost.
#[derive(Debug)]
pub struct Output {
    bytes: VecDeque<u8>,
    /// How many bytes may wait.
    limit: usize,
    /// How many bytes were ever written.
    written: u64,
    /// Where the messages with a deadline end, counted as `written`, and the deadlines.
    due: VecDeque<(u64, Instant)>,
    has_overflowed: bool,
}

impl Output {
    /// An empty queue in which at most `limit` bytes wait.
    pub fn up_to(limit: usize) -> Self {
        Self {
            bytes: VecDeque::new(),
            limit,
            written: 0,
            due: VecDeque::new(),
            has_overflowed: false,
        }
    }

    /// Appends a message. Without room for all of it, the next [`Output::write`] fails.
    pub fn push(&mut self, message: &[u8]) {
        if self.bytes.len() + message.len() > self.limit {
            self.has_overflowed = true;
        } else {
            self.bytes.extend(message);
        }
    }

    /// Appends a message that the other side must have taken by the deadline, with all before it.
    /// A side that takes a little now and then gains no time.
    pub fn push_until(&mut self, message: &[u8], deadline: Instant) {
        self.push(message);
        let end = self.written + self.bytes.len() as u64;
        self.due.push_back((end, deadline));
    }

    /// How many bytes wait.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// The deadline of the oldest message that has one.
    pub fn deadline(&self) -> Option<Instant> {
        self.due.front().map(|(_, deadline)| *deadline)
    }

    /// Forgets what waits.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.due.clear();
        self.has_overflowed = false;
    }

    /// Writes to a stream that does not block, until all is written or the stream is full.
    ///
    /// Errors mean that the connection is lost: those of the stream, `OutOfMemory` after a message
    /// without room, `TimedOut` after a deadline.
    pub fn write(&mut self, mut stream: impl Write) -> io::Result<()> {
        if self.has_overflowed {
            let reason = format!("it does not read: more than {} bytes wait", self.limit);
            return Err(io::Error::new(ErrorKind::OutOfMemory, reason));
        }
        while !self.bytes.is_empty() {
            match stream.write(self.bytes.as_slices().0) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => {
                    self.bytes.drain(..count);
                    self.written += count as u64;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => return Err(error),
            }
        }
        let written = self.written;
        while self.due.pop_front_if(|(end, _)| *end <= written).is_some() {}
        match self.deadline() {
            Some(deadline) if Instant::now() >= deadline => {
                let reason = "it has not read an answer in time";
                Err(io::Error::new(ErrorKind::TimedOut, reason))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::os::unix::net::UnixStream;
    use std::time::Duration;

    /// The end that writes, which does not block, and the end that reads.
    fn pair() -> (UnixStream, UnixStream) {
        let (write, read) = UnixStream::pair().expect("a pair");
        write.set_nonblocking(true).expect("a mode");
        (write, read)
    }

    #[test]
    fn what_is_queued_arrives_whole_and_in_order() {
        let (write, mut read) = pair();
        let message: Vec<u8> = (0..1_000_000_u32).map(|at| at as u8).collect();
        let mut output = Output::up_to(2 * message.len());
        output.push(&message);
        output.push(&message);
        let mut received = Vec::new();
        let mut piece = vec![0; 100_000];
        while received.len() < 2 * message.len() {
            output.write(&write).expect("a connection");
            let count = read.read(&mut piece).expect("a connection");
            received.extend_from_slice(&piece[..count]);
        }
        assert!(output.is_empty());
        assert!(received == [&message[..], &message[..]].concat());
    }

    /// A stream that a signal interrupts before each byte that it takes.
    #[derive(Default)]
    struct Interrupted {
        taken: Vec<u8>,
        is_next: bool,
    }

    impl Write for &mut Interrupted {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.is_next = !self.is_next;
            if self.is_next {
                return Err(ErrorKind::Interrupted.into());
            }
            self.taken.push(bytes[0]);
            Ok(1)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_signal_ends_no_connection() {
        let mut stream = Interrupted::default();
        let mut output = Output::up_to(100);
        output.push(b"an answer");
        output.write(&mut stream).expect("all of it");
        assert_eq!(stream.taken, b"an answer");
        assert!(output.is_empty());
    }

    #[test]
    fn a_message_without_room_ends_the_connection() {
        let (write, _read) = pair();
        let mut output = Output::up_to(10);
        output.push(b"0123456789");
        output.push(b"a");
        assert_eq!(output.len(), 10, "no part of it is queued");
        let error = output.write(&write).expect_err("no room");
        assert_eq!(error.kind(), ErrorKind::OutOfMemory);
    }

    #[test]
    fn a_reader_that_trickles_gains_no_time() {
        let (write, mut read) = pair();
        let mut output = Output::up_to(4 << 20);
        let deadline = Instant::now() + Duration::from_millis(50);
        output.push_until(&vec![b'x'; 4 << 20], deadline);
        assert_eq!(output.deadline(), Some(deadline));
        let error = loop {
            if let Err(error) = output.write(&write) {
                break error;
            }
            // It always takes something. All of it would take seconds.
            assert!(!output.is_empty(), "all was read before the deadline");
            assert_eq!(read.read(&mut [0; 1]).expect("a connection"), 1);
        };
        assert_eq!(error.kind(), ErrorKind::TimedOut);
    }

    #[test]
    fn a_message_that_was_taken_has_no_deadline() {
        let (write, mut read) = pair();
        let mut output = Output::up_to(100);
        output.push_until(b"an answer", Instant::now());
        output.write(&write).expect("it was taken at once");
        assert_eq!(output.deadline(), None);
        assert_eq!(read.read(&mut [0; 100]).expect("an answer"), 9);
    }
}
