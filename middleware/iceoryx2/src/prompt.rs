//! Opens a port again that a stopped process may have opened half.
//!
//! The file of a connection is created by the end that comes first, and iceoryx2 (0.10.0) neither looks
//! whether it is still there nor tries a connection again that failed. If a process is stopped while it
//! creates one, the file counts as abandoned after [`CREATION`] and is removed. The other end then creates
//! another file with the same name, so both are connected to nobody, for ever; or it gives up after the
//! same time, and has no connection. In each case the opening takes at least that long. A port that is
//! opened again has another id, and so other files.

use crate::incomplete_files::CREATION;
use std::time::Instant;

/// Openings of one port. On a machine that is so slow, the last one is taken as it is.
const ATTEMPTS: u32 = 4;

/// Opens a port, and again if that took so long that its connections may be lost.
pub(crate) fn open<T, E>(mut open: impl FnMut() -> Result<T, E>) -> Result<T, E> {
    for _ in 1..ATTEMPTS {
        let start = Instant::now();
        let port = open()?;
        if start.elapsed() < CREATION {
            return Ok(port);
        }
        drop(port);
    }
    open()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_whose_opening_was_held_up_is_opened_again() {
        let mut openings = 0;
        let port = open(|| {
            openings += 1;
            if openings == 1 {
                std::thread::sleep(CREATION);
            }
            Ok::<_, ()>(openings)
        });
        assert_eq!(port, Ok(2));
        assert_eq!(open(|| Err::<(), _>("refused")), Err("refused"));
    }
}
