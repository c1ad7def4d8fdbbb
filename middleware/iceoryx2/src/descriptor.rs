//! Descriptors of listeners, for poll and epoll.
#![expect(
    unsafe_code,
    reason = "iceoryx2 gives a listener's descriptor only as a number"
)]

use crate::ports::ListenerPort;
use iceoryx2::prelude::FileDescriptorBased;
use std::os::fd::BorrowedFd;

/// The descriptor of `listener`, readable while a notification is pending.
pub(crate) fn of(listener: &ListenerPort) -> BorrowedFd<'_> {
    // SAFETY: the number is that of the listener's socket. The listener owns the socket and closes
    // it on drop, and the result cannot outlive the borrow of the listener. This crate neither
    // reads from the socket nor closes it.
    unsafe { BorrowedFd::borrow_raw(listener.file_descriptor().native_handle()) }
}
