//! What a description may say, and this version cannot do yet.

use crate::network::Network;
use rc_diagnostics::{Diagnostic, Diagnostics, Span};

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

    /// Warns of components that only other machines can run, where nothing is to be started.
    pub fn warn_of_remote_hosts(&self, found: &mut Diagnostics) {
        for (span, message) in self.remote_hosts() {
            found.push(Diagnostic::warning("not-supported-yet", span, message));
        }
    }

    /// Refuses components that only other machines can run, where all is to be started here.
    pub fn refuse_remote_hosts(&self, found: &mut Diagnostics) {
        for (span, message) in self.remote_hosts() {
            let error = Diagnostic::error("remote-host", span, message);
            found.push(error.help("leave `host` out to run it here"));
        }
    }

    fn remote_hosts(&self) -> impl Iterator<Item = (Span, String)> {
        self.deployment.instances.iter().filter_map(|instance| {
            let host = self.deployment.remote_host(instance)?;
            let (_, span) = instance.host?;
            let message = format!(
                "`{}` runs on {}, and this version starts components on this machine only",
                instance.path, host.address.text
            );
            Some((span, message))
        })
    }
}
