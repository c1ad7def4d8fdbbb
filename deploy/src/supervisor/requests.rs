//! Handles the requests of clients of the supervisor's socket.

use crate::supervisor::commands;
use crate::supervisor::control::ClientRequest;
use crate::supervisor::flight_recorder::FlightRecorder;
use crate::supervisor::proposals::MOST_WAITING;
use crate::supervisor::proxies;
use crate::supervisor::supervise::{StopReason, Supervisor};
use crate::supervisor::unit::Unit;
use rc_management::event::Severity;
use rc_management::supervisor::{CommandResult, NetworkStatus, Request, Verb};
use std::collections::BTreeSet;
use std::time::Instant;

impl Supervisor<'_> {
    /// Serves at most one request of each client.
    pub(super) fn serve(&mut self) {
        for request in self.control.requests() {
            match request.request.clone() {
                Request::Start { names } => self.take_command(request, Verb::Start, &names),
                Request::Stop { names } => self.take_command(request, Verb::Stop, &names),
                Request::Restart { names } => self.take_command(request, Verb::Restart, &names),
                Request::Lifecycle { transition, names } => {
                    self.take_command(request, Verb::Lifecycle(transition), &names);
                }
                Request::Status => {
                    let status = self.status();
                    self.control.answer_status(&request, &status);
                }
                Request::Events => {
                    let journal = self.report.journal();
                    self.control.answer_events(&request, &journal);
                }
                Request::Ring => self.write_ring(&request),
                Request::Chains { known } => {
                    let chains = self
                        .chains
                        .as_ref()
                        .map(|chains| chains.status(known.as_deref()));
                    let chains = chains.unwrap_or_default();
                    self.control.answer_chains(&request, &chains);
                }
                Request::ParametersSet { .. } => self.take_proposal(request),
                Request::Down => {
                    self.control.answer_down(&request);
                    self.stop(StopReason::Asked, "asked by `rcdeploy down`");
                }
            }
        }
    }

    fn write_ring(&mut self, request: &ClientRequest) {
        let reason = match self.recorder.as_mut().map(FlightRecorder::write) {
            Some(true) => {
                let done = CommandResult::default();
                return self.control.answer_command(request, &done);
            }
            Some(false) => "the recorder of the ring does not run at the moment",
            None => {
                "this network keeps no ring; write `record { ring 60s; };` in its .ddsl, or use `rcdeploy record --ring`"
            }
        };
        self.control.answer_refused(request, reason);
    }

    fn status(&self) -> NetworkStatus {
        let mut components: Vec<_> = self.units.iter().map(Unit::status).collect();
        proxies::take_states(&mut components);
        NetworkStatus {
            network: self.plan.network.clone(),
            pid: std::process::id() as i32,
            guard: self.network_guard.guard(),
            directory: self.network_guard.directory().path().to_owned(),
            troubles: self.troubles.list(),
            ddsl: self.plan.ddsl.clone(),
            digest: self.digest.clone(),
            changed: false,
            components,
        }
    }

    /// Continues the commands of clients.
    pub(super) fn advance_commands(&mut self) {
        let answers = if self.ending.is_none() {
            let now = Instant::now();
            self.commands
                .advance(&mut self.units, self.order.all_needs(), now)
        } else {
            self.commands.end(&self.units)
        };
        for (request, result) in answers {
            self.control.answer_command(&request, &result);
        }
    }

    /// Begins a command, or answers why it is refused.
    pub(super) fn take_command(&mut self, request: ClientRequest, verb: Verb, names: &[String]) {
        let all: Vec<&str> = self.units.iter().map(Unit::name).collect();
        let meant = commands::with_processes(names, &self.units);
        let selected = match verb {
            Verb::Lifecycle(_) => self.managed(&meant, &all),
            Verb::Start | Verb::Stop | Verb::Restart => {
                commands::select(&meant, &all).and_then(|selected| {
                    commands::check_whole(&selected, verb, &self.units, self.order.all_mates())?;
                    Ok(selected)
                })
            }
        };
        let members = match selected {
            Ok(members) if self.ending.is_none() => members,
            Ok(_) => return self.control.answer_refused(&request, "the network stops"),
            Err(wrong) => return self.control.answer_refused(&request, &wrong),
        };
        let text = match names {
            [] => format!("asked to {} all managed components", verb.word()),
            names => format!("asked to {} {}", verb.word(), names.join(", ")),
        };
        self.network_event(Severity::Info, "asked", text);
        self.failed.retain(|name| {
            let again = |&i: &usize| {
                let unit = &self.units[i];
                unit.name() == name || unit.process_name() == name
            };
            !members.iter().any(again)
        });
        self.commands.take(request, verb, members, &mut self.units);
    }

    /// Stops a component, with all of its process, because a chain is late.
    pub(super) fn stop_late(&mut self, name: &str) {
        let Some(i) = self.units.iter().position(|unit| unit.name() == name) else {
            return;
        };
        let mates = self.order.mates(i).iter();
        let names: Vec<String> = mates.map(|&i| self.units[i].name().to_owned()).collect();
        let request = ClientRequest::own(Request::Stop {
            names: names.clone(),
        });
        self.take_command(request, Verb::Stop, &names);
    }

    /// The managed components that `names` mean; without names, all of them.
    fn managed(&self, names: &[String], all: &[&str]) -> Result<BTreeSet<usize>, String> {
        let is_managed = |i: &usize| self.units[*i].is_managed();
        if names.is_empty() {
            let found: BTreeSet<usize> = (0..all.len()).filter(is_managed).collect();
            if found.is_empty() {
                return Err("no component of this network is managed".to_owned());
            }
            return Ok(found);
        }
        let mut found = BTreeSet::new();
        for name in names {
            let mut meant = commands::select(std::slice::from_ref(name), all)?;
            meant.retain(is_managed);
            if meant.is_empty() {
                return Err(format!(
                    "`{name}` is not managed: its .cdsl has no `lifecycle managed;`"
                ));
            }
            found.extend(meant);
        }
        Ok(found)
    }

    /// Takes a request, or answers why it is refused.
    pub(super) fn take_proposal(&mut self, request: ClientRequest) {
        if let Some(request) = self.proposals.take(request) {
            let text = format!("{MOST_WAITING} changes of parameters wait; try again");
            self.control.answer_refused(&request, &text);
        }
    }

    /// Continues the changes of parameters.
    pub(super) fn advance_proposals(&mut self) {
        let ends = self.ending.is_some();
        let (outcomes, undone) = self.proposals.advance(&mut self.units, ends);
        for reason in undone {
            let text = format!("a change of parameters is taken back: {reason}");
            self.network_event(Severity::Warning, "parameters-undone", text);
        }
        for (request, result) in outcomes {
            match result {
                Ok(changed) => self.control.answer_changed(&request, &changed),
                Err(reason) => self.control.answer_refused(&request, &reason),
            }
        }
        for i in 0..self.units.len() {
            if self.units[i].proposal.take_configured() {
                let broken = self.proposals.configured(self.units[i].name());
                if !broken.is_empty() {
                    let text = format!("rules of the network are broken: {}", broken.join("; "));
                    self.network_event(Severity::Warning, "rule-broken", text);
                }
            }
        }
    }
}
