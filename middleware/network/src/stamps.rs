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

/// The DDS time stamp of a reply to a request with the stamp `request`: that of the request less the
/// age of the value; for a value without an age, now, and never before the request. So no clocks are
/// compared.
pub fn reply_stamp(request: i64, age: Duration) -> i64 {
    /// The year 2116: no clock is that far ahead.
    const LAST: i64 = 1 << 62;
    let now = stamp(0);
    let is_time = (1..LAST).contains(&request);
    if age.is_zero() {
        return if is_time { request.max(now) } else { now };
    }
    let request = if is_time { request } else { now };
    let age = i64::try_from(age.as_nanos()).unwrap_or(i64::MAX);
    request.saturating_sub(age).max(1)
}

/// When a reply with the stamp `reply` was sent, by the monotonic clock. Its request was sent at
/// `asked`, with the stamp `request`. See [`reply_stamp`].
pub fn reply_sent((asked, request): (u64, i64), reply: i64) -> u64 {
    if reply >= request {
        return sent(reply);
    }
    let age = request.abs_diff(reply);
    asked.saturating_sub(age).max(asked.min(1))
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
    fn replies_have_ages_whatever_the_clocks() {
        // The clock of the client is an hour behind that of the server, or ahead of it.
        for ahead in [-3_600_000_000_000, 3_600_000_000_000] {
            let (asked, request) = (now(), stamp(0) + ahead);
            let of = |age| reply_sent((asked, request), reply_stamp(request, age));
            assert!(of(Duration::ZERO) >= asked, "{ahead}");
            assert_eq!(of(Duration::from_nanos(250)), asked - 250);
            assert_eq!(of(Duration::MAX), 1);
        }
        // A stranger without a clock.
        for request in [i64::MIN, 0, i64::MAX] {
            let of = |age| reply_stamp(request, age);
            assert!(of(Duration::ZERO) <= stamp(0) && of(Duration::from_secs(1)) < stamp(0));
            assert!(of(Duration::from_secs(1)) > 1, "{request}");
        }
    }

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
