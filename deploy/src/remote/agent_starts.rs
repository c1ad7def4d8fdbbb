//! Starting of processes by an agent.

use super::agent::Agent;
use super::agent_process::{Running, Start, Starting};
use super::copies;
use super::log_tail::LogTail;
use crate::process::launch::{LocalProcess, MOST_THREADS, NewComponent};
use rc_deploy_client::names::check_name;
use rc_management::agent::AgentMessage;
use std::path::Path;
use std::time::Duration;

impl Agent {
    /// Starts a process.
    pub(super) fn start_now(&mut self, start: &Start) {
        let name = start.process().to_owned();
        let started = self.launch(start).and_then(|started| {
            let first = start.components.first().zip(started.first());
            let (first, process) = first.ok_or("it has no component")?;
            let stops = start.components.iter().map(|one| one.component.stop);
            let limit: Duration = stops.max().unwrap_or_default();
            let registered = process.registered(&first.component, limit);
            Ok((registered, process.pid(), started))
        });
        match started {
            Ok((registered, pid, started)) => {
                let names = start
                    .components
                    .iter()
                    .map(|one| one.component.name.clone());
                let running = Running {
                    run: start.run.clone(),
                    components: names.zip(started).collect(),
                };
                self.running.insert(name.clone(), running);
                self.network_guard.started(registered);
                self.send(&AgentMessage::Started { name, pid });
            }
            Err(reason) => self.send(&AgentMessage::NotStarted { name, reason }),
        }
    }

    fn launch(&mut self, start: &Start) -> Result<Vec<LocalProcess>, String> {
        let process = start.process();
        if self.running.contains_key(process) {
            return Err("it runs already".to_owned());
        }
        if start.components.len() > MOST_THREADS {
            return Err(format!("a process has at most {MOST_THREADS} components"));
        }
        let names = start.components.iter().map(|one| &*one.component.name);
        for name in names.chain([process]) {
            check_name("component", name).map_err(|e| e.to_string())?;
            if !self.printed.contains_key(name) {
                let printed = LogTail::new(&self.logs, name);
                let printed = printed.map_err(|e| format!("cannot make its log: {e}"))?;
                self.printed.insert(name.to_owned(), printed);
            }
        }
        for Starting { component, .. } in &start.components {
            // A workspace that the user has named must exist.
            if component.directory.starts_with(&self.root) {
                copies::make_folder(&component.directory)
                    .map_err(|e| format!("cannot make {}: {e}", component.directory.display()))?;
            }
            if component.exact {
                let log = self.printed[&component.name].path();
                self.health.note_exact_recordings(log);
            }
        }
        let log = |name: &str| -> &Path { self.printed[name].path() };
        let new = start.components.iter().map(|one| NewComponent {
            component: &one.component,
            greeting: one.greeting.clone(),
            log: log(&one.component.name),
            after: one.after.clone(),
        });
        let new: Vec<NewComponent<'_>> = new.collect();
        let mark = self.network_guard.mark();
        LocalProcess::start(&new, &start.run, log(process), mark)
    }
}
