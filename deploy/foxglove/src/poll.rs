//! Polls of the network.

use rc_deploy_client::params;
use rc_management::component::Parameters;
use rc_observe::Network;
use std::collections::BTreeMap;

/// The running network, and the parameters of each component.
pub(crate) struct Snapshot {
    pub(crate) network: Network,
    pub(crate) parameters: BTreeMap<String, Parameters>,
}

impl Snapshot {
    /// Polls once.
    pub(crate) fn once(name: &str) -> Result<Self, rc_observe::Error> {
        let network = Network::look(name)?;
        let all = network.components.iter();
        let all =
            all.filter_map(|c| Some((c.name.clone(), params::list(name, &c.name, &[]).ok()?)));
        let parameters = all.collect();
        Ok(Self {
            network,
            parameters,
        })
    }

    /// Polls once; empty where the network does not run.
    pub(crate) fn or_nothing(name: &str) -> Self {
        Self::once(name).unwrap_or_else(|_| Self::nothing(name))
    }

    /// A network of which nothing runs.
    fn nothing(name: &str) -> Self {
        let network = Network {
            name: name.to_owned(),
            components: Vec::new(),
            silent: Vec::new(),
        };
        Self {
            network,
            parameters: BTreeMap::new(),
        }
    }
}
