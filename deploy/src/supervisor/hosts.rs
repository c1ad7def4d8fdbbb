//! Handles the events of other machines.

use super::supervise::{StopReason, Supervisor};
use crate::remote::{AgentReady, HostEvent};
use rc_deploy_client::error::advice;
use rc_deploy_network::process_name;
use rc_management::agent::{AgentMessage, Exit};
use rc_management::event::Severity;
use rc_management::lines::Line;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The conditions that agents tell: their codes, those of their ends, and how severe they are.
const CONDITIONS: [(&str, &str, Severity); 5] = [
    ("directory-lost", "directory-back", Severity::Error),
    ("disk-full", "disk-free", Severity::Error),
    ("guard-lost", "guard-back", Severity::Error),
    ("not-written", "written", Severity::Warning),
    ("recordings-stopped", "recordings-free", Severity::Warning),
];

impl Supervisor<'_> {
    pub(super) fn announce_hosts(&mut self) {
        for h in self.hosts.indices() {
            let text = format!("connecting to {}", self.hosts.destination(h));
            self.host_event(h, Severity::Info, "host-connecting", &text);
        }
    }

    /// Disconnects the machines after all components have ended. Returns whether all are
    /// disconnected.
    pub(super) fn leave_hosts(&mut self) -> bool {
        self.hosts.leave(Instant::now())
    }

    pub(super) fn read_host(&mut self, h: usize) {
        for events in self.hosts.turn(h, Instant::now()) {
            self.take_host_event(h, events);
        }
    }

    pub(super) fn check_hosts(&mut self, now: Instant) {
        let goes_on = self.ending.is_none();
        let mark = self.network_guard.mark();
        for (h, event) in self.hosts.check(now, mark, goes_on) {
            self.take_host_event(h, event);
        }
    }

    fn host_event(&mut self, h: usize, severity: Severity, code: &'static str, text: &str) {
        let name = self.hosts.name(h);
        let text = format!("host {name}: {text}");
        match code {
            "host-lost" | "host-unreachable" => {
                // Its other conditions are unknown until its next agent reports them.
                self.troubles.forget_all_but("host-lost", name);
                self.troubles.note("host-lost", name, &text);
            }
            "host-back" => drop(self.troubles.remove("host-lost", name)),
            _ => {}
        }
        self.network_event(severity, code, text);
    }

    /// Takes a condition of a machine that begins or ends. An unknown condition comes from an agent
    /// of another version.
    fn host_condition(&mut self, h: usize, code: &str, text: &str, begins: bool) {
        let Some(&(begin, end, severity)) = CONDITIONS.iter().find(|known| known.0 == code) else {
            return;
        };
        let name = self.hosts.name(h).to_owned();
        let text = format!("host {name}: {text}");
        if begins {
            self.troubles.begin_of(&name, severity, begin, &text);
        } else {
            self.troubles.end_of(&name, begin, end, &text);
        }
    }

    pub(super) fn take_host_event(&mut self, h: usize, events: HostEvent) {
        match events {
            HostEvent::Connected(began) => self.host_there(h, &began),
            HostEvent::Unreachable(why) if self.hosts.was_connected(h) => {
                if self.ending.is_none() {
                    let pause = self.hosts.next_attempt(h, Instant::now());
                    let text = format!("{why}; tried again in {:.0} s", pause.as_secs_f64());
                    self.host_event(h, Severity::Warning, "host-unreachable", &text);
                }
            }
            HostEvent::Unreachable(why) => {
                self.host_event(h, Severity::Error, "host-unreachable", &why);
                let message = format!("host {}: {why}", self.hosts.name(h));
                self.stop(StopReason::Failed(message), "a host cannot be used");
            }
            HostEvent::Lost(why) => self.host_lost(h, &why),
            HostEvent::Message(message) => self.take_agent_message(h, message),
        }
    }

    fn host_there(&mut self, h: usize, began: &AgentReady) {
        for i in self.hosts.members(Some(h)) {
            let component = self.hosts.component(h, &self.plan.components[i]);
            self.units[i].remote_component = Some(component);
        }
        if let Some(count) = began.recovered {
            let text = format!(
                "an earlier run there lost its agent and its guard; its files were removed and {count} orphaned processes were killed"
            );
            self.host_event(h, Severity::Warning, "recovered", &text);
        }
        let (files, bytes) = began.copied;
        let copied = match files {
            0 => "nothing had to be copied".to_owned(),
            1 => format!("1 file was copied, {:.1} MB", bytes as f64 / 1e6),
            _ => format!("{files} files were copied, {:.1} MB", bytes as f64 / 1e6),
        };
        if began.again {
            let text = format!("connected again; {copied}");
            self.host_event(h, Severity::Info, "host-back", &text);
        } else {
            let text = format!("connected; {copied}");
            self.host_event(h, Severity::Info, "host-connected", &text);
        }
    }

    /// Marks all components of a lost machine as ended. The agent there ends them.
    fn host_lost(&mut self, h: usize, why: &str) {
        let severity = if self.ending.is_some() {
            Severity::Warning
        } else {
            Severity::Error
        };
        self.host_event(h, severity, "host-lost", why);
        self.renewal.forget(h);
        for i in self.hosts.members(Some(h)) {
            let exit = Exit::without_status("its host was lost".to_owned());
            self.remote_process_ended(i, &exit);
        }
    }

    /// Makes the management socket of a remote component available here.
    fn proxy_socket(&mut self, h: usize, name: &str) {
        let path = self.network_guard.directory().socket(&process_name(name));
        let listens = self.hosts.listen(h, name, &path);
        self.note_written(&path, listens);
    }

    /// The agent has started the process of a unit.
    fn remote_process_started(&mut self, h: usize, i: usize, pid: i32) {
        for j in self.order.mates(i).clone() {
            if let Some(process) = self.units[j].remote_process() {
                process.pid = Some(pid);
                let name = self.units[j].name().to_owned();
                self.proxy_socket(h, &name);
            }
        }
    }

    /// Handles the end of the process of a unit, for all of its units.
    fn remote_process_ended(&mut self, i: usize, exit: &Exit) {
        for j in self.order.mates(i).clone() {
            if let Some(h) = self.hosts.of(j) {
                let name = self.units[j].name().to_owned();
                self.hosts.close(h, &name);
                let path = self.network_guard.directory().socket(&process_name(&name));
                let text = format!("{} is not needed any more", path.display());
                self.troubles
                    .end_of(&path.to_string_lossy(), "not-written", "written", &text);
            }
            if let Some(process) = self.units[j].remote_process() {
                process.ended(exit.clone());
            }
        }
        self.unit_ended(i);
    }

    /// A unit of a process on a machine. All units of the process are on that machine.
    fn unit_of(&self, h: usize, process: &str) -> Option<usize> {
        let mut on = self.hosts.members(Some(h)).into_iter();
        on.find(|i| self.units[*i].process_name() == process)
    }

    /// The log of a component or of a process on a machine.
    fn log_of(&self, h: usize, name: &str) -> Option<PathBuf> {
        let on = self.hosts.members(Some(h)).into_iter();
        let mut logs = on.flat_map(|i| self.units[i].logs());
        logs.find(|(of, _)| *of == name)
            .map(|(_, log)| log.to_owned())
    }

    pub(super) fn take_agent_message(&mut self, h: usize, message: AgentMessage) {
        let on = |name: &str| {
            let mut on = self.hosts.members(Some(h)).into_iter();
            on.find(|i| self.units[*i].name() == name)
        };
        match message {
            AgentMessage::Started { name, pid } => {
                if let Some(i) = self.unit_of(h, &name) {
                    self.remote_process_started(h, i, pid);
                }
            }
            AgentMessage::NotStarted { name, reason } => {
                if let Some(i) = self.unit_of(h, &name) {
                    for &j in self.order.mates(i) {
                        self.units[j].not_started();
                    }
                    self.not_started(i, &reason);
                }
            }
            AgentMessage::LinkLine { name, line } => {
                if let Some(i) = on(&name) {
                    let line = line.map_or(Line::TooLong, |line| Line::Complete(line.into_bytes()));
                    self.units[i].handle_line(line, self.report);
                }
            }
            AgentMessage::LinkClosed(name) => {
                if let Some(i) = on(&name) {
                    if let Some(process) = self.units[i].remote_process() {
                        process.linked = false;
                    }
                    self.units[i].link_closed();
                }
            }
            AgentMessage::Printed { name, text } => {
                if let Some(log) = self.log_of(h, &name) {
                    self.print(&log, &text);
                }
            }
            AgentMessage::Ended { name, exit, left } => {
                if let Some(i) = self.unit_of(h, &name) {
                    self.left_over(&name, left);
                    self.remote_process_ended(i, &exit);
                }
            }
            AgentMessage::Memory { name, bytes } => {
                if let Some(i) = self.unit_of(h, &name) {
                    self.units[i].note_memory(bytes, self.rounds.pause, self.report);
                }
            }
            AgentMessage::Trouble { code, text } => self.host_condition(h, &code, &text, true),
            AgentMessage::TroubleOver { code, text } => {
                self.host_condition(h, &code, &text, false);
            }
            AgentMessage::MemoryLost(files) => self.memory_lost_on(h, &files),
            AgentMessage::Note(text) => self.host_event(h, Severity::Warning, "host-note", &text),
            AgentMessage::Finished { left } if left > 0 => {
                let text = format!("killed {left} orphaned processes of components");
                self.host_event(h, Severity::Warning, "left-over", &text);
            }
            // The other messages belong to the setup, or do not concern the supervisor.
            AgentMessage::Finished { .. }
            | AgentMessage::Data { .. }
            | AgentMessage::Close(_)
            | AgentMessage::Missing(_)
            | AgentMessage::Ready { .. }
            | AgentMessage::Refused(_)
            | AgentMessage::Heartbeat => {}
        }
    }

    /// Appends the output of a remote component or process to its log here.
    fn print(&mut self, log: &Path, text: &str) {
        let file = OpenOptions::new().create(true).append(true).open(log);
        let written = file.and_then(|mut file| file.write_all(text.as_bytes()));
        self.note_written(log, written);
    }

    /// Reports when a file of a remote component here cannot be written, and when it can again.
    fn note_written(&mut self, path: &Path, written: io::Result<()>) {
        let (about, shown) = (path.to_string_lossy(), path.display());
        match written {
            Ok(()) => {
                let text = format!("wrote to {shown}");
                self.troubles
                    .end_of(&about, "not-written", "written", &text);
            }
            Err(error) => {
                let text = format!("cannot write to {shown}: {error}{}", advice(&error));
                self.troubles
                    .begin_of(&about, Severity::Warning, "not-written", &text);
            }
        }
    }
}
