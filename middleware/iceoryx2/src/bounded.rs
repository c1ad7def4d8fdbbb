//! Time limits for openings.
//!
//! iceoryx2 can wait for a file that a killed process left incomplete until [`incomplete_files`]
//! removes it. Each opening therefore runs on a thread of its own. When the limit expires, the
//! caller gets an error and the thread is abandoned.

use crate::names::Storage;
use crate::{incomplete_files, service_files};
use rc_middleware::{OpenError, RunDirectory};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

/// Limit of one opening, clean-ups included. `rcdeploy` waits ten seconds for a component; this
/// limit is shorter, so that the component reports the reason itself.
const LIMIT: Duration = Duration::from_secs(8);

/// Runs `work` and waits for it at most until the limit.
pub(crate) fn run<T: Send + 'static>(
    directory: &RunDirectory,
    address: &str,
    work: impl FnOnce() -> Result<T, OpenError> + Send + 'static,
) -> Result<T, OpenError> {
    let failed = |reason: String| OpenError::Backend {
        address: address.to_owned(),
        reason,
    };
    let (done, result) = sync_channel(1);
    std::thread::Builder::new()
        .name("iceoryx2-open".to_owned())
        .spawn(move || {
            // After the limit nothing receives any more, and the port is dropped here.
            let _ = done.send(work());
        })
        .map_err(|error| failed(format!("no thread for the opening: {error}")))?;
    match result.recv_timeout(LIMIT) {
        Ok(result) => result,
        Err(RecvTimeoutError::Timeout) => Err(failed(format!(
            "iceoryx2 did not return within {LIMIT:?}; {}",
            recovery_hint(directory)
        ))),
        Err(RecvTimeoutError::Disconnected) => Err(failed("iceoryx2 panicked".to_owned())),
    }
}

/// Advice about files that block the network.
const START_AGAIN: &str =
    "end all processes of the network (`rcdeploy down`, or by hand), then start again";

/// The last part of an error message: files of other users in the way of the network, and what the
/// user can do; `None` if there are none.
pub(crate) fn obstacles(directory: &RunDirectory) -> Option<String> {
    let place = Storage::find(directory).ok()??;
    let foreign = service_files::foreign(&place);
    (!foreign.is_empty()).then(|| {
        let foreign = foreign.join(", ");
        format!("in its way: {foreign}; {START_AGAIN}: the network then gets other names")
    })
}

/// The last part of an error message: the incomplete files, and what the user can do.
pub(crate) fn recovery_hint(directory: &RunDirectory) -> String {
    let place = Storage::find(directory).ok().flatten();
    let files = place.as_ref().map_or_else(Vec::new, incomplete_files::list);
    let left = if files.is_empty() {
        "no file of the network is incomplete".to_owned()
    } else {
        let files: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        format!(
            "incomplete files, not removed in time: {}",
            files.join(", ")
        )
    };
    format!("{left}; {START_AGAIN}: the first process removes what is left")
}
