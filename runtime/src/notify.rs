//! Reports the state of a component to a service manager such as systemd (`Type=notify`):
//! `sd_notify(3)`.

use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// The limit for a place in the queue of the service manager. Ten messages fill that queue, and a
/// hundred components may start at once; without this message, the service manager would stop the
/// component again.
const READY_LIMIT: Duration = Duration::from_secs(3);

/// The state of a service.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum ServiceState {
    Ready,
    /// The component ends, and does not wait for the service manager.
    Stopping,
}

/// The components of this process that are not ready yet.
static AWAITED: AtomicUsize = AtomicUsize::new(1);

/// Lets the process be ready when this many components are.
pub(crate) fn await_components(count: usize) {
    AWAITED.store(count, Ordering::Relaxed);
}

/// Sends the state to `NOTIFY_SOCKET`, if there is one. A component that rcdeploy has started
/// reports to rcdeploy instead; the variable is then meant for rcdeploy.
pub(crate) fn notify(state: ServiceState) {
    if state == ServiceState::Ready && AWAITED.fetch_sub(1, Ordering::Relaxed) > 1 {
        return;
    }
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
