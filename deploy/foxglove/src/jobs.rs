//! Calls and changes of parameters, each on a thread of its own: they take as long as the component
//! takes.

use rc_deploy_client::params;
use rc_management::component::Parameters;
use rc_observe::Operation;
use rc_record::envelope;
use rc_values::Value;
use serde_json::{Map, Value as Json};
use std::collections::BTreeMap;
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

/// How many run at a time, of all clients.
const MOST: usize = 32;
/// How many of them may be of one client.
const MOST_OF_CLIENT: usize = 8;
/// How long a call may take.
const LIMIT: Duration = Duration::from_secs(10);

/// Result of a job.
pub(crate) enum Done {
    /// The reply to a call, or why there is none.
    Called {
        service: u32,
        call: u32,
        reply: Result<Vec<u8>, String>,
    },
    /// Parameters were changed, or why they were not.
    Set {
        /// The changed parameters, to report them.
        names: Vec<String>,
        id: Option<String>,
        failures: Vec<String>,
        /// The parameters afterwards, by component.
        listed: BTreeMap<String, Parameters>,
    },
}

/// The jobs that run.
pub(crate) struct Jobs {
    send: Sender<(u64, Done)>,
    done: Receiver<(u64, Done)>,
    wake: UnixStream,
    running: BTreeMap<u64, usize>,
}

impl Jobs {
    /// None run yet. `wake` becomes readable when one is done.
    pub(crate) fn new(wake: UnixStream) -> Self {
        let (send, done) = channel();
        Self {
            send,
            done,
            wake,
            running: BTreeMap::new(),
        }
    }

    /// Calls an operation for a client.
    pub(crate) fn call(
        &mut self,
        client: u64,
        network: &str,
        operation: Operation,
        parameters: Value,
        (service, call): (u32, u32),
    ) -> Result<(), String> {
        let network = network.to_owned();
        self.start(client, move || {
            let answer = rc_observe::call(&network, &operation, &parameters, LIMIT);
            let reply = answer.map_err(|error| error.to_string());
            let reply = reply.and_then(|answer| {
                let unknown = || "the reply does not fit its description".to_owned();
                envelope::answered(&operation.operation, &answer).ok_or_else(unknown)
            });
            Done::Called {
                service,
                call,
                reply,
            }
        })
    }

    /// Changes parameters for a client: those of one component all or none.
    pub(crate) fn set(
        &mut self,
        client: u64,
        network: &str,
        changes: BTreeMap<String, Map<String, Json>>,
        names: Vec<String>,
        id: Option<String>,
    ) -> Result<(), String> {
        let network = network.to_owned();
        self.start(client, move || {
            let mut failures = Vec::new();
            let mut listed = BTreeMap::new();
            for (component, changes) in &changes {
                if let Err(error) = params::set(&network, component, changes) {
                    failures.push(error.to_string());
                }
                if let Ok(all) = params::list(&network, component, &[]) {
                    listed.insert(component.clone(), all);
                }
            }
            Done::Set {
                names,
                id,
                failures,
                listed,
            }
        })
    }

    fn start(
        &mut self,
        client: u64,
        job: impl FnOnce() -> Done + Send + 'static,
    ) -> Result<(), String> {
        let own = self.running.get(&client).copied().unwrap_or_default();
        if own >= MOST_OF_CLIENT || self.running.values().sum::<usize>() >= MOST {
            return Err("too many calls wait for their replies".to_owned());
        }
        let no_thread = |error: std::io::Error| format!("no thread can be started: {error}");
        let mut wake = self.wake.try_clone().map_err(no_thread)?;
        let send = self.send.clone();
        let thread = std::thread::Builder::new().name("job".to_owned());
        let begun = thread.spawn(move || {
            // The server may have ended; a full pipe wakes it, too.
            let _ = send.send((client, job()));
            let _ = wake.write(&[0]);
        });
        begun.map_err(no_thread)?;
        *self.running.entry(client).or_default() += 1;
        Ok(())
    }

    /// Takes the results since the last call, each with its client.
    pub(crate) fn take(&mut self) -> Vec<(u64, Done)> {
        let done: Vec<(u64, Done)> = self.done.try_iter().collect();
        for (client, _) in &done {
            if let Some(count) = self.running.get_mut(client) {
                *count -= 1;
                if *count == 0 {
                    self.running.remove(client);
                }
            }
        }
        done
    }
}
