//! Opens an endpoint within the time limit, and again while dead endpoints occupy its places.

use crate::bounded;
use crate::session::Session;
use rc_middleware::{Endpoint, OpenError};
use rustix::process::{Resource, getrlimit};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long an opening is tried again as long as dead endpoints are removed.
const PATIENCE: Duration = Duration::from_secs(6);

/// Opens one endpoint with `work`.
pub(crate) fn open<T: Send + 'static>(
    session: &Arc<Session>,
    endpoint: &Endpoint,
    work: fn(&Arc<Session>, &Endpoint) -> Result<T, OpenError>,
) -> Result<T, OpenError> {
    let (own_session, own_endpoint) = (Arc::clone(session), endpoint.clone());
    let directory = &session.environment.directory;
    let outcome = bounded::run(directory, endpoint.address.as_str(), move || {
        let end = Instant::now() + PATIENCE;
        loop {
            match work(&own_session, &own_endpoint) {
                // Dead endpoints may occupy all places.
                Err(OpenError::Backend { .. })
                    if Instant::now() < end && own_session.clean_some() > 0 => {}
                outcome => return outcome,
            }
        }
    });
    outcome.map_err(|error| match error {
        OpenError::Backend { address, reason } => {
            let obstacles = bounded::obstacles(directory).or_else(address_space);
            let reason = match obstacles {
                Some(obstacles) => format!("{reason}; {obstacles}"),
                None => reason,
            };
            OpenError::Backend { address, reason }
        }
        error => error,
    })
}

/// The advice for a process that may not map more memory, which iceoryx2 does not give.
fn address_space() -> Option<String> {
    let limit = getrlimit(Resource::As).current? >> 10;
    Some(format!(
        "this session limits the memory that a process maps to {limit} kB; `ulimit -v unlimited` before it starts lifts that"
    ))
}
