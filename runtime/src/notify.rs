//! Tells a service manager of the kind of systemd (`Type=notify`) how far a component is: `sd_notify(3)`.

use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;

/// How long it may take to make room: ten messages fill its queue, and a hundred components may start at once.
const PATIENCE: Duration = Duration::from_secs(3);

/// Tells it, where one listens; one that does not read is its own loss. A component that rcdeploy started has told
/// rcdeploy, whose own service manager is not meant.
pub(crate) fn tell(what: &str) {
    let path = std::env::var_os("NOTIFY_SOCKET");
    let Some(path) = path.filter(|_| std::env::var_os("RC_SUPERVISED").is_none()) else {
        return;
    };
    let address = match path.as_bytes().strip_prefix(b"@") {
        Some(name) => SocketAddr::from_abstract_name(name),
        None => SocketAddr::from_pathname(&path),
    };
    if let (Ok(address), Ok(socket)) = (address, UnixDatagram::unbound()) {
        let _ = socket.set_write_timeout(Some(PATIENCE));
        let _ = socket.send_to_addr(what.as_bytes(), &address);
    }
}
