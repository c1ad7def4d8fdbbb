//! The other machines of a network: what the supervisor makes of their news.

use super::supervise::{StopReason, Supervisor};
use crate::remote::{AgentReady, Host, HostEvent, Setup};
use crate::supervisor::up::Options;
use rc_deploy_client::error::advice;
use rc_deploy_client::logs;
use rc_deploy_network::plan::Plan;
use rc_deploy_network::process_name;
use rc_management::agent::{AgentMessage, Exit};
use rc_management::event::Severity;
use rc_management::lines::Line;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

/// The machines that the plan names, and for each component, which of them it runs on. Those with one address and one
/// user are one.
pub(super) fn of(
    plan: &Plan,
    options: &Options,
    log_directory: &Path,
) -> (Vec<Host>, Vec<Option<usize>>) {
    let mut hosts: Vec<rc_deploy_network::plan::Host> = Vec::new();
    let mut host_of = Vec::new();
    for component in &plan.components {
        host_of.push(component.host.as_ref().map(|host| {
            let same = |h: &rc_deploy_network::plan::Host| {
                (&h.address, &h.user) == (&host.address, &host.user)
            };
            hosts.iter().position(same).unwrap_or_else(|| {
                hosts.push(host.clone());
                hosts.len() - 1
            })
        }));
    }
    let hosts = hosts.into_iter().enumerate().map(|(h, host)| {
        let components = plan.components.iter().zip(&host_of);
        let components = components.filter(|(_, of)| **of == Some(h));
        let files = components.flat_map(|(c, _)| c.files.iter().chain([&c.executable]));
        let mut files: Vec<_> = files.cloned().collect();
        files.sort();
        files.dedup();
        let setup = Setup {
            network: plan.network.clone(),
            files,
            services: options.services.get(&host.name).cloned(),
        };
        let log = logs::file(
            log_directory,
            &format!("{}-{}", logs::SUPERVISOR, host.name),
        );
        Host::new(host, setup, log)
    });
    (hosts.collect(), host_of)
}

impl Supervisor<'_> {
    /// Whether a unit can be started as far as its machine matters. Nothing starts before all machines have been
    /// there: what cannot be reached is known before anything moves.
    pub(super) fn has_host(&self, i: usize) -> bool {
        self.hosts.iter().all(Host::was_there)
            && self.host_of[i].is_none_or(|h| self.hosts[h].is_there())
    }

    pub(super) fn announce_hosts(&self) {
        for h in 0..self.hosts.len() {
            let text = format!("connecting to {}", self.hosts[h].destination());
            self.host_event(h, Severity::Info, "host-connecting", &text);
        }
    }

    /// All components have ended: lets the machines go, and gives whether they have gone.
    pub(super) fn leave_hosts(&mut self) -> bool {
        let now = Instant::now();
        self.hosts.iter_mut().for_each(|host| host.leave(now));
        self.hosts.iter().all(Host::is_over)
    }

    pub(super) fn read_host(&mut self, h: usize) {
        for events in self.hosts[h].turn(Instant::now()) {
            self.take_host_event(h, events);
        }
    }

    pub(super) fn check_hosts(&mut self, now: Instant) {
        for h in 0..self.hosts.len() {
            // Where all ends, nobody connects again.
            if self.ending.is_some() && !self.hosts[h].is_there() {
                self.hosts[h].leave(now);
            }
            if let Some(events) = self.hosts[h].check(now, self.custody.mark()) {
                self.take_host_event(h, events);
            }
        }
    }

    fn host_event(&self, h: usize, severity: Severity, code: &'static str, text: &str) {
        let text = format!("host {}: {text}", self.hosts[h].plan.name);
        self.network_event(severity, code, text);
    }

    fn take_host_event(&mut self, h: usize, events: HostEvent) {
        match events {
            HostEvent::Connected(began) => self.host_there(h, &began),
            HostEvent::Unreachable(why) if self.hosts[h].was_there() => {
                if self.ending.is_none() {
                    let pause = self.hosts[h].next_attempt(Instant::now());
                    let text = format!("{why}; tried again in {:.0} s", pause.as_secs_f64());
                    self.host_event(h, Severity::Warning, "host-unreachable", &text);
                }
            }
            HostEvent::Unreachable(why) => {
                self.host_event(h, Severity::Error, "host-unreachable", &why);
                let message = format!("host {}: {why}", self.hosts[h].plan.name);
                self.stop(StopReason::Failed(message), "a host cannot be used");
            }
            HostEvent::Lost(why) => self.host_lost(h, &why),
            HostEvent::Message(message) => self.take_agent_message(h, message),
        }
    }

    fn host_there(&mut self, h: usize, began: &AgentReady) {
        for i in self.units_on(h) {
            let component = self.hosts[h].component(&self.plan.components[i]);
            self.units[i].remote_component = Some(component);
        }
        if let Some(count) = began.recovered {
            let text = format!(
                "an earlier run there had lost its agent and its guard; what it left was removed, {count} processes were killed"
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
            let text = format!("it is back; {copied}");
            self.host_event(h, Severity::Info, "host-back", &text);
        } else {
            let text = format!("connected; {copied}");
            self.host_event(h, Severity::Info, "host-connected", &text);
        }
    }

    fn units_on(&self, h: usize) -> impl Iterator<Item = usize> + use<> {
        let of = self.host_of.iter().enumerate();
        let on = of.filter(move |(_, of)| **of == Some(h));
        on.map(|(i, _)| i).collect::<Vec<_>>().into_iter()
    }

    /// All that ran there has ended, as far as the network is concerned; the agent sees to it that it has.
    fn host_lost(&mut self, h: usize, why: &str) {
        let severity = if self.ending.is_some() {
            Severity::Warning
        } else {
            Severity::Error
        };
        self.host_event(h, severity, "host-lost", why);
        for i in self.units_on(h) {
            let exit = Exit::without_status("its host was lost".to_owned());
            self.remote_process_ended(i, exit);
        }
    }

    /// Lets the management of a component there be called as if it was here.
    fn proxy_socket(&mut self, h: usize, name: &str) {
        let path = self.custody.directory().socket(&process_name(name));
        if let Err(error) = self.hosts[h].listen(name, &path) {
            let text = format!("cannot listen at {}: {error}", path.display());
            self.network_event(Severity::Warning, "not-written", text);
        }
    }

    fn remote_process_ended(&mut self, i: usize, exit: Exit) {
        if let Some(h) = self.host_of[i] {
            self.hosts[h].close(self.units[i].name());
        }
        if let Some(process) = self.units[i].remote_process() {
            process.ended(exit);
            self.unit_ended(i);
        }
    }

    fn take_agent_message(&mut self, h: usize, message: AgentMessage) {
        let on = |name: &str| {
            let mut on = self.units_on(h);
            on.find(|i| self.units[*i].name() == name)
        };
        match message {
            AgentMessage::Started { name, pid } => {
                if let Some(process) = on(&name).and_then(|i| self.units[i].remote_process()) {
                    process.pid = Some(pid);
                    self.proxy_socket(h, &name);
                }
            }
            AgentMessage::NotStarted { name, reason } => {
                if let Some(i) = on(&name) {
                    self.units[i].not_started();
                    self.not_started(i, &reason);
                }
            }
            AgentMessage::LinkLine { name, line } => {
                if let Some(i) = on(&name) {
                    let line = line.map_or(Line::TooLong, |line| Line::Complete(line.into_bytes()));
                    self.units[i].hear(line, self.report);
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
                if let Some(i) = on(&name) {
                    self.print(i, &text);
                }
            }
            AgentMessage::Ended { name, exit, left } => {
                if let Some(i) = on(&name) {
                    self.left_over(&name, left);
                    self.remote_process_ended(i, exit);
                }
            }
            AgentMessage::Note(text) => self.host_event(h, Severity::Warning, "host-note", &text),
            AgentMessage::Finished { left } if left > 0 => {
                let text = format!("killed {left} processes that components had left behind");
                self.host_event(h, Severity::Warning, "left-over", &text);
            }
            // The others are of the beginning only, or are no business of the supervisor.
            AgentMessage::Finished { .. }
            | AgentMessage::Data { .. }
            | AgentMessage::Close(_)
            | AgentMessage::Missing(_)
            | AgentMessage::Ready { .. }
            | AgentMessage::Refused(_)
            | AgentMessage::Heartbeat => {}
        }
    }

    /// Appends to the log here what a component has printed there.
    fn print(&self, i: usize, text: &str) {
        let log = &self.units[i].log;
        let file = OpenOptions::new().create(true).append(true).open(log);
        if let Err(error) = file.and_then(|mut file| file.write_all(text.as_bytes())) {
            let text = format!(
                "cannot write to {}: {error}{}",
                log.display(),
                advice(&error)
            );
            self.network_event(Severity::Warning, "not-written", text);
        }
    }
}
