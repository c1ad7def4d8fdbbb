//! The shared-memory services of a network, which the guard holds open.
//!
//! A process that is killed while it creates a service can leave it half made, so that nobody can
//! open it. A service that is held open stays whole. The guard creates the services of a component
//! before the component starts, with the greatest depth of their endpoints, so that these may come
//! in any order.

use crate::model::Network;
use rc_cdsl::model::Role;
use rc_ddsl::Endpoint as End;
use rc_ddsl::model::{Host, Instance};
use rc_idsl::canonical::{interface_hash, operation_hash};
use rc_middleware::{Durability, Qos, network_time};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Service {
    /// Address of the service.
    pub address: String,
    /// The name of its types.
    pub types: String,
    /// Their hash.
    pub hash: u64,
    /// Whether it is a topic. Otherwise it is called.
    pub topic: bool,
    /// For a topic: how many samples its receivers hold.
    pub depth: u32,
    /// For a topic: whether late subscribers get the last sample.
    pub keeps: bool,
    /// The names of the components with an endpoint of it, each once.
    pub users: Vec<String>,
}

impl Service {
    /// The services on the default middleware that a machine needs (`None`: this machine), sorted
    /// by address.
    pub fn all(network: &Network, host: Option<&Host>) -> Vec<Self> {
        let mut services: BTreeMap<String, Self> = BTreeMap::new();
        for (End { instance, slot }, address) in network.addresses.iter() {
            let user = &network.deployment.instances[instance];
            if !is_on(network, user, host) {
                continue;
            }
            let Some(project) = network.projects.get(instance).and_then(Option::as_ref) else {
                continue;
            };
            let over = network.middlewares(End { instance, slot });
            if !over.iter().any(|one| one.can().shares_memory) {
                continue;
            }
            let (library, slot) = (&project.component.library, &project.component.slots[slot]);
            let path = library.interface_path(slot.interface);
            let user = &user.path;
            let uses = |service: &mut Self| {
                if !service.users.contains(user) {
                    service.users.push(user.clone());
                }
            };
            if !slot.role.is_topic() {
                let hash = interface_hash(library, slot.interface);
                let service = services.entry(address.to_owned()).or_insert_with(|| Self {
                    address: address.to_owned(),
                    types: path,
                    hash,
                    topic: false,
                    depth: 0,
                    keeps: false,
                    users: Vec::new(),
                });
                uses(service);
                continue;
            }
            for operation in &library.interface(slot.interface).operations {
                let name = &operation.name.text;
                let address = format!("{address}/{name}");
                let service = services.entry(address.clone()).or_insert_with(|| Self {
                    address,
                    types: format!("{path}/{name}"),
                    hash: operation_hash(library, slot.interface, operation),
                    topic: true,
                    depth: 0,
                    keeps: false,
                    users: Vec::new(),
                });
                uses(service);
                service.depth = service.depth.max(slot.whole_qos().depth);
                service.keeps |= slot.role == Role::Publishes
                    && slot.whole_qos().durability == Durability::TransientLocal;
            }
        }
        add_time(network, host, &mut services);
        services.into_values().collect()
    }

    /// For each other machine by name, its services on the default middleware as JSON, see
    /// [`Self::all`].
    pub fn elsewhere(network: &Network) -> BTreeMap<String, String> {
        let instances = network.deployment.instances.iter();
        let hosts = instances.filter_map(|instance| network.deployment.remote_host(instance));
        let services = |host: &Host| {
            // This cannot fail, because keys are strings.
            let text = serde_json::to_string(&Self::all(network, Some(host)));
            (host.name.text.clone(), text.unwrap_or_default())
        };
        hosts.map(services).collect()
    }
}

/// Adds the services by which time travels on a machine.
fn add_time(network: &Network, host: Option<&Host>, services: &mut BTreeMap<String, Service>) {
    let Some(time) = &network.time else { return };
    let mut followers = time.followers.iter();
    let source = &network.deployment.instances[time.source];
    if !is_on(network, source, host) || !followers.any(|(_, backend)| backend.can().shares_memory) {
        return;
    }
    let Ok(address) = network_time::address(network.name()) else {
        return;
    };
    let (topic, calls) = (network_time::topic_types(), network_time::call_types());
    let depth = Qos::PUBLISHER.depth;
    let followers = time.followers.iter();
    let users = followers.filter(|(_, backend)| backend.can().shares_memory);
    let users = users.map(|(at, _)| *at).chain([time.source]);
    let users: Vec<String> = users
        .map(|at| network.deployment.instances[at].path.clone())
        .collect();
    for (address, types, depth) in [(address.join("tick"), topic, depth), (address, calls, 0)] {
        let service = Service {
            address: address.to_string(),
            types: types.name,
            hash: types.hash,
            topic: depth > 0,
            depth,
            keeps: false,
            users: users.clone(),
        };
        services.insert(address.to_string(), service);
    }
}

/// Whether an instance runs on a machine; `None` is this one.
fn is_on(network: &Network, instance: &Instance, host: Option<&Host>) -> bool {
    match (network.deployment.remote_host(instance), host) {
        (Some(own), Some(host)) => own.is_same(host),
        (own, host) => own.is_none() && host.is_none(),
    }
}
