//! The wait set of a client. The kernel learns its descriptors once, not with every call.

use rustix::event::{Timespec, epoll};
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::time::Duration;

const NOTIFIED: u64 = 0;
const OTHER: u64 = 1;

/// An epoll instance.
pub(crate) struct WaitSet(OwnedFd);

impl WaitSet {
    /// Waits for `notified` and for the wake event of the component. The wake event is
    /// edge-triggered: it ends one sleep, though its descriptor stays readable for the event loop.
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

    /// Waits for `death`, too, until that descriptor is closed.
    pub(crate) fn add_death(&self, death: BorrowedFd<'_>) -> io::Result<()> {
        self.add(death, OTHER, epoll::EventFlags::IN)
    }

    /// Sleeps for at most `limit`. Returns whether a notification is pending. A signal may end the
    /// sleep early.
    pub(crate) fn sleep(&self, limit: Duration) -> bool {
        let limit = Timespec::try_from(limit).ok();
        let mut events = [MaybeUninit::uninit(); 3];
        epoll::wait(&self.0, &mut events, limit.as_ref())
            .is_ok_and(|(events, _)| events.iter().any(|event| event.data.u64() == NOTIFIED))
    }

    /// Readable when a sleep would end.
    pub(crate) fn descriptor(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
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
