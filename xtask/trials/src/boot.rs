//! `cargo xtask soak boot`: a network on a Debian that boots in namespaces, with logins over ssh.

use crate::programs::{Failure, LongTest, long_tests};
use std::time::Duration;

/// The longest time, with the download of the packages.
const LIMIT: Duration = Duration::from_mins(20);

const LONG: [LongTest; 1] = [(
    "a network outlives logins and starts at boot",
    "-p rc-deploy --test all boot::",
    &[("RC_BOOT", "1")],
)];

pub(crate) fn soak() -> Result<(), Failure> {
    long_tests(&LONG, LIMIT)
}
