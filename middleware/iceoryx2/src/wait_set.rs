//! Where a client sleeps. What can end its sleep is told to the kernel once, not with every call.

use rustix::event::{Timespec, epoll};
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{BorrowedFd, OwnedFd};
use std::time::Duration;

const NOTIFIED: u64 = 0;
const OTHER: u64 = 1;

/// What ends a sleep.
pub(crate) struct WaitSet(OwnedFd);

impl WaitSet {
    /// Sleeps until there is a ring or the component is interrupted. An interruption ends one sleep only, though its
    /// descriptor stays readable for the one who is meant.
    pub(crate) fn new(notified: BorrowedFd<'_>, wake_event: BorrowedFd<'_>) -> io::Result<Self> {
        let wait_set = Self(epoll::create(epoll::CreateFlags::CLOEXEC)?);
        wait_set.add(notified, NOTIFIED, epoll::EventFlags::IN)?;
        wait_set.add(
            wake_event,
            OTHER,
            epoll::EventFlags::IN | epoll::EventFlags::ET,
        )?;
        Ok(wait_set)
    }

    /// Sleeps at most until `death` is readable, too; that ends when its descriptor is closed.
    pub(crate) fn add_death(&self, death: BorrowedFd<'_>) -> io::Result<()> {
        self.add(death, OTHER, epoll::EventFlags::IN)
    }

    /// Sleeps, at most for `limit`; says whether there was a ring. (A signal ends it early, which harms nobody.)
    pub(crate) fn sleep(&self, limit: Duration) -> bool {
        let limit = Timespec::try_from(limit).ok();
        let mut events = [MaybeUninit::uninit(); 3];
        epoll::wait(&self.0, &mut events, limit.as_ref())
            .is_ok_and(|(events, _)| events.iter().any(|event| event.data.u64() == NOTIFIED))
    }

    fn add(
        &self,
        descriptor: BorrowedFd<'_>,
        data: u64,
        what: epoll::EventFlags,
    ) -> io::Result<()> {
        let data = epoll::EventData::new_u64(data);
        Ok(epoll::add(&self.0, descriptor, data, what)?)
    }
}
