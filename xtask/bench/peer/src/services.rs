//! The node, its services, and waiting for a listener.
#![expect(
    unsafe_code,
    reason = "iceoryx2 gives a listener's descriptor only as a number"
)]

use iceoryx2::port::listener::Listener;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::os::fd::BorrowedFd;

/// Every error ends the program.
pub(crate) type Failure = Box<dyn std::error::Error>;
/// The single-threaded service variant.
pub(crate) type Ipc = ipc::Service;
pub(crate) type Topic = publish_subscribe::PortFactory<Ipc, [u8], Stamp>;
pub(crate) type Calls = request_response::PortFactory<Ipc, [u8], (), [u8], ()>;
pub(crate) type EventService = event::PortFactory<Ipc>;

/// The user header of a sample: the time of its sending.
pub(crate) type Stamp = i64;
/// Longest wait, as that of a generated component: iceoryx2 can swallow a notification.
const LIMIT: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 50_000_000,
};

/// Creates a node with a root and prefix of its own.
pub(crate) fn node(root: &str, prefix: &str) -> Result<Node<Ipc>, Failure> {
    set_log_level(LogLevel::Fatal);
    let mut config = Config::default();
    config.global.set_root_path(&Path::new(root.as_bytes())?);
    config.global.prefix = FileName::new(prefix.as_bytes())?;
    Ok(NodeBuilder::new()
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<Ipc>()?)
}

/// Opens the publish/subscribe service `name`.
pub(crate) fn topic(node: &Node<Ipc>, name: &str) -> Result<Topic, Failure> {
    Ok(node
        .service_builder(&name.try_into()?)
        .publish_subscribe::<[u8]>()
        .user_header::<Stamp>()
        .enable_safe_overflow(true)
        .history_size(0)
        .subscriber_max_buffer_size(10)
        .subscriber_max_borrowed_samples(5)
        .max_publishers(16)
        .max_subscribers(64)
        .max_nodes(128)
        .open_or_create()?)
}

/// Opens the request/response service `name`.
pub(crate) fn calls(node: &Node<Ipc>, name: &str) -> Result<Calls, Failure> {
    Ok(node
        .service_builder(&name.try_into()?)
        .request_response::<[u8], [u8]>()
        .enable_safe_overflow_for_requests(false)
        .enable_safe_overflow_for_responses(true)
        .max_active_requests_per_client(16)
        .max_loaned_requests(1)
        .max_response_buffer_size(1)
        .max_borrowed_responses_per_pending_response(1)
        .max_servers(1)
        .max_clients(64)
        .max_nodes(128)
        .open_or_create()?)
}

/// Opens the event service `name`.
pub(crate) fn event_service(node: &Node<Ipc>, name: &str) -> Result<EventService, Failure> {
    Ok(node
        .service_builder(&name.try_into()?)
        .event()
        .max_notifiers(64)
        .max_listeners(64)
        .max_nodes(128)
        .event_id_max_value(1)
        .open_or_create()?)
}

/// Sleeps until one of `listeners` has a notification, at most for [`LIMIT`], and clears it; after
/// [`LIMIT`] it clears what none of them shows. Bit i of the result: listener i had one.
pub(crate) fn wait<const N: usize>(listeners: [&Listener<Ipc>; N]) -> Result<u32, Failure> {
    let mut polled = listeners.map(|listener| {
        // SAFETY: the listener owns its socket and outlives the call; nothing here reads from it or
        // closes it.
        let descriptor =
            unsafe { BorrowedFd::borrow_raw(listener.file_descriptor().native_handle()) };
        PollFd::from_borrowed_fd(descriptor, PollFlags::IN)
    });
    let is_late = poll(&mut polled, Some(&LIMIT))? == 0;
    let mut notified = 0;
    for (at, (polled, listener)) in polled.iter().zip(listeners).enumerate() {
        let is_readable = !polled.revents().is_empty();
        if is_late || is_readable {
            listener.try_wait(|_| {})?;
            notified |= u32::from(is_readable) << at;
        }
    }
    Ok(notified)
}
