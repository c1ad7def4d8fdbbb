//! When the passing of time matters to a component, and what follows then.

use super::{Phase, Stop, Termination, Unit};
use crate::log::reporter::Reporter;
use crate::remote;
use crate::supervisor::process_handle::ProcessHandle;
use rc_deploy_network::plan::Policy;
use rc_management::event::Severity;
use std::time::{Duration, Instant};

/// How old the last heartbeat of a component, or the last iteration of its loop, may be.
pub(in crate::supervisor) const HEARTBEAT_LIMIT: Duration = Duration::from_secs(2);

/// Meaning of a deadline for a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overdue {
    Nothing,
    /// It is not ready within its limit.
    NotReady,
    /// It did not end after SIGKILL.
    NotKilled,
    /// It hangs for longer than its policy allows.
    HungTooLong,
}

impl Unit {
    /// When the passing of time next matters.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let Phase::Alive(running) = &self.phase else {
            return self.due;
        };
        let limit = match running.stop() {
            Stop::Asked(at) | Stop::Killed(at) => Some(at),
            Stop::No if !self.ready => Some(running.started + self.component.ready),
            Stop::No => self.silence().or_else(|| self.hung_limit()),
        };
        let limit = limit.into_iter().chain(running.closed);
        limit.chain(self.goal_deadline()).min()
    }

    /// When it will have been silent for too long.
    fn silence(&self) -> Option<Instant> {
        let linked = self.handle().is_some_and(ProcessHandle::is_linked);
        (self.hung.is_none() && linked).then(|| self.heard + self.silence_limit())
    }

    /// When it will have been hung for longer than its policy allows.
    fn hung_limit(&self) -> Option<Instant> {
        let rules = self.component.restart;
        let limit = rules.hung.filter(|_| rules.policy != Policy::Never);
        Some(self.hung? + limit?)
    }

    /// How long heartbeats may be missing. A component on another machine is also silent when its
    /// host is, which is reported first.
    fn silence_limit(&self) -> Duration {
        match self.outbox {
            None => HEARTBEAT_LIMIT,
            Some(_) => HEARTBEAT_LIMIT + remote::HOST_LIMIT,
        }
    }

    /// Looks at the clock.
    pub(crate) fn check(&mut self, now: Instant, report: &Reporter) -> Overdue {
        if self.deadline().is_none_or(|deadline| now < deadline) {
            return Overdue::Nothing;
        }
        if let Phase::Alive(running) = &mut self.phase
            && running.closed.take_if(|at| now >= *at).is_some()
        {
            if self.ready && running.has_mates() && running.stop() == Stop::No {
                self.end_alone(report);
            } else {
                self.report_closed_link(report);
            }
            return Overdue::Nothing;
        }
        let Phase::Alive(running) = &self.phase else {
            self.due = None;
            return Overdue::Nothing;
        };
        match running.stop() {
            Stop::Asked(_) => {
                let limit = running.stopping.limit;
                let text = format!("did not end within {limit:?} and is killed");
                self.process_event(report, Severity::Warning, "killed", text);
                self.kill();
                Overdue::Nothing
            }
            Stop::Killed(_) => {
                let text = format!("process {} does not end after SIGKILL", self.pid_text());
                self.event(report, Severity::Error, "not-killed", text.clone());
                let ran = running.started.elapsed();
                self.phase = Phase::Ended(Termination {
                    done: false,
                    text,
                    ran,
                    lost: true,
                });
                Overdue::NotKilled
            }
            Stop::No if !self.ready => Overdue::NotReady,
            // The supervisor's loop handles a goal that is late.
            Stop::No if self.goal_deadline().is_some_and(|at| now >= at) => Overdue::Nothing,
            Stop::No if self.hung.is_some() => Overdue::HungTooLong,
            Stop::No => {
                let text = format!("has not sent a heartbeat for {:?}", self.silence_limit());
                self.hang(report, self.heard, &text);
                Overdue::Nothing
            }
        }
    }

    /// Notes that it has ended in order, and its process runs on with other threads.
    fn end_alone(&mut self, report: &Reporter) {
        let Phase::Alive(running) = &self.phase else {
            return;
        };
        let end = Termination {
            done: true,
            text: format!("its process {} runs on", self.process_name()),
            ran: running.started.elapsed(),
            lost: false,
        };
        let text = format!("ended: {}", end.text);
        self.phase = Phase::Ended(end);
        self.event(report, Severity::Info, "exited", text);
    }
}
