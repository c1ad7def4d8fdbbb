//! Holds the shared-memory services of a network open, so that no process that is killed leaves one
//! half made.

use rc_deploy_network::services::Service;
use rc_iceoryx2::Holder;
use rc_middleware::{
    Address, Durability, Endpoint, Environment, Qos, RunDirectory, Settings, TypeIdentity,
    WakeEvent,
};

/// Creates and holds the services of `network` from
/// [`Network::services`](rc_deploy_network::Network::services). A service that cannot be held is
/// reported on standard error, and the network starts without it.
pub fn hold(network: &str, services: &str) -> Option<Holder> {
    let print_error = |what: &dyn std::fmt::Display| {
        rc_deploy_client::error::print_error(format_args!("guard of {network}: {what}"));
    };
    let listed: Vec<(String, Service)> = serde_json::from_str(services)
        .inspect_err(|e| print_error(e))
        .ok()?;
    let environment = Environment {
        network: network.to_owned(),
        instance: "rcdeploy-guard".to_owned(),
        directory: RunDirectory::open(network)
            .inspect_err(|e| print_error(e))
            .ok()?,
        wake_event: WakeEvent::new().inspect_err(|e| print_error(e)).ok()?,
        settings: Settings::default(),
    };
    let mut holder = Holder::new(&environment)
        .inspect_err(|e| print_error(e))
        .ok()?;
    for (address, service) in listed {
        let Ok(address) = Address::parse(&address) else {
            continue;
        };
        let durability = if service.keeps {
            Durability::TransientLocal
        } else {
            Durability::Volatile
        };
        let endpoint = Endpoint {
            address,
            types: TypeIdentity {
                name: service.types,
                hash: service.hash,
            },
            qos: Qos {
                depth: service.depth,
                durability,
                ..Qos::PUBLISHER
            },
            external_types: Vec::new(),
        };
        let held = if service.topic {
            holder.hold_topic(&endpoint)
        } else {
            holder.hold_call(&endpoint)
        };
        if let Err(error) = held {
            print_error(&error);
        }
    }
    Some(holder)
}
