//! Quality of service for the library. It sets every policy, because the defaults of ROS and DDS
//! differ.

use rc_middleware::{Durability, Qos, Reliability};
use rc_network::QosContract;
use rustdds::policy::{self, History, Lifespan, Liveliness, ResourceLimits};
use rustdds::{Duration, QosPolicies, QosPolicyBuilder};

/// Longest wait of a sender for room: the library sends waiting samples in that time.
const ROOM: Duration = Duration::from_millis(20);
/// The same for calls.
const PATIENCE: Duration = Duration::from_millis(100);
/// Most samples of calls at a time: the number of clients times the pending requests of each.
const CALLS: i32 = 8192;

/// The quality of service of an endpoint, for the library and for its peers.
pub(crate) struct Ends {
    pub(crate) policies: QosPolicies,
    pub(crate) contract: QosContract,
}

fn duration(time: std::time::Duration) -> Duration {
    Duration::from_std(time)
}

fn limits(samples: i32) -> ResourceLimits {
    ResourceLimits {
        max_samples: samples,
        max_instances: 1,
        max_samples_per_instance: samples,
    }
}

/// The quality of service of a topic.
pub(crate) fn topic(wanted: &Qos) -> Ends {
    let depth = i32::try_from(wanted.depth.max(1)).unwrap_or(i32::MAX);
    let mut policies = QosPolicyBuilder::new()
        .history(History::KeepLast { depth })
        .durability(match wanted.durability {
            Durability::Volatile => policy::Durability::Volatile,
            Durability::TransientLocal => policy::Durability::TransientLocal,
        })
        .deadline(policy::Deadline(
            wanted.deadline.map_or(Duration::INFINITE, duration),
        ))
        .liveliness(Liveliness::Automatic {
            lease_duration: wanted.liveliness.map_or(Duration::INFINITE, duration),
        })
        .lifespan(Lifespan {
            duration: wanted.lifespan.map_or(Duration::INFINITE, duration),
        });
    policies = match wanted.reliability {
        Reliability::Reliable => policies.reliable(ROOM),
        Reliability::BestEffort => policies.best_effort(),
    };
    Ends {
        policies: policies.build(),
        contract: QosContract::from(wanted),
    }
}

/// The quality of service of calls, which lose nothing: clients and servers limit how many requests
/// wait.
pub(crate) fn call() -> Ends {
    Ends {
        policies: QosPolicyBuilder::new()
            .reliable(PATIENCE)
            .durability(policy::Durability::Volatile)
            .history(History::KeepAll)
            .resource_limits(limits(CALLS))
            .build(),
        contract: QosContract::from(&Qos::CALL),
    }
}

/// The quality of service of [`crate::presence::ENDS`]: late readers get the last message.
pub(crate) fn ends() -> QosPolicies {
    QosPolicyBuilder::new()
        .reliable(ROOM)
        .durability(policy::Durability::TransientLocal)
        .history(History::KeepLast { depth: 1 })
        // The messages of all writers share one queue of the reader.
        .resource_limits(limits(CALLS))
        .build()
}

/// The quality of service of [`crate::presence::ALIVE`].
pub(crate) fn alive() -> QosPolicies {
    QosPolicyBuilder::new()
        .best_effort()
        .durability(policy::Durability::Volatile)
        .history(History::KeepLast { depth: 1 })
        .resource_limits(limits(CALLS))
        .build()
}
