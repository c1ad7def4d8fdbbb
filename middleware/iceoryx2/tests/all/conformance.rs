//! The conformance suite of backends.

use rc_middleware::{Backend, Environment, OpenError, RunDirectory};
use std::path::PathBuf;

struct Iceoryx2;

impl rc_conformance::Subject for Iceoryx2 {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        rc_iceoryx2::connect(environment)
    }

    /// The root folder and 16 bytes of shared memory stay. The last endpoint removes the rest.
    fn leftovers(&self, directory: &RunDirectory) -> Vec<PathBuf> {
        let mut left = rc_iceoryx2::leftovers(directory);
        left.retain(|path| !path.is_dir() && !path.to_string_lossy().ends_with("global_mgmt"));
        left
    }

    fn wipe(&self, directory: &RunDirectory) {
        let wiped = rc_iceoryx2::wipe(directory);
        // A second panic would end the program, and all tests with it.
        if !std::thread::panicking() {
            wiped.expect("to wipe");
            assert!(rc_iceoryx2::leftovers(directory).is_empty());
        }
    }
}

rc_conformance::suite!(Iceoryx2);
