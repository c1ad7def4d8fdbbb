//! `cargo xtask soak restarts`: publishers and subscribers over shared memory that are killed and stopped while they connect.

use crate::programs::{Failure, LongTest, long_tests};
use std::time::Duration;

/// The longest time of one run.
const LIMIT: Duration = Duration::from_mins(20);

const LONG: [LongTest; 3] = [
    run(&[("RC_SEED", "7"), ("RC_SECONDS", "120")]),
    run(&[("RC_SEED", "8"), ("RC_SECONDS", "120")]),
    run(&[("RC_SEED", "9"), ("RC_SECONDS", "120")]),
];

const fn run(variables: &'static [(&'static str, &'static str)]) -> LongTest {
    (
        "all hear all after kills and stops",
        "-p rc-iceoryx2 --test all restarts::",
        variables,
    )
}

pub(crate) fn soak() -> Result<(), Failure> {
    long_tests(&LONG, LIMIT)
}
