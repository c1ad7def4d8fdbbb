//! The reports of components over their links, and the events that follow.

use crate::log::reporter::Reporter;
use crate::supervisor::parameter_changes::Changes;
use crate::supervisor::unit::{HEARTBEAT_LIMIT, Phase, Unit};
use rc_deploy_client::logs;
use rc_diagnostics::foreign::clean;
use rc_management::component::State;
use rc_management::event::{Event, Severity};
use rc_management::lines::Line;
use rc_management::link::{ComponentMessage, MOST_GARBAGE};
use std::time::{Duration, Instant};

impl Unit {
    /// Handles one line of the link.
    pub(crate) fn handle_line(&mut self, line: Line, report: &Reporter) {
        let size = line.size();
        let message = match line {
            Line::Complete(line) => ComponentMessage::decode(&line),
            Line::TooLong => Err("a line of more than 64 KiB".to_owned()),
        };
        match message {
            Ok(message) => self.handle_message(message, report),
            Err(fault) => self.reject(&fault, size, report),
        }
    }

    /// Reports a link that was closed while the component runs.
    pub(super) fn report_closed_link(&mut self, report: &Reporter) {
        if self.handle().is_some_and(|handle| !handle.is_linked()) && !self.is_asked_to_stop() {
            let text = "closed its standard input, which is the link to its supervisor; it is no longer watched";
            self.health.begun("link-closed", text);
            self.event(report, Severity::Warning, "link-closed", text);
        }
    }

    fn handle_message(&mut self, message: ComponentMessage, report: &Reporter) {
        if !self.is_alive() {
            return;
        }
        match message {
            ComponentMessage::State { state } => {
                if self.reported == Some(state) {
                    return;
                }
                self.reported = Some(state);
                // The event `starting` says it already.
                if state == State::Starting {
                    return;
                }
                let severity = match state {
                    State::Emergency => Severity::Warning,
                    State::Starting | State::Running | State::Stopping => Severity::Info,
                };
                self.event(report, severity, "state", state.to_string());
            }
            ComponentMessage::Ready => {
                self.heard = Instant::now();
                if let Some(control) = &mut self.lifecycle {
                    control.loop_runs();
                }
                self.note_ready(report);
            }
            ComponentMessage::Lifecycle(change) => {
                self.take_lifecycle(change, report);
                self.note_ready(report);
            }
            ComponentMessage::Parameters(unsaved) => {
                self.changes = Changes::new(unsaved);
            }
            ComponentMessage::Restored { refused: None } => {
                let text = self.changes.restored();
                self.event(report, Severity::Info, "restored", text);
            }
            ComponentMessage::Restored { refused: Some(why) } => {
                let text = format!(
                    "runs with its configuration; changed parameters were not restored: {why}"
                );
                self.event(report, Severity::Warning, "not-restored", text);
                self.changes = Changes::default();
                self.proposal.configured();
            }
            ComponentMessage::Proposed {
                number,
                changes,
                refused,
            } => self
                .proposal
                .decided(number, refused.map_or(Ok(changes), Err)),
            ComponentMessage::Settled { number } => self.proposal.settled(number),
            ComponentMessage::Heartbeat(mut heartbeat) => {
                self.heard = Instant::now();
                self.lost = std::mem::take(&mut heartbeat.lost);
                self.converted = std::mem::take(&mut heartbeat.converted);
                self.forwarded = std::mem::take(&mut heartbeat.forwarded);
                let age_ms = heartbeat.age_ms;
                // A hook may take as long as a start, whoever requested it.
                let limit = if self.is_in_transition() {
                    HEARTBEAT_LIMIT.max(self.component.ready)
                } else {
                    HEARTBEAT_LIMIT
                };
                if !self.is_asked_to_stop() {
                    let mut happened = self.health.heartbeat(heartbeat);
                    happened.extend(self.health.converted(&self.converted));
                    for (severity, code, text) in happened {
                        self.event(report, severity, code, text);
                    }
                }
                if Duration::from_millis(age_ms) <= limit {
                    if self.hung.take().is_some() {
                        self.event(
                            report,
                            Severity::Info,
                            "answers-again",
                            "its event loop runs again",
                        );
                    }
                } else if self.ready {
                    let since = self.heard.checked_sub(Duration::from_millis(age_ms));
                    self.hang(
                        report,
                        since.unwrap_or(self.heard),
                        &format!("its event loop has not run for {age_ms} ms"),
                    );
                }
            }
        }
    }

    /// Notes that it is ready, if it is.
    fn note_ready(&mut self, report: &Reporter) {
        let Phase::Alive(running) = &self.phase else {
            return;
        };
        if self.ready || !self.is_configured() {
            return;
        }
        let seconds = running.started.elapsed().as_secs_f64();
        self.ready = true;
        let text = format!("ready after {seconds:.2} s");
        self.event(report, Severity::Info, "ready", text);
        if let Some(text) = self.unkept.take() {
            self.event(report, Severity::Warning, "not-restored", text);
        }
    }

    /// Reports the first unreadable line. A component that sends nothing else costs the supervisor
    /// time, and is stopped.
    fn reject(&mut self, fault: &str, size: usize, report: &Reporter) {
        if self.garbage == 0 {
            let fault = clean(fault);
            let text = format!("sent {fault} to its supervisor; further faults are not reported");
            self.health.begun("garbage", &text);
            self.event(report, Severity::Warning, "garbage", text);
        }
        self.garbage = self.garbage.saturating_add(size);
        if self.garbage > MOST_GARBAGE && !self.is_asked_to_stop() {
            let text = format!(
                "sent more than {} MiB that its supervisor cannot read, and is stopped",
                MOST_GARBAGE >> 20
            );
            self.event(report, Severity::Error, "garbage", text);
            self.ask_to_stop();
        }
    }

    /// Notes that it hangs since that time.
    pub(super) fn hang(&mut self, report: &Reporter, since: Instant, why: &str) {
        if self.hung.is_none() && !self.is_asked_to_stop() {
            self.hung = Some(since);
            self.event(report, Severity::Warning, "hung", why);
        }
    }

    /// Reports something about this component.
    pub(crate) fn event(
        &self,
        report: &Reporter,
        severity: Severity,
        code: &'static str,
        message: impl Into<String>,
    ) {
        report.event(Event::component(self.name(), severity, code, message));
    }

    /// Reports something about its process.
    pub(crate) fn process_event(
        &self,
        report: &Reporter,
        severity: Severity,
        code: &'static str,
        message: impl Into<String>,
    ) {
        let name = self.process_name();
        report.event(Event::component(name, severity, code, message));
    }

    /// A failure of its process with what that printed last.
    pub(crate) fn failure(&self, reason: &str) -> String {
        let log = self.process_log.as_deref().unwrap_or(&self.log);
        let said = logs::quote(log);
        match unknown_option(&said) {
            Some(option) => format!(
                "{reason}; its program is of an older version, and does not know `{option}`: build it again with `rcdeploy up --build`; {said}"
            ),
            None => format!("{reason}; {said}"),
        }
    }
}

/// The option that a program refused, if it is one that `rcdeploy` passes: those of `args` are the
/// user's.
fn unknown_option(said: &str) -> Option<&str> {
    let (_, refused) = said.rsplit_once("invalid option '")?;
    let (option, _) = refused.split_once('\'')?;
    rc_ddsl::is_own_option(option).then_some(option)
}

#[cfg(test)]
mod tests {
    use super::unknown_option;

    #[test]
    fn a_program_of_an_older_version_is_told_from_a_wrong_argument() {
        let said = |option: &str| format!("base: invalid option '{option}'; see --help");
        assert_eq!(unknown_option(&said("--providers")), Some("--providers"));
        assert_eq!(unknown_option(&said("--speed")), None);
        assert_eq!(
            unknown_option("the log ends with invalid option '--bind"),
            None
        );
    }
}
