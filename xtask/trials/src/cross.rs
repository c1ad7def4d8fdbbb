//! `cargo xtask soak cross`: a network that is built here for another processor, which qemu stands for.

use crate::programs::{Failure, LongTest, long_tests};
use std::time::Duration;

/// The longest time, with the build.
const LIMIT: Duration = Duration::from_hours(1);

const LONG: [LongTest; 1] = [(
    "a host of another processor runs what is built here",
    "-p rc-deploy --test all cross::",
    &[("RC_CROSS", "1")],
)];

pub(crate) fn soak() -> Result<(), Failure> {
    long_tests(&LONG, LIMIT)
}
