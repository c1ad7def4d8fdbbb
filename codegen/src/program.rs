//! Programs that run for a limited time, with a limited output.

use std::io::Read;
use std::process::{Command, Stdio};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// The most bytes that a program may print: the names of a worker of many thousand lines.
const MOST: usize = 16 << 20;

/// Reads a pipe to its end, or until it is too long. The thread ends with the last writer.
fn drain(pipe: Option<impl Read + Send + 'static>) -> Receiver<Vec<u8>> {
    let (to, from) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let mut text = Vec::new();
        if let Some(pipe) = pipe {
            // The status of the program tells whether it ended early.
            let _ = pipe.take(MOST as u64 + 1).read_to_end(&mut text);
        }
        // Nothing waits any more if the program took too long.
        let _ = to.send(text);
    });
    from
}

/// The end of a program.
pub(crate) struct End {
    pub(crate) is_success: bool,
    /// Standard output.
    pub(crate) out: Vec<u8>,
    /// Standard error.
    pub(crate) said: Vec<u8>,
}

/// Runs a program to its end, with `input` as its standard input. The error says why it did not end by itself.
pub(crate) fn end_of(
    patience: Duration,
    command: &mut Command,
    input: Stdio,
) -> Result<End, String> {
    let mut child = command
        .stdin(input)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => "does not exist".to_owned(),
            _ => format!("cannot be started: {error}"),
        })?;
    let out = drain(child.stdout.take());
    let said = drain(child.stderr.take());
    let end = Instant::now() + patience;
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if Instant::now() < end => std::thread::sleep(Duration::from_millis(1)),
            Ok(None) => {
                let _ = child.kill();
                let _ = child.wait();
                return Err(format!("has not ended within {patience:?}"));
            }
            Err(error) => return Err(format!("cannot be waited for: {error}")),
        }
    };
    // A program that it started may hold the pipes longer than it lives.
    let left = || end.saturating_duration_since(Instant::now());
    let pipe = |all: &Receiver<Vec<u8>>| {
        let read = all.recv_timeout(left());
        let read =
            read.map_err(|_| "has ended, and another program keeps its output open".to_owned())?;
        if read.len() > MOST {
            return Err(format!("prints more than {} MiB", MOST >> 20));
        }
        Ok(read)
    };
    Ok(End {
        is_success: status.success(),
        out: pipe(&out)?,
        said: pipe(&said)?,
    })
}
