//! Waiting for descriptors, with a limit.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::os::fd::BorrowedFd;
use std::time::Duration;

/// Waits until one of `descriptors` (at most 32) is readable, at most `limit`. A signal ends the
/// wait early. Bit i of the result is set if descriptor i is readable.
pub fn wait(descriptors: &[BorrowedFd<'_>], limit: Duration) -> u32 {
    let mut polled: Vec<PollFd<'_>> = descriptors
        .iter()
        .map(|descriptor| PollFd::from_borrowed_fd(*descriptor, PollFlags::IN))
        .collect();
    let limit = Timespec::try_from(limit).ok();
    if poll(&mut polled, limit.as_ref()).is_err() {
        return 0;
    }
    polled
        .iter()
        .zip(0..32)
        .filter(|(polled, _)| !polled.revents().is_empty())
        .fold(0, |bits, (_, bit)| bits | 1 << bit)
}
