//! Holds the shared-memory services of a network open, so that no process that is killed leaves one
//! half made, and cleans up after processes that die.

use crate::guard::guard_process::HoldTask;
use rc_deploy_network::services::Service;
use rc_iceoryx2::Holder;
use rc_middleware::{
    Address, Durability, Endpoint, Environment, OpenError, Qos, RunDirectory, Settings,
    TypeIdentity, WakeEvent,
};
use std::fmt::Display;
use std::sync::mpsc::Receiver;

/// Creates and holds the services of `network` until `tasks` ends. A service that cannot be held is
/// reported on standard error, and the network starts without it.
pub fn hold(network: &str, tasks: &Receiver<HoldTask>, held: &dyn Fn()) {
    let print_error = |what: &dyn Display| {
        rc_deploy_client::error::print_error(format_args!("guard of {network}: {what}"));
    };
    // A network without services on this middleware has no files of it.
    let mut holder = None;
    for task in tasks {
        match task {
            HoldTask::Hold(service) => {
                if holder.is_none() {
                    holder = join(network).inspect_err(|e| print_error(&e)).ok();
                }
                if let Some(holder) = &mut holder
                    && let Err(error) = create(holder, *service)
                {
                    print_error(&error);
                }
                held();
            }
            HoldTask::CleanUp => {
                if let Some(holder) = &holder {
                    holder.request_cleanup();
                }
            }
        }
    }
}

/// Joins the network.
fn join(network: &str) -> Result<Holder, String> {
    let environment = Environment {
        network: network.to_owned(),
        instance: "rcdeploy-guard".to_owned(),
        directory: RunDirectory::open(network).map_err(|e| e.to_string())?,
        wake_event: WakeEvent::new().map_err(|e| e.to_string())?,
        settings: Settings::default(),
    };
    Holder::new(&environment).map_err(|e| e.to_string())
}

fn create(holder: &mut Holder, service: Service) -> Result<(), OpenError> {
    let Ok(address) = Address::parse(&service.address) else {
        // The check of the network refuses such an address.
        return Ok(());
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
    if service.topic {
        holder.hold_topic(&endpoint)
    } else {
        holder.hold_call(&endpoint)
    }
}
