//! `cargo xtask soak cpp`: the conformance of components in C++ under the sanitizers of the compiler, and a
//! million calls, which leave nothing in memory.

use crate::programs::{Failure, LongTest, long_tests};
use std::time::Duration;

/// The longest time of one run.
const LIMIT: Duration = Duration::from_hours(1);

const LONG: [LongTest; 3] = [
    (
        "a million calls",
        "-p rc-cpp --test conformance a_component_in_cpp_conforms_over_iceoryx2",
        &[("RC_CPP_CALLS", "1000000")],
    ),
    (
        "AddressSanitizer and UndefinedBehaviorSanitizer",
        "-p rc-cpp --test conformance over_",
        &[("RC_CPP_SANITIZE", "address,undefined")],
    ),
    (
        "ThreadSanitizer",
        "-p rc-cpp --test conformance over_",
        &[("RC_CPP_SANITIZE", "thread")],
    ),
];

pub(crate) fn soak() -> Result<(), Failure> {
    long_tests(&LONG, LIMIT)
}
