//! Time stamps of samples: DDS stamps with the wall clock, headers hold the monotonic clock.

use rc_middleware::{Encoding, Header, now};
use rustix::time::{ClockId, clock_gettime};
use std::time::Duration;

/// The header of a received sample. `stamp` is in nanoseconds since 1970; `type_hash` is 0 if the
/// sender announces none.
pub fn header(sequence: u64, stamp: i64, sender: u128, type_hash: u64) -> Header {
    Header {
        type_hash,
        sequence,
        sent: sent(stamp),
        encoding: Encoding::Cdr,
        sender,
    }
}

/// Nanoseconds since 1970.
fn wall_clock() -> i64 {
    let time = clock_gettime(ClockId::Realtime);
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

/// The DDS time stamp, in nanoseconds since 1970, for a time of the monotonic clock; 0 means now.
pub fn stamp(sent: u64) -> i64 {
    let age = match sent {
        0 => 0,
        sent => now().saturating_sub(sent),
    };
    wall_clock() - age as i64
}

/// The age of a sample with this time stamp; zero for a stamp in the future.
pub fn age(stamp: i64) -> Duration {
    let age = wall_clock().saturating_sub(stamp);
    Duration::from_nanos(u64::try_from(age).unwrap_or(0))
}

/// The time of the monotonic clock for a DDS time stamp. By the clock of another machine, it may be
/// in the future.
fn sent(stamp: i64) -> u64 {
    let age = wall_clock().saturating_sub(stamp);
    if age < 0 {
        now().saturating_add(age.unsigned_abs())
    } else {
        now().saturating_sub(age.unsigned_abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stamps_convert_both_ways() {
        let before = now();
        let there = stamp(before);
        let back = sent(there);
        assert!(back <= now());
        // By the clock of another machine, it is sent in an hour.
        let ahead = sent(there + 3_600_000_000_000);
        assert!(ahead > now());
        assert!(ahead.abs_diff(back + 3_600_000_000_000) < 60_000_000_000);
    }
}
