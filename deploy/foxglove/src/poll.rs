//! Polls the network on a thread of its own: a component that hangs
//! delays no message.

use crate::command_line::{Failure, system};
use rc_deploy_client::params;
use rc_management::component::Parameters;
use rc_observe::Network;
use std::collections::BTreeMap;
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::sync::mpsc::RecvTimeoutError::Timeout;
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::time::Duration;

/// The time between two polls.
const PAUSE: Duration = Duration::from_secs(2);

/// What runs, and the parameters of each component.
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

/// A thread that polls a network. It ends when this is dropped.
pub(crate) struct Poller {
    found: Receiver<Snapshot>,
    _stop: Sender<()>,
}

impl Poller {
    /// Begins. `wake` becomes readable when there is a snapshot.
    pub(crate) fn begin(network: &str, mut wake: UnixStream) -> Result<Self, Failure> {
        let (send, found) = sync_channel(1);
        let (stop, stopped) = channel::<()>();
        let name = network.to_owned();
        let thread = std::thread::Builder::new().name("poll".to_owned());
        let begun = thread.spawn(move || {
            while stopped.recv_timeout(PAUSE) == Err(Timeout) {
                let snapshot = Snapshot::once(&name).unwrap_or_else(|_| Snapshot::nothing(&name));
                if send.send(snapshot).is_err() {
                    return;
                }
                // If it is full, the other end is awake anyway.
                let _ = wake.write(&[0]);
            }
        });
        begun.map_err(|error| system("start a thread", &error))?;
        Ok(Self { found, _stop: stop })
    }

    /// The snapshots since the last call.
    pub(crate) fn take(&self) -> Vec<Snapshot> {
        self.found.try_iter().collect()
    }
}
