//! A time limit on everything that starts. A process that was killed at the wrong moment can leave a file half
//! made, on which iceoryx2 then waits, in the worst case for ever; so what opens runs on a thread of its own,
//! and that thread is given up when the limit has passed.

use crate::session::Session;
use rc_middleware::{Endpoint, OpenError};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

/// How long one opening may take.
const LIMIT: Duration = Duration::from_secs(5);

/// Opens one end with `work`.
pub(crate) fn open<T: Send + 'static>(
    session: &Arc<Session>,
    endpoint: &Endpoint,
    work: fn(&Arc<Session>, &Endpoint) -> Result<T, OpenError>,
) -> Result<T, OpenError> {
    let (own_session, own_endpoint) = (Arc::clone(session), endpoint.clone());
    run(endpoint.address.as_str(), move || {
        work(&own_session, &own_endpoint)
    })
}

/// Runs `work`, at most for the limit.
pub(crate) fn run<T: Send + 'static>(
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
            "iceoryx2 does not come back within {LIMIT:?}: a process that was killed while it started may have left a \
             file half made; stop the network (`rcdeploy down` wipes it), then start again"
        ))),
        Err(RecvTimeoutError::Disconnected) => Err(failed("iceoryx2 panicked".to_owned())),
    }
}
