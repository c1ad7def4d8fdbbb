//! The status of a component, for clients.

use super::{Phase, Stop, Unit};
use crate::supervisor::process_handle::ProcessHandle;
use rc_management::component::State;
use rc_management::supervisor::{ComponentState, ComponentStatus};
use std::collections::BTreeMap;

impl Unit {
    pub(super) fn pid_text(&self) -> String {
        let pid = self.handle().and_then(ProcessHandle::pid);
        pid.map_or_else(String::new, |pid| pid.to_string())
    }

    pub(crate) fn status(&self) -> ComponentStatus {
        let running = match &self.phase {
            Phase::Alive(running) => Some(running),
            Phase::Waiting | Phase::Ended(_) => None,
        };
        ComponentStatus {
            name: self.name().to_owned(),
            by_hand: false,
            state: self.state(),
            lifecycle: running.and_then(|_| self.lifecycle_state()),
            process: self.component.thread.as_ref().map(|t| t.process.clone()),
            behind: self.component.behind.clone(),
            host: self.component.host.as_ref().map(|host| host.name.clone()),
            pid: running.and_then(|r| r.handle.pid()),
            uptime_s: running.map(|r| (r.started.elapsed().as_secs_f64() * 1e3).round() / 1e3),
            ready: self.ready && running.is_some(),
            middleware: self.component.middleware.clone(),
            transports: self.component.transports.clone(),
            cpu: self.component.cpu.clone(),
            priority: self.component.priority,
            executable: self.component.executable.clone(),
            log: self.log.clone(),
            restarts: self.restarts.count(),
            ready_ms: self.component.ready.as_millis() as u64,
            stop_ms: self.component.stop.as_millis() as u64,
            lost: self.lost.clone(),
            // A tool asks the component itself.
            messages: BTreeMap::new(),
            forwarded: self.forwarded.clone(),
            converted: self.converted.clone(),
            troubles: running.map_or_else(Vec::new, |_| self.health.troubles()),
            clock: running.and_then(|_| self.health.clock().cloned()),
            machine: running.and_then(|_| self.health.machine().cloned()),
            exit: match &self.phase {
                Phase::Ended(end) => Some(end.text.clone()),
                Phase::Waiting | Phase::Alive(_) => None,
            },
        }
    }

    pub(crate) fn state(&self) -> ComponentState {
        match &self.phase {
            Phase::Waiting | Phase::Ended(_) if self.stopped => ComponentState::Stopped,
            Phase::Waiting => ComponentState::Waiting,
            Phase::Ended(end) if end.done => ComponentState::Done,
            Phase::Ended(_) => ComponentState::Failed,
            Phase::Alive(running) if running.stop() != Stop::No => ComponentState::Stopping,
            Phase::Alive(_) if self.hung.is_some() => ComponentState::Hung,
            Phase::Alive(_) if self.ready => self.reported.unwrap_or(State::Running).into(),
            Phase::Alive(_) => ComponentState::Starting,
        }
    }
}
