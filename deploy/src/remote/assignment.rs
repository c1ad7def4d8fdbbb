//! Which machines a plan needs, and which component runs on which of them.

use super::connection::Setup;
use super::host::Host;
use rc_deploy_client::logs;
use rc_deploy_network::plan::{self, Plan};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

/// The other machines of a plan, and the index of its machine for each component that runs on one
/// of them. Hosts with the same address and the same user are one machine. `services` are those
/// that each host has to hold open; `memory_pause` passes between two readings of the memory of
/// its components.
pub(crate) fn assign(
    plan: &Plan,
    services: &BTreeMap<String, String>,
    memory_pause: Duration,
    log_directory: &Path,
) -> (Vec<Host>, Vec<Option<usize>>) {
    let mut hosts: Vec<plan::Host> = Vec::new();
    let mut host_of = Vec::new();
    for component in &plan.components {
        host_of.push(component.host.as_ref().map(|host| {
            let same = |h: &plan::Host| (&h.address, &h.user) == (&host.address, &host.user);
            hosts.iter().position(same).unwrap_or_else(|| {
                hosts.push(host.clone());
                hosts.len() - 1
            })
        }));
    }
    let hosts = hosts.into_iter().enumerate().map(|(h, host)| {
        let components = plan.components.iter().zip(&host_of);
        let components = components.filter(|(_, of)| **of == Some(h));
        let files = components.flat_map(|(c, _)| c.files.iter().chain([&c.executable]));
        let mut files: Vec<_> = files.cloned().collect();
        files.sort();
        files.dedup();
        let setup = Setup {
            network: plan.network.clone(),
            files,
            services: services.get(&host.name).cloned(),
            memory_pause,
        };
        let log = logs::file(
            log_directory,
            &format!("{}-{}", logs::SUPERVISOR, host.name),
        );
        Host::new(host, setup, log)
    });
    (hosts.collect(), host_of)
}
