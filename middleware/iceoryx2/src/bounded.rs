//! A time limit on everything that starts. iceoryx2 can wait for a file that a killed process left half made, until
//! that is removed (see [`incomplete_files`]), and perhaps for other things; so what opens runs on a thread of its own, and
//! that thread is given up when the limit has passed.

use crate::incomplete_files;
use crate::session::Session;
use rc_middleware::{Endpoint, OpenError, RunDirectory};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

/// How long one opening may take, with some clean-ups in between. Less than the ten seconds that `rcdeploy` waits for a
/// component, so that the reason is told.
const LIMIT: Duration = Duration::from_secs(8);

/// Opens one end with `work`.
pub(crate) fn open<T: Send + 'static>(
    session: &Arc<Session>,
    endpoint: &Endpoint,
    work: fn(&Arc<Session>, &Endpoint) -> Result<T, OpenError>,
) -> Result<T, OpenError> {
    let (own_session, own_endpoint) = (Arc::clone(session), endpoint.clone());
    let directory = &session.environment.directory;
    run(directory, endpoint.address.as_str(), move || {
        match work(&own_session, &own_endpoint) {
            // The places may all be taken by ends that are dead.
            Err(OpenError::Backend { .. }) if own_session.clean() > 0 => {
                work(&own_session, &own_endpoint)
            }
            outcome => outcome,
        }
    })
}

/// Runs `work`, at most for the limit.
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
            // The receiver is gone when the limit has passed; then the port is dropped here.
            let _ = done.send(work());
        })
        .map_err(|error| failed(format!("no thread for it: {error}")))?;
    match result.recv_timeout(LIMIT) {
        Ok(result) => result,
        Err(RecvTimeoutError::Timeout) => Err(failed(format!(
            "iceoryx2 does not come back within {LIMIT:?}; {}",
            recovery_hint(directory)
        ))),
        Err(RecvTimeoutError::Disconnected) => Err(failed("iceoryx2 panicked".to_owned())),
    }
}

/// What the dead left, and what to do, for the end of an error.
pub(crate) fn recovery_hint(directory: &RunDirectory) -> String {
    let files = incomplete_files::list(directory);
    let left = if files.is_empty() {
        "no file of the network is half made".to_owned()
    } else {
        let files: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        format!("half made, and not removed in time: {}", files.join(", "))
    };
    format!(
        "{left}; end all processes of the network (`rcdeploy down`, or by hand), then start again: the first one to \
         come removes what is left"
    )
}
