//! Reads and writes with limits during the setup, when each side waits for the other.

use super::{BEAT, STEP_LIMIT};
use rc_management::lines;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde::Serialize;
use std::io::{self, BufRead, BufReader, Read, Take, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::time::Instant;

/// The longest line of the setup: it names all files and services of a network.
pub(crate) const LONGEST: u64 = 64 << 20;

/// Says when the other side, which waits, has to hear something.
#[derive(Debug)]
pub(crate) struct Beat(Instant);

impl Beat {
    pub(crate) fn new() -> Self {
        Self(Instant::now() + BEAT)
    }

    /// Sends a heartbeat if one is due.
    pub(crate) fn send_due(
        &mut self,
        message: &impl Serialize,
        out: &mut impl Write,
    ) -> io::Result<()> {
        let now = Instant::now();
        if now < self.0 {
            return Ok(());
        }
        self.0 = now + BEAT;
        out.write_all(&lines::encode(message))
    }
}

/// A non-blocking stream. A read or write waits at most [`STEP_LIMIT`] for the next byte.
#[derive(Debug)]
pub(crate) struct TimedStream(pub(crate) OwnedFd);

impl TimedStream {
    fn wait(&self, flags: PollFlags) -> io::Result<()> {
        let limit = Timespec::try_from(STEP_LIMIT).ok();
        let mut polled = [PollFd::from_borrowed_fd(self.0.as_fd(), flags)];
        match poll(&mut polled, limit.as_ref()) {
            Ok(0) => Err(io::Error::new(
                io::ErrorKind::TimedOut,
                format!("nothing came for {STEP_LIMIT:?}"),
            )),
            Ok(_) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }
}

impl Read for TimedStream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            self.wait(PollFlags::IN)?;
            match rustix::io::read(&self.0, &mut *buffer) {
                Err(rustix::io::Errno::AGAIN) => {}
                count => return Ok(count?),
            }
        }
    }
}

impl Write for TimedStream {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        loop {
            self.wait(PollFlags::OUT)?;
            match rustix::io::write(&self.0, buffer) {
                Err(rustix::io::Errno::AGAIN) => {}
                written => return Ok(written?),
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// One line without its end. An error has the part of the line that was read.
pub(crate) fn read_line(input: &mut BufReader<TimedStream>) -> Result<String, (String, io::Error)> {
    let mut line = Vec::new();
    let read = input.by_ref().take(LONGEST).read_until(b'\n', &mut line);
    let is_whole = line.pop_if(|last| *last == b'\n').is_some();
    let text = String::from_utf8_lossy(&line).into_owned();
    match read {
        Err(error) => Err((text, error)),
        Ok(_) if is_whole => Ok(text),
        Ok(_) => Err((text, io::ErrorKind::UnexpectedEof.into())),
    }
}

/// The next `size` bytes, and no more.
pub(crate) fn bytes(
    input: &mut BufReader<TimedStream>,
    size: u64,
) -> Take<&mut BufReader<TimedStream>> {
    input.take(size)
}
