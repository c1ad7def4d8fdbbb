//! Quality of service in the library's terms. Nothing is left to defaults, which ROS and DDS have different ones of.

use rc_middleware::{Durability, Qos, Reliability};
use rc_network::QosContract;
use rustdds::policy::{self, History, Lifespan, Liveliness, ResourceLimits};
use rustdds::{Duration, QosPolicies, QosPolicyBuilder};

/// How long a sender waits for room: what the library has not sent yet goes out in that time.
const ROOM: Duration = Duration::from_millis(20);
/// The same of calls, whose other ends are waited for.
const PATIENCE: Duration = Duration::from_millis(100);
/// How many samples of calls may be under way: as many as there are clients, times what each may have.
const CALLS: i32 = 8192;

/// The quality of service of an end, for the library and for the other end.
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

/// Of a topic.
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

/// Of calls, which lose nothing: how much may wait is counted by the ends themselves.
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

/// Of what components tell each other of themselves: the last word, also for those who come late.
pub(crate) fn ends() -> QosPolicies {
    QosPolicyBuilder::new()
        .reliable(ROOM)
        .durability(policy::Durability::TransientLocal)
        .history(History::KeepLast { depth: 1 })
        // All of them are in one queue of the reader's.
        .resource_limits(limits(CALLS))
        .build()
}

/// Of the sign that a component lives.
pub(crate) fn alive() -> QosPolicies {
    QosPolicyBuilder::new()
        .best_effort()
        .durability(policy::Durability::Volatile)
        .history(History::KeepLast { depth: 1 })
        .resource_limits(limits(CALLS))
        .build()
}
