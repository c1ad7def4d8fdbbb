//! The middlewares that a component may use: all of them.

use rc_middleware::{Backend, Environment, OpenError};
use rc_runtime::Connect;
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

const ALL: [(&str, Connect); 4] = [
    ("iceoryx2", rc_iceoryx2::connect),
    ("dds", rc_dds::connect),
    ("ros2", connect_ros2),
    ("local", rc_local::connect),
];

/// A middleware by its name.
pub(crate) fn find(name: &str) -> Result<(&'static str, Connect), String> {
    let found = ALL.into_iter().find(|(known, _)| *known == name);
    found.ok_or_else(|| {
        format!("there is no middleware `{name}`; there are iceoryx2, dds, ros2 and local")
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
