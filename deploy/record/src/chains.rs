//! The chains of a recorded network.

use crate::bag::document;
use crate::reader::{Reader, Record};
use crate::{Faults, RecordError, keys};
use rc_deploy_client::chains::{ChainsReport, RecordedChain};
use rc_management::chains::ChainStatus;
use std::path::Path;

/// The kind of the topics that hold the chains: a [`ChainStatus`] every two seconds, with the
/// messages that came to the end since the one before.
pub(crate) const KIND: &str = "chain";

/// What happened to the chains during a recording, and why less was read than was recorded.
///
/// Percentiles and messages are those of the newest million of each chain.
///
/// # Errors
/// The file cannot be read, or is no recording; or it has no chains.
pub fn read(path: &Path) -> Result<(ChainsReport, Faults), RecordError> {
    let mut reader = Reader::open(path)?;
    let mut chains: Vec<(String, RecordedChain)> = Vec::new();
    let mut network = None;
    while let Some(record) = reader.next() {
        let Record::Message(message) = record else {
            continue;
        };
        if message.channel.get(keys::KIND) != Some(KIND) {
            continue;
        }
        let status = document(&message).and_then(|document| serde_json::from_value(document).ok());
        let Some(status): Option<ChainStatus> = status else {
            continue;
        };
        let topic = message.channel.topic.trim_start_matches('/');
        network.get_or_insert_with(|| topic.split('/').next().unwrap_or_default().to_owned());
        let known = chains.iter().position(|(name, _)| *name == status.name);
        let at = known.unwrap_or_else(|| {
            chains.push((status.name.clone(), RecordedChain::default()));
            chains.len() - 1
        });
        chains[at].1.add(status);
    }
    let Some(network) = network else {
        let text = "the recording has no chains: `rcdeploy record` keeps those of a network whose .ddsl declares them, as `Chain brake { … };`";
        return Err(RecordError::Value(format!("{}: {text}", path.display())));
    };
    let chains = chains.into_iter().map(|(_, chain)| chain.finish());
    let report = ChainsReport {
        network,
        chains: chains.collect(),
    };
    Ok((report, reader.faults().clone()))
}
