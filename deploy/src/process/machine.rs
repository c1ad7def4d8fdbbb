//! Checks what a network needs of this machine before anything starts.

use crate::process::realtime;
use rc_deploy_network::Network;
use rc_diagnostics::{Diagnostic, Diagnostics, Severity};

/// Checks that this machine has the processors of its components, and permits their real-time
/// priorities. A forbidden priority is an error if the network is to start (`starts`), otherwise a
/// warning: another user may have more rights.
pub fn check(network: &Network, starts: bool, found: &mut Diagnostics) {
    for instance in &network.deployment.instances {
        if network.deployment.remote_host(instance).is_some() {
            continue;
        }
        let name = &instance.path;
        if let Some(span) = instance.cpu_span
            && let Err(reason) = realtime::missing(&instance.cpu)
        {
            let message = format!("`{name}` cannot run there: {reason}");
            let error = Diagnostic::error("unknown-cpu", span, message);
            found.push(error.help("leave `cpu` out to run it on any"));
        }
        if let Some((priority, span)) = instance.priority
            && let Err(reason) = realtime::permits(priority)
        {
            let message = format!("`{name}` cannot have its priority: {reason}");
            let mut finding = Diagnostic::error("forbidden-priority", span, message);
            if !starts {
                finding.severity = Severity::Warning;
            }
            found.push(finding);
        }
    }
}
