//! A network in which the test has endpoints of its own.

use crate::LIMIT;
use rc_middleware::typed::Operation;
use rc_middleware::{
    Address, Backend, Endpoint, Environment, ExternalType, Qos, RunDirectory, Settings,
    TypeIdentity, WakeEvent,
};
use rc_vocabulary::Middleware;
use serde_json::Value;

/// A middleware with a domain.
#[derive(Clone, Copy, Debug)]
pub struct Over {
    /// The middleware.
    pub backend: Middleware,
    /// The domain, 0 if the middleware has none.
    domain: i64,
    connect: fn(&Environment) -> Box<dyn Backend>,
}

impl Over {
    /// Shared memory.
    ///
    /// # Panics
    /// The system refuses the network to a component that joins.
    pub fn iceoryx2() -> Self {
        Self {
            backend: Middleware::Iceoryx2,
            domain: 0,
            connect: |environment| rc_iceoryx2::connect(environment).expect("the network"),
        }
    }

    /// DDS in a domain.
    ///
    /// # Panics
    /// The system refuses the domain to a component that joins.
    pub fn dds(domain: i64) -> Self {
        Self {
            backend: Middleware::Dds,
            domain,
            connect: |environment| rc_dds::connect(environment).expect("the domain"),
        }
    }

    /// ROS 2 in a domain.
    ///
    /// # Panics
    /// The system refuses the domain to a component that joins.
    pub fn ros2(domain: i64) -> Self {
        Self {
            backend: Middleware::Ros2,
            domain,
            connect: |environment| rc_ros2::connect(environment, &[]).expect("the domain"),
        }
    }

    /// The word of the middleware.
    pub fn name(self) -> &'static str {
        self.backend.word()
    }
}

/// A network of its own.
#[derive(Debug)]
pub struct Network {
    name: String,
    over: Over,
    /// The level of the component's log.
    log: &'static str,
}

impl Drop for Network {
    fn drop(&mut self) {
        let directory = RunDirectory::open(&self.name).expect("the run directory");
        let _ = rc_iceoryx2::wipe(&directory);
        let _ = directory.remove();
    }
}

impl Network {
    /// A network of tests of this language.
    pub fn new(language: &str, over: Over) -> Self {
        let name = format!("{language}-other-{}-{}", over.name(), std::process::id());
        Self {
            name,
            over,
            log: "error",
        }
    }

    /// The same network with warnings in the output of the component.
    #[must_use]
    pub fn with_warnings(mut self) -> Self {
        self.log = "warn";
        self
    }

    /// Command line of a component of it.
    pub(crate) fn arguments(&self) -> Vec<String> {
        let mut arguments = ["--network", &self.name, "--log", self.log]
            .map(str::to_owned)
            .to_vec();
        if self.over.domain > 0 {
            let (over, domain) = (self.over.name(), self.over.domain);
            for setting in [format!("domain={domain}"), "interfaces=lo".to_owned()] {
                arguments.extend(["--set-middleware".to_owned(), format!("{over}.{setting}")]);
            }
        }
        arguments
    }

    /// The argument that binds a slot of a component to an address of this network.
    pub fn bind(&self, slot: &str, to: &str) -> String {
        format!("{slot}={}/{to}", self.name)
    }

    /// Joins it.
    ///
    /// # Panics
    /// The system refuses the network.
    pub fn join(&self, instance: &str) -> Box<dyn Backend> {
        let mut settings = Settings::default();
        if self.over.domain > 0 {
            let domain = rc_vocabulary::Value::Int(self.over.domain);
            settings.set(self.over.name(), "domain", domain);
            let interfaces = rc_vocabulary::Value::Texts(vec!["lo".to_owned()]);
            settings.set(self.over.name(), "interfaces", interfaces);
        }
        (self.over.connect)(&Environment {
            network: self.name.clone(),
            instance: instance.to_owned(),
            directory: RunDirectory::open(&self.name).expect("a run directory"),
            wake_event: WakeEvent::new().expect("a wake event"),
            settings,
        })
    }

    /// The other end of a slot, which has calls.
    pub(crate) fn calls(&self, described: &Value, operations: &[Operation]) -> Endpoint {
        let name = described["type_name"].as_str().expect("a name").to_owned();
        let hash = described["type_hash"].as_str().expect("a hash");
        let hash = u64::from_str_radix(hash, 16).expect("a hash");
        Endpoint {
            address: self.address(described),
            types: TypeIdentity { name, hash },
            qos: Qos {
                timeout: LIMIT,
                ..Qos::CALL
            },
            external_types: external(described, operations, operations),
        }
    }

    /// The other end of one topic of a slot.
    pub(crate) fn topic(
        &self,
        described: &Value,
        operations: &[Operation],
        operation: &Operation,
        qos: Qos,
    ) -> Endpoint {
        let name = described["type_name"].as_str().expect("a name");
        Endpoint {
            address: self.address(described).join(operation.name),
            types: TypeIdentity {
                name: format!("{name}/{}", operation.name),
                hash: operation.type_hash,
            },
            qos,
            external_types: external(described, operations, std::slice::from_ref(operation)),
        }
    }

    fn address(&self, described: &Value) -> Address {
        let slot = described["name"].as_str().expect("a name");
        Address::parse(&format!("{}/{slot}", self.name)).expect("an address")
    }
}

/// The types of ROS 2 of some operations of a slot, which has them over this middleware only.
fn external(slot: &Value, all: &[Operation], of: &[Operation]) -> Vec<ExternalType> {
    let names = slot["external_types"].as_array().into_iter().flatten();
    let pairs = all.iter().zip(names);
    let pairs = pairs.filter(|(operation, _)| of.iter().any(|own| own.id == operation.id));
    pairs
        .map(|(operation, name)| ExternalType {
            slot: slot["name"].as_str().expect("a name").to_owned(),
            operation: operation.name.to_owned(),
            id: operation.id,
            type_name: name.as_str().expect("a name").to_owned(),
        })
        .collect()
}
