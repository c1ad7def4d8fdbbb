//! The limit of open descriptors. Supervisor and guard need some for each component, often more
//! than the usual soft limit of 1024 allows. They raise it for themselves; components get the
//! user's.

use rc_deploy_client::error::Error;
use rustix::process::{Pid, Resource, Rlimit, getrlimit, prlimit, setrlimit};
use std::sync::OnceLock;

/// How many descriptors a component costs the supervisor, or with two services the guard.
const EACH: u64 = 4;
/// How many further ones there are: clients, logs, libraries.
const OTHERS: u64 = 100;

/// The limit of the user, once it was raised.
static BEFORE: OnceLock<Rlimit> = OnceLock::new();

/// Raises the limit of this process as far as the system allows. Fails if that is too low for so
/// many components of this machine.
pub(crate) fn raise(components: usize) -> Result<(), Error> {
    let before = BEFORE.get_or_init(|| getrlimit(Resource::Nofile));
    let raised = Rlimit {
        current: before.maximum,
        maximum: before.maximum,
    };
    // The new limit counts.
    let _ = setrlimit(Resource::Nofile, raised);
    let allowed = getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX);
    let needed = components as u64 * EACH + OTHERS;
    if allowed >= needed {
        return Ok(());
    }
    Err(Error::Plan(format!(
        "{components} components need {needed} open files, and the limit of this session is {allowed}; raise it with \
         `ulimit -n {needed}`, with the line `USER - nofile {needed}` in /etc/security/limits.conf and a new login, or with \
         `LimitNOFILE={needed}` of a unit"
    )))
}

/// Gives a process that was started the limit of the user.
pub(crate) fn restore(process: Pid) {
    if let Some(before) = BEFORE.get() {
        // It has ended, or keeps a limit that does no harm.
        let _ = prlimit(Some(process), Resource::Nofile, *before);
    }
}
