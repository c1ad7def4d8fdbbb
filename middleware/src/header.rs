//! The header of a message.

use std::time::Duration;

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

impl Header {
    /// `sent` of a reply to this request, whose value has this age: that of the request less the age,
    /// and at least 1, because 0 says nothing.
    pub fn sent_less(&self, age: Duration) -> u64 {
        let age = u64::try_from(age.as_nanos()).unwrap_or(u64::MAX);
        self.sent.saturating_sub(age).max(self.sent.min(1))
    }
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
    fn a_reply_with_an_old_value_still_says_when_it_was_sent() {
        let sent = |sent: u64, age| {
            Header {
                sent,
                ..Header::default()
            }
            .sent_less(age)
        };
        assert_eq!(sent(900, Duration::ZERO), 900);
        assert_eq!(sent(900, Duration::from_nanos(250)), 650);
        assert_eq!(sent(900, Duration::from_nanos(900)), 1);
        assert_eq!(sent(900, Duration::MAX), 1);
        assert_eq!(sent(0, Duration::from_nanos(250)), 0);
    }

    #[test]
    fn time_passes_between_two_samples() {
        let before = now();
        std::thread::sleep(std::time::Duration::from_millis(2));
        assert!(now() >= before + 2_000_000);
    }
}
