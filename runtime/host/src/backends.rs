//! The middlewares that a component may use: all of them.

use rc_middleware::{Backend, Environment, OpenError};
use rc_runtime::Connect;
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

const ALL: [(&str, Connect); 4] = [
    (rc_iceoryx2::NAME, rc_iceoryx2::connect),
    (rc_dds::NAME, rc_dds::connect),
    (rc_ros2::NAME, connect_ros2),
    (rc_local::NAME, rc_local::connect),
];

/// A middleware by its name.
pub(crate) fn find(name: &str) -> Result<(&'static str, Connect), String> {
    let found = ALL.into_iter().find(|(known, _)| *known == name);
    found.ok_or_else(|| {
        let known = rc_vocabulary::listed(ALL.map(|(known, _)| known), "and");
        format!("there is no middleware `{name}`; there are {known}")
    })
}

/// Definitions of types that are not part of ROS 2, of all components of this process.
static ROS_TYPES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

/// Adds definitions of types, before their component joins ROS 2.
pub(crate) fn add_ros_types(types: Vec<String>) {
    let mut known = ROS_TYPES.lock().unwrap_or_else(PoisonError::into_inner);
    for text in types {
        if !known.contains(text.as_str()) {
            known.insert(text.leak());
        }
    }
}

fn connect_ros2(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    let known = ROS_TYPES.lock().unwrap_or_else(PoisonError::into_inner);
    let types: Vec<&'static str> = known.iter().copied().collect();
    rc_ros2::connect(environment, types.leak())
}
