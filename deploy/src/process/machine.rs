//! Checks the requirements of a network on this machine before anything starts.

use rc_deploy_network::{Network, ros_implementation};
use rc_diagnostics::{Diagnostic, Diagnostics, Severity};

/// The implementations of ROS 2 that do not speak DDS.
pub(crate) const NOT_DDS: [&str; 2] = ["rmw_zenoh_cpp", "rmw_email_cpp"];

/// Warns once if nodes of ROS 2 in this environment do not speak DDS, as components do.
fn check_ros(network: &Network, found: &mut Diagnostics) {
    if let Some((instance, implementation)) = ros_implementation(network)
        && NOT_DDS.contains(&implementation.as_str())
    {
        let message = format!(
            "RMW_IMPLEMENTATION is {implementation}: nodes of ROS 2 in this environment do not speak DDS, \
             so they and `{}` do not find each other",
            instance.path
        );
        let warning = Diagnostic::warning("other-rmw", instance.name.span, message);
        found.push(warning.help("let the nodes run with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp"));
    }
}

/// Checks that this machine has the processors of its components, and permits their real-time
/// priorities. A forbidden priority is an error if the network is to start (`starts`), otherwise a
/// warning: another user may have more rights.
pub fn check(network: &Network, starts: bool, found: &mut Diagnostics) {
    check_ros(network, found);
    for instance in &network.deployment.instances {
        if network.deployment.remote_host(instance).is_some() {
            continue;
        }
        let name = &instance.path;
        if let Some(span) = instance.cpu_span
            && let Err(reason) = rc_scheduling::missing(&instance.cpu)
        {
            let message = format!("`{name}` cannot run there: {reason}");
            let error = Diagnostic::error("unknown-cpu", span, message);
            found.push(error.help("leave `cpu` out to run it on any"));
        }
        if let Some((priority, span)) = instance.priority
            && let Err(reason) = rc_scheduling::permits(priority)
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
