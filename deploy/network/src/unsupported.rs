//! Fields of a description that have no effect in this version.

use crate::model::Network;
use rc_diagnostics::{Diagnostic, Diagnostics};

impl Network {
    /// Warns of each field that is read and checked, but changes nothing yet.
    pub(crate) fn warn_of_what_has_no_effect(&self, found: &mut Diagnostics) {
        for instance in &self.deployment.instances {
            if let Some((_, span)) = instance.endpoint {
                let message = "`endpoint` is read, but this version does not support it yet; it has no effect";
                found.push(Diagnostic::warning("not-supported-yet", span, message));
            }
        }
    }
}
