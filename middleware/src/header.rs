//! The header of a message.

/// The header of a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// Hash of the type of the body, see `rc_idsl::canonical`; 0 from another program.
    pub type_hash: u64,
    /// Sequence number among the messages of one sender, from 1; 0 where the sender does not count.
    pub sequence: u64,
    /// Time of sending, in nanoseconds of the monotonic clock of the system; 0 if the sender does
    /// not say. It may be in the future if the clock of the sender's machine is ahead.
    pub sent: u64,
    /// Encoding of the body.
    pub encoding: Encoding,
    /// Identifies the sender; 0 if the backend cannot tell. The backend of the receiver sets it: no
    /// other sender of this connection has or had the same value. It is not transmitted.
    pub sender: u128,
}

/// Encoding of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// CDR, see [`crate::cdr`].
    #[default]
    Cdr,
    /// The memory image of a plain type, see [`crate::in_place`]. In a reply it follows the
    /// envelope.
    Image,
}

/// The current time for [`Header::sent`].
pub fn now() -> u64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_passes_between_two_samples() {
        let before = now();
        std::thread::sleep(std::time::Duration::from_millis(2));
        assert!(now() >= before + 2_000_000);
    }
}
