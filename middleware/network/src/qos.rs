//! Quality of service for the library.

use crate::QosContract;
use rc_ddsc::{End, Qos};
use rc_middleware::{Durability, Reliability};

/// The quality of service of a publisher or a subscriber.
pub fn topic_qos(wanted: &rc_middleware::Qos) -> Qos<'static> {
    Qos {
        reliable: wanted.reliability == Reliability::Reliable,
        transient_local: wanted.durability == Durability::TransientLocal,
        depth: i32::try_from(wanted.depth.max(1)).unwrap_or(i32::MAX),
        deadline: wanted.deadline,
        lifespan: wanted.lifespan,
        liveliness: wanted.liveliness,
        user_data: &[],
    }
}

/// The quality of service of calls, which lose nothing: clients and servers limit how many requests
/// wait.
pub fn call_qos() -> Qos<'static> {
    Qos {
        reliable: true,
        depth: 0,
        ..Qos::default()
    }
}

/// Contract by which an endpoint with this quality of service matches peers.
pub(crate) fn contract(qos: &Qos<'_>) -> QosContract {
    QosContract {
        reliable: qos.reliable,
        transient_local: qos.transient_local,
        deadline: qos.deadline,
        liveliness: qos.liveliness,
    }
}

/// The contract of an endpoint that was discovered.
pub(crate) fn contract_of(end: &End) -> QosContract {
    QosContract {
        reliable: end.reliable,
        transient_local: end.transient_local,
        deadline: end.deadline,
        liveliness: end.liveliness,
    }
}
