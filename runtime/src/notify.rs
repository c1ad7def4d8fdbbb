//! Tells a service manager of the kind of systemd (`Type=notify`) how far a component is: `sd_notify(3)`.

use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;

/// How long it may take to make room for the word that a component is ready, without which it would be started in
/// vain: ten messages fill the queue, and a hundred components may start at once.
const READY_LIMIT: Duration = Duration::from_secs(3);

/// What there is to tell.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum ServiceState {
    /// It runs.
    Ready,
    /// It ends, and does not wait to say so.
    Stopping,
}

/// Tells it, where one listens; one that does not read is its own loss. A component that rcdeploy started has told
/// rcdeploy, whose own service manager is not meant.
pub(crate) fn notify(state: ServiceState) {
    let path = std::env::var_os("NOTIFY_SOCKET");
    let Some(path) = path.filter(|_| std::env::var_os("RC_SUPERVISED").is_none()) else {
        return;
    };
    let address = match path.as_bytes().strip_prefix(b"@") {
        Some(name) => SocketAddr::from_abstract_name(name),
        None => SocketAddr::from_pathname(&path),
    };
    if let (Ok(address), Ok(socket)) = (address, UnixDatagram::unbound()) {
        let (text, limited) = match state {
            ServiceState::Ready => ("READY=1", socket.set_write_timeout(Some(READY_LIMIT))),
            ServiceState::Stopping => ("STOPPING=1", socket.set_nonblocking(true)),
        };
        if limited.is_ok() {
            let _ = socket.send_to_addr(text.as_bytes(), &address);
        }
    }
}
