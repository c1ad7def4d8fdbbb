//! What a component reports over its link, and the events that follow.

use crate::log::reporter::Reporter;
use crate::supervisor::parameter_changes::Changes;
use crate::supervisor::unit::{HEARTBEAT_LIMIT, Phase, Unit};
use rc_deploy_client::logs;
use rc_management::component::State;
use rc_management::event::{Event, Severity};
use rc_management::lines::Line;
use rc_management::link::ComponentMessage;
use std::time::{Duration, Instant};

impl Unit {
    /// Handles one line of the link.
    pub(crate) fn handle_line(&mut self, line: Line, report: &Reporter) {
        let message = match line {
            Line::Complete(line) => ComponentMessage::decode(&line),
            Line::TooLong => Err("a line of more than 64 KiB".to_owned()),
        };
        match message {
            Ok(message) => self.handle_message(message, report),
            Err(fault) => self.reject(&fault, report),
        }
    }

    /// Reports a link that was closed while the component runs.
    pub(super) fn report_closed_link(&self, report: &Reporter) {
        if self.handle().is_some_and(|handle| !handle.is_linked()) && !self.is_asked_to_stop() {
            self.event(
                report,
                Severity::Warning,
                "link-closed",
                "closed its standard input, which is the link to its supervisor; it is no longer watched",
            );
        }
    }

    fn handle_message(&mut self, message: ComponentMessage, report: &Reporter) {
        let Phase::Alive(running) = &self.phase else {
            return;
        };
        match message {
            ComponentMessage::State { state } => {
                if self.reported == Some(state) {
                    return;
                }
                self.reported = Some(state);
                let severity = match state {
                    State::Emergency => Severity::Warning,
                    _ => Severity::Info,
                };
                self.event(report, severity, "state", state.to_string());
            }
            ComponentMessage::Ready => {
                self.heard = Instant::now();
                if !self.ready {
                    self.ready = true;
                    let seconds = running.started.elapsed().as_secs_f64();
                    let text = format!("ready after {seconds:.2} s");
                    self.event(report, Severity::Info, "ready", text);
                    if let Some(text) = self.unkept.take() {
                        self.event(report, Severity::Warning, "not-restored", text);
                    }
                }
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
                self.forget_changes();
            }
            ComponentMessage::Heartbeat(mut heartbeat) => {
                self.heard = Instant::now();
                self.lost = std::mem::take(&mut heartbeat.lost);
                let age_ms = heartbeat.age_ms;
                if !self.is_asked_to_stop() {
                    for (severity, code, text) in self.health.heartbeat(heartbeat) {
                        self.event(report, severity, code, text);
                    }
                }
                if Duration::from_millis(age_ms) <= HEARTBEAT_LIMIT {
                    if std::mem::take(&mut self.hung) {
                        self.event(
                            report,
                            Severity::Info,
                            "answers-again",
                            "its event loop runs again",
                        );
                    }
                } else if self.ready {
                    self.hang(
                        report,
                        &format!("its event loop has not run for {age_ms} ms"),
                    );
                }
            }
        }
    }

    fn reject(&mut self, fault: &str, report: &Reporter) {
        if !std::mem::replace(&mut self.garbage, true) {
            let text = format!("sent {fault} to its supervisor; further faults are not reported");
            self.event(report, Severity::Warning, "garbage", text);
        }
    }

    pub(super) fn hang(&mut self, report: &Reporter, why: &str) {
        if !self.hung && !self.is_asked_to_stop() {
            self.hung = true;
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

    /// A failure with what the component printed last.
    pub(crate) fn failure(&self, reason: &str) -> String {
        format!("{reason}; {}", logs::quote(&self.log))
    }
}
