//! The frames of measured values.

use rc_observe::{End, Network, Source as Named};

/// Frames of topics and of operations.
pub(crate) struct Frames(Vec<(Named, String)>);

impl Frames {
    pub(crate) fn find(network: &Network, wanted: &[(String, String)]) -> Self {
        let all = wanted.iter();
        let all = all.filter_map(|(name, frame)| {
            let named = Named::find(network, name).ok()?;
            Some((named, frame.clone()))
        });
        Self(all.collect())
    }

    /// The frame of a topic or an operation: the one that was given, or the name of the component.
    pub(crate) fn of(&self, name: &str, end: Option<&End>) -> String {
        let is_meant = |named: &Named| match named {
            Named::Topic(topic) => name.strip_prefix('/') == Some(&topic.address),
            Named::Calls(operation) => {
                let last = name.rsplit('/').next();
                end == Some(&operation.server) && last == Some(&operation.operation.name)
            }
        };
        let found = self.0.iter().find(|(named, _)| is_meant(named));
        let component = || end.map_or_else(String::new, |end| end.component.clone());
        found.map_or_else(component, |(_, frame)| frame.clone())
    }
}
