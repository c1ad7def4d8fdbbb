//! The topics by which the replicas of a world meet.

use crate::Role;
use crate::qos::{Qos, Reliability};

/// A slot that each component with a world has.
#[derive(Clone, Copy, Debug)]
pub struct WorldSlot {
    /// The interface of [`WORLD_MODULE`].
    pub interface: &'static str,
    /// The interface with its module.
    pub type_name: &'static str,
    /// Which end it is.
    pub role: Role,
    /// The suffix of the world's name in the name of its slot.
    pub suffix: &'static str,
    /// The quality of service.
    pub qos: Qos,
}

/// The IDSL module of the interfaces.
pub const WORLD_MODULE: &str = "RcWorld";

const STATE: Qos = Qos {
    reliability: Reliability::Reliable,
    depth: 64,
    ..Qos::PUBLISHER
};
/// A stream repeats itself, so nobody waits for a lost sample.
const STREAM: Qos = Qos {
    reliability: Reliability::BestEffort,
    ..STATE
};

/// The slots of a world, in their order in a component.
pub const WORLD_SLOTS: [WorldSlot; 4] = [
    WorldSlot {
        interface: "World",
        type_name: "RcWorld::World",
        role: Role::Publishes,
        suffix: "",
        qos: STATE,
    },
    WorldSlot {
        interface: "WorldStream",
        type_name: "RcWorld::WorldStream",
        role: Role::Publishes,
        suffix: "_stream",
        qos: STREAM,
    },
    WorldSlot {
        interface: "World",
        type_name: "RcWorld::World",
        role: Role::SubscribesTo,
        suffix: "_peers",
        qos: STATE,
    },
    WorldSlot {
        interface: "WorldStream",
        type_name: "RcWorld::WorldStream",
        role: Role::SubscribesTo,
        suffix: "_streams",
        qos: STREAM,
    },
];
