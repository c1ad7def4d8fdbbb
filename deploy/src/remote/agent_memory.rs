//! A host whose shared memory was removed: its components end in order, as its supervisor asks, a
//! new guard creates the services, and then they start.

use super::agent::Agent;
use super::agent_process::Start;
use super::agent_renewal::Step;
use rc_deploy_client::error::Error;
use rc_management::agent::{AgentMessage, Exit};

impl Agent {
    /// Stops starts, and reports it to the supervisor, if files of the guard's services are
    /// missing.
    pub(super) fn check_memory(&mut self) {
        let missing = self.network_guard.take_missing();
        if missing.is_empty() || self.renewal.step == Step::Ends {
            return;
        }
        self.renewal.step = Step::Ends;
        self.network_guard.hold_starts();
        let files = missing.join(", ");
        self.send(&AgentMessage::MemoryLost(files));
    }

    /// Starts a process, now or when its services are created again.
    pub(super) fn start(&mut self, start: Start) {
        if self.renewal.step == Step::None {
            self.start_now(&start);
        } else {
            self.renewal.waiting.push(start);
        }
    }

    /// Forgets a process that waits for its start, if there is one.
    pub(super) fn cancel(&mut self, name: &str) {
        let waiting = &mut self.renewal.waiting;
        let Some(at) = waiting.iter().position(|one| one.process() == name) else {
            return;
        };
        waiting.remove(at);
        let exit = Exit {
            success: true,
            signal: None,
            text: "stopped before it was started".to_owned(),
        };
        let name = name.to_owned();
        self.send(&AgentMessage::Ended {
            name,
            exit,
            left: 0,
        });
    }

    /// Creates the services again once no component runs, and starts those that wait for them.
    pub(super) fn renew(&mut self, cleanup: &dyn Fn()) -> Result<(), Error> {
        if self.renewal.step == Step::Ends && self.running.is_empty() {
            self.network_guard.restart(cleanup)?;
            self.renewal.step = Step::Creates;
            let out = &mut self.out;
            self.health.end(out, "guard-lost", "a new guard runs");
        }
        if self.renewal.step == Step::Creates {
            let waiting = std::mem::take(&mut self.renewal.waiting);
            for start in waiting {
                let guard = &self.network_guard;
                let mut names = start.components.iter().map(|one| &*one.component.name);
                if names.all(|name| guard.lets_start(name)) && guard.lets_start(start.process()) {
                    self.start_now(&start);
                } else {
                    self.renewal.waiting.push(start);
                }
            }
            if self.renewal.waiting.is_empty() && self.network_guard.holds_all() {
                self.renewal.step = Step::None;
            }
        }
        Ok(())
    }
}
