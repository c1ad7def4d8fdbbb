//! Whether the file of a running network has changed.

use rc_management::supervisor::NetworkStatus;
use std::path::Path;

/// A hash of the content of a file; `None` if it cannot be read.
pub fn digest(path: &Path) -> Option<String> {
    let text = rc_files::read(path).ok()?;
    Some(format!("{:016x}", rc_idsl::canonical::hash(&text)))
}

/// Sets whether the file from which the network was started has changed since.
pub(crate) fn mark_changed(status: &mut NetworkStatus) {
    status.changed = status.digest.is_some() && digest(&status.ddsl) != status.digest;
}
