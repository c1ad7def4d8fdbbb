//! Servers of a tool: they take the places of components that do not run.

use crate::backends::Backends;
use crate::error::Error;
use crate::network::{Network, Service};
use rc_middleware::backend::Profile;
use rc_middleware::{Address, Endpoint, ExternalType, Qos, Server, TypeIdentity};
use std::os::fd::BorrowedFd;
use std::time::Duration;

/// The most requests of one server that are served in a turn.
const TURN: usize = 64;
/// The most errors of a turn that are reported.
const ERRORS: usize = 8;

/// Serves calls. To its clients it is a component.
pub struct Responder {
    servers: Vec<Box<dyn Server>>,
    /// Dropped after the servers.
    backends: Backends,
}

impl Responder {
    /// Serves nothing yet.
    pub fn new(network: &Network) -> Result<Self, Error> {
        Ok(Self {
            servers: Vec::new(),
            backends: Backends::of_peer(&network.name)?,
        })
    }

    /// Serves the calls of a service that has clients and no server. Returns its number in
    /// [`Responder::serve`].
    pub fn open(&mut self, network: &Network, service: &Service) -> Result<usize, Error> {
        let clients = service.clients.iter();
        let slots = clients.filter_map(|end| {
            let component = network.component(&end.component)?;
            let mut slots = component.described.slots.iter();
            Some((component, slots.find(|slot| slot.name == end.slot)?))
        });
        let (component, slot) = slots.into_iter().next().ok_or_else(|| {
            Error::system("serve", &format!("`{}` has no client", service.address))
        })?;
        let settings = component.described.middlewares.get(&service.middleware);
        let settings = settings.cloned().unwrap_or_default();
        let address = Address::parse(&service.address);
        let address = address.map_err(|reason| Error::system("the address", &reason))?;
        let hash = u64::from_str_radix(&slot.hash, 16)
            .map_err(|error| Error::system("the types of the service", &error))?;
        let external = slot.operations.iter().filter_map(|operation| {
            Some(ExternalType {
                slot: slot.name.clone(),
                operation: operation.name.clone(),
                id: service.interface.operation(&operation.name)?.id,
                type_name: operation.external_type.clone()?,
            })
        });
        let endpoint = Endpoint {
            address,
            types: TypeIdentity {
                name: service.interface.name.clone(),
                hash,
            },
            qos: Qos::CALL,
            external_types: external.collect(),
        };
        let backend = self.backends.joined(&service.middleware, &settings)?;
        self.servers.push(backend.server(&endpoint)?);
        Ok(self.servers.len() - 1)
    }

    /// The descriptors that are readable when a request may have arrived.
    pub fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.servers.iter().map(|server| server.descriptor())
    }

    /// Serves the received requests. `answer` gets the number of the service and makes the reply,
    /// with its envelope; without a reply, none is sent. Returns errors: a request that cannot be
    /// read does not keep the next one from its reply.
    pub fn serve(
        &mut self,
        answer: &mut dyn FnMut(usize, Profile, &[u8]) -> Option<Vec<u8>>,
    ) -> Vec<String> {
        let mut errors = Vec::new();
        for (number, server) in self.servers.iter_mut().enumerate() {
            for round in 0..2 {
                for _ in 0..TURN {
                    let served = server.serve(&mut |_, body, reply| {
                        if let Some(bytes) = answer(number, reply.profile(), body) {
                            *reply.body() = bytes;
                        }
                    });
                    match served {
                        Ok(false) => break,
                        Err(error) if errors.len() < ERRORS => errors.push(error.to_string()),
                        Ok(true) | Err(_) => {}
                    }
                }
                if round == 0 {
                    server.acknowledge(true);
                }
            }
        }
        errors
    }

    /// Waits until the last replies have arrived.
    pub fn finish(self) {
        let Self { servers, backends } = self;
        backends.linger(Duration::from_secs(1));
        drop(servers);
    }
}
