//! The types of a node's endpoints: their hashes, and their descriptions for other nodes.

use rc_network::lock;
use rc_ros_types::{TypeDescription, Types};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// The types of a node's endpoints.
#[derive(Debug)]
pub(crate) struct NodeTypes {
    /// The types of the component that are not part of ROS 2.
    own: Types<'static>,
    /// The types in use, by hash.
    used: Mutex<BTreeMap<String, Arc<TypeDescription>>>,
}

impl NodeTypes {
    pub(crate) fn new(own: &'static [&'static str]) -> Self {
        Self {
            own: Types::read(own.iter().copied()),
            used: Mutex::default(),
        }
    }

    /// The labels in the user data of an endpoint of this type: its hash, as the middlewares of ROS
    /// 2 announce it (`rmw_dds_common`). None for a type without a definition.
    pub(crate) fn labels(&self, type_name: &str) -> String {
        let mut used = lock(&self.used);
        let known = used.iter().find(|(_, one)| one.main.name == type_name);
        if let Some((hash, _)) = known {
            return format!("typehash={hash};");
        }
        let Some(found) = TypeDescription::of(type_name, &self.own) else {
            return String::new();
        };
        let hash = found.hash();
        let labels = format!("typehash={hash};");
        used.insert(hash, Arc::new(found));
        labels
    }

    /// The type with this hash, if an endpoint of the node has it.
    pub(crate) fn with_hash(&self, hash: &str) -> Option<Arc<TypeDescription>> {
        lock(&self.used).get(hash).cloned()
    }
}
