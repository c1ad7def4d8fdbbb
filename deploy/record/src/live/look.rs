//! Looks again and again what runs in a network, on a thread of its own: a component that hangs
//! delays no message.

use crate::error::RecordError;
use rc_management::Client;
use rc_management::component::{Parameters, Request};
use rc_middleware::RunDirectory;
use rc_observe::Network;
use std::collections::BTreeMap;
use std::sync::mpsc::RecvTimeoutError::Timeout;
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::time::Duration;

/// The time between two looks.
const PAUSE: Duration = Duration::from_secs(2);
/// How long a component may take to list its parameters.
const LIMIT: Duration = Duration::from_secs(2);

/// What a look has found.
pub(super) struct Look {
    pub(super) network: Network,
    pub(super) parameters: BTreeMap<String, Parameters>,
}

/// The looks of a thread, which ends when this is dropped.
pub(super) struct Looks {
    found: Receiver<Option<Look>>,
    _stop: Sender<()>,
}

impl Looks {
    pub(super) fn begin(network: &str) -> Result<Self, RecordError> {
        let (send, found) = sync_channel(1);
        let (stop, stopped) = channel::<()>();
        let name = network.to_owned();
        let thread = std::thread::Builder::new().name("look".to_owned());
        thread
            .spawn(move || {
                while stopped.recv_timeout(PAUSE) == Err(Timeout) {
                    if send.send(look(&name)).is_err() {
                        return;
                    }
                }
            })
            .map_err(|e| RecordError::Value(format!("no thread can be started: {e}")))?;
        Ok(Self { found, _stop: stop })
    }

    /// The looks since the last call; `None` for one that found no component.
    pub(super) fn take(&self) -> Vec<Option<Look>> {
        self.found.try_iter().collect()
    }
}

/// Looks once. `None` if no component replies.
pub(super) fn look(name: &str) -> Option<Look> {
    let network = Network::look(name).ok()?;
    let directory = RunDirectory::of(name);
    let parameters = network.components.iter().filter_map(|component| {
        let socket = directory.socket(&component.name.replace('.', "-"));
        let mut client = Client::connect(&socket, LIMIT).ok()?;
        let request = Request::Parameters { paths: None };
        let listed: Parameters = client.call(&request, LIMIT).ok()?;
        Some((component.name.clone(), listed))
    });
    let parameters = parameters.collect();
    Some(Look {
        network,
        parameters,
    })
}
