//! Where a client sleeps. What can end its sleep is told to the kernel once, not with every call.

use rustix::event::{Timespec, epoll};
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{BorrowedFd, OwnedFd};
use std::time::Duration;

const RING: u64 = 0;
const OTHER: u64 = 1;

/// What ends a sleep.
pub(crate) struct Waiting(OwnedFd);

impl Waiting {
    /// Sleeps until there is a ring or the component is interrupted. An interruption ends one sleep only, though its
    /// descriptor stays readable for the one who is meant.
    pub(crate) fn new(ring: BorrowedFd<'_>, interrupt: BorrowedFd<'_>) -> io::Result<Self> {
        let waiting = Self(epoll::create(epoll::CreateFlags::CLOEXEC)?);
        waiting.watch(ring, RING, epoll::EventFlags::IN)?;
        waiting.watch(
            interrupt,
            OTHER,
            epoll::EventFlags::IN | epoll::EventFlags::ET,
        )?;
        Ok(waiting)
    }

    /// Sleeps at most until `death` is readable, too; that ends when its descriptor is closed.
    pub(crate) fn until(&self, death: BorrowedFd<'_>) -> io::Result<()> {
        self.watch(death, OTHER, epoll::EventFlags::IN)
    }

    /// Sleeps, at most for `limit`; says whether there was a ring. (A signal ends it early, which harms nobody.)
    pub(crate) fn sleep(&self, limit: Duration) -> bool {
        let limit = Timespec::try_from(limit).ok();
        let mut events = [MaybeUninit::uninit(); 3];
        epoll::wait(&self.0, &mut events, limit.as_ref())
            .is_ok_and(|(events, _)| events.iter().any(|event| event.data.u64() == RING))
    }

    fn watch(
        &self,
        descriptor: BorrowedFd<'_>,
        data: u64,
        what: epoll::EventFlags,
    ) -> io::Result<()> {
        let data = epoll::EventData::new_u64(data);
        Ok(epoll::add(&self.0, descriptor, data, what)?)
    }
}
