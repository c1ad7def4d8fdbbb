//! The conformance suite of backends.

use rc_middleware::{Backend, Environment, OpenError};

struct Local;

impl rc_conformance::Subject for Local {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        rc_local::connect(environment)
    }
}

rc_conformance::suite!(Local);
