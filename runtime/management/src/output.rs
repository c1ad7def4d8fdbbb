//! Bytes that wait until the other side reads.

use std::io::{self, ErrorKind, Write};

/// The output queue of one connection. Whoever owns the queue bounds it: see [`Output::len`].
#[derive(Debug, Default)]
pub struct Output(Vec<u8>);

impl Output {
    /// Appends bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// How many bytes wait.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Forgets what waits.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Writes to a stream that does not block, until all is written or the stream is full.
    pub fn write(&mut self, mut stream: impl Write) -> io::Result<()> {
        let mut written = 0;
        let result = loop {
            if written == self.0.len() {
                break Ok(());
            }
            match stream.write(&self.0[written..]) {
                Ok(0) => break Err(ErrorKind::WriteZero.into()),
                Ok(count) => written += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break Ok(()),
                Err(error) => break Err(error),
            }
        };
        self.0.drain(..written);
        result
    }
}
