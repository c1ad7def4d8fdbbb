//! Messages of the Language Server Protocol (3.17, base protocol): a header with a length, then JSON.
//!
//! The crate `lsp-server` was tried: it allocates as much as the header says, so one line of a
//! client can end the server.

use serde_json::{Value, json};
use std::io::{self, BufRead, Write};

/// The longest message in bytes, and the longest header.
const LONGEST: usize = 16 << 20;
const LONGEST_HEADER: u64 = 4096;

/// Reads a message, or the reason why it is none that can be answered. `None` at the end of the input.
///
/// # Errors
/// The input is none of the protocol, or the system refuses to read it.
pub(super) fn read(input: &mut impl BufRead) -> io::Result<Option<Result<Value, String>>> {
    let Some(length) = header(input)? else {
        return Ok(None);
    };
    if length > LONGEST as u64 {
        let skipped = io::copy(&mut io::Read::take(&mut *input, length), &mut io::sink())?;
        if skipped < length {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let reason = format!("a message has {length} bytes, more than {LONGEST}");
        return Ok(Some(Err(reason)));
    }
    let mut body = vec![0; usize::try_from(length).map_err(|e| invalid(e.to_string()))?];
    input.read_exact(&mut body)?;
    let message = serde_json::from_slice(&body);
    Ok(Some(message.map_err(|e| e.to_string())))
}

/// The length of the next message.
fn header(input: &mut impl BufRead) -> io::Result<Option<u64>> {
    let mut length = None;
    let mut left = LONGEST_HEADER;
    loop {
        let mut line = Vec::new();
        let read = io::Read::take(&mut *input, left).read_until(b'\n', &mut line)?;
        left = left.saturating_sub(read as u64);
        if read == 0 && length.is_none() && left == LONGEST_HEADER {
            return Ok(None);
        }
        if line.last() != Some(&b'\n') {
            return Err(invalid("a header has no end".to_owned()));
        }
        let line = String::from_utf8_lossy(&line);
        let line = line.trim_end();
        if line.is_empty() {
            let missing = || invalid("a header without Content-Length".to_owned());
            return length.map(Some).ok_or_else(missing);
        }
        let field = line
            .split_once(':')
            .map(|(name, value)| (name.trim(), value.trim()));
        if let Some((name, value)) = field
            && name.eq_ignore_ascii_case("Content-Length")
        {
            let number = value.parse();
            length = Some(number.map_err(|_| invalid(format!("no length: {line}")))?);
        }
    }
}

fn invalid(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

/// Writes a message.
///
/// # Errors
/// The system refuses it.
pub(super) fn write(output: &mut impl Write, mut message: Value) -> io::Result<()> {
    message["jsonrpc"] = json!("2.0");
    let body = message.to_string();
    write!(output, "Content-Length: {}\r\n\r\n{body}", body.len())?;
    output.flush()
}
