//! Changes of parameters of several components, and of those that rules of the network read.
//!
//! Each component offers its part to its worker and holds it. If all have accepted, all keep their
//! parts, and a later run of one begins with its part; else each undoes its part. A component that
//! ends before all have accepted ends the change.

use crate::supervisor::commands;
use crate::supervisor::control::ClientRequest;
use crate::supervisor::unit::Unit;
use rc_deploy_network::{NetworkRules, RuledChanges};
use rc_management::component::Changed;
use rc_management::link::SupervisorMessage;
use rc_management::supervisor::{ParametersChanged, Request};
use serde_json::{Map, Value};
use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

/// The limit for the decisions of all components; each of them has a shorter one.
const DECISION_LIMIT: Duration = Duration::from_secs(4);
/// The limit for the rest: a worker gets its old values in its turn. Components get the decision
/// for the last time while they still hold their parts.
const SETTLE_LIMIT: Duration = Duration::from_millis(2500);
/// How often the decision is repeated.
const MOST_TOLD: u32 = 2;
/// How many changes wait for the one that is under way.
pub(super) const MOST_WAITING: usize = 16;

/// The rules of a network, and the changes under way.
#[derive(Debug)]
pub(crate) struct Proposals {
    rules: NetworkRules,
    /// With the values with which the components begin.
    start: NetworkRules,
    waiting: VecDeque<ClientRequest>,
    round: Option<Round>,
    /// The number of the last change.
    number: u64,
}

/// The change that is under way.
#[derive(Debug)]
struct Round {
    request: ClientRequest,
    number: u64,
    ruled: RuledChanges,
    /// The parts by the numbers of their units.
    parts: BTreeMap<usize, Part>,
    stage: Stage,
    deadline: Instant,
    /// How often the decision was sent.
    told: u32,
}

/// The part of one component.
#[derive(Debug)]
struct Part {
    changes: Map<String, Value>,
    /// The run of the unit that got it. A later run does not know it.
    run: u32,
    accepted: Option<Changed>,
    /// Whether the component has nothing more to do for it, or has ended.
    settled: bool,
}

#[derive(Debug)]
enum Stage {
    /// The workers decide.
    Proposed,
    /// All have accepted, and keep their parts.
    Kept,
    /// Each takes its part back, for this reason.
    TakenBack(String),
}

/// The result of a change, for its requester.
type Outcome = (ClientRequest, Result<ParametersChanged, String>);

impl Proposals {
    pub(crate) fn new(rules: NetworkRules) -> Self {
        Self {
            start: rules.clone(),
            rules,
            waiting: VecDeque::new(),
            round: None,
            number: 0,
        }
    }

    /// Takes a request, or gives it back if too many wait.
    pub(super) fn take(&mut self, request: ClientRequest) -> Option<ClientRequest> {
        if self.waiting.len() >= MOST_WAITING {
            return Some(request);
        }
        self.waiting.push_back(request);
        None
    }

    /// A component runs with its configuration, without the changes of earlier runs. Returns the
    /// rules that are broken now.
    pub(super) fn configured(&mut self, component: &str) -> Vec<String> {
        self.rules.reset(component, &self.start)
    }

    /// The deadline of the present step.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.round.as_ref().map(|round| round.deadline)
    }

    /// Takes the answers of the components, and makes the next step. Returns results of changes,
    /// and reasons why some were undone. `ends`: the network stops.
    pub(super) fn advance(
        &mut self,
        units: &mut [Unit],
        ends: bool,
    ) -> (Vec<Outcome>, Vec<String>) {
        let (mut outcomes, mut undone) = (Vec::new(), Vec::new());
        loop {
            if let Some(mut round) = self.round.take() {
                let was_open = matches!(round.stage, Stage::Proposed);
                round.advance(units, ends);
                match &round.stage {
                    Stage::Kept if was_open => self.rules.apply(round.ruled.clone()),
                    Stage::TakenBack(reason) if was_open && round.has_changed(units) => {
                        undone.push(reason.clone());
                    }
                    Stage::Proposed | Stage::Kept | Stage::TakenBack(_) => {}
                }
                if !round.is_over() && !ends {
                    self.round = Some(round);
                    return (outcomes, undone);
                }
                outcomes.push(round.outcome(units));
            }
            let Some(request) = self.waiting.pop_front() else {
                return (outcomes, undone);
            };
            match self.begin(&request, units, ends) {
                Ok((ruled, parts)) => {
                    self.number += 1;
                    let round = Round::begin(request, self.number, ruled, parts, units);
                    self.round = Some(round);
                }
                Err(refused) => outcomes.push((request, Err(refused))),
            }
        }
    }

    /// The parts of a change, if nothing speaks against it.
    fn begin(
        &self,
        request: &ClientRequest,
        units: &[Unit],
        ends: bool,
    ) -> Result<(RuledChanges, BTreeMap<usize, Part>), String> {
        if ends {
            return Err("the network stops".to_owned());
        }
        let Request::ParametersSet { changes } = &request.request else {
            return Err("this is not a change of parameters".to_owned());
        };
        let names: Vec<&str> = units.iter().map(Unit::name).collect();
        let mut parts = BTreeMap::new();
        for (name, changes) in changes {
            let Some(i) = names.iter().position(|known| known == name) else {
                return Err(commands::unknown(name, &names));
            };
            let unit = &units[i];
            if !unit.is_alive() || !unit.is_ready() || unit.is_asked_to_stop() {
                return Err(format!("`{name}` does not run, or is not ready"));
            }
            let part = Part {
                changes: changes.clone(),
                run: unit.runs,
                accepted: None,
                settled: false,
            };
            parts.insert(i, part);
        }
        let ruled = self.rules.check(changes)?;
        Ok((ruled, parts))
    }
}

impl Round {
    /// Sends each component its part.
    fn begin(
        request: ClientRequest,
        number: u64,
        ruled: RuledChanges,
        parts: BTreeMap<usize, Part>,
        units: &[Unit],
    ) -> Self {
        for (&i, part) in &parts {
            let changes = part.changes.clone();
            units[i].tell(&SupervisorMessage::Propose { number, changes });
        }
        Self {
            request,
            number,
            ruled,
            parts,
            stage: Stage::Proposed,
            deadline: Instant::now() + DECISION_LIMIT,
            told: 0,
        }
    }

    fn advance(&mut self, units: &mut [Unit], ends: bool) {
        let mut against = None;
        for (&i, part) in self.parts.iter_mut().filter(|(_, part)| !part.settled) {
            let unit = &mut units[i];
            match unit.proposal.take_answer(self.number) {
                Some(Ok(changed)) => part.accepted = Some(changed),
                Some(Err(reason)) => {
                    part.settled = true;
                    against.get_or_insert(format!("`{}` refuses: {reason}", unit.name()));
                }
                None => {}
            }
            if unit.proposal.is_settled(self.number) {
                part.settled = true;
                // It holds its part for a while only. This counts only before all have accepted.
                against.get_or_insert(format!("`{}` has taken its part back", unit.name()));
            }
            if !unit.is_alive() || unit.runs != part.run {
                part.settled = true;
                against.get_or_insert(format!("`{}` has ended", unit.name()));
            }
        }
        if !matches!(self.stage, Stage::Proposed) {
            if Instant::now() >= self.deadline && !self.is_settled() {
                self.tell(units);
            }
            return;
        }
        if ends {
            against.get_or_insert("the network stops".to_owned());
        }
        let mut undecided = self
            .parts
            .iter()
            .filter(|(_, part)| part.accepted.is_none());
        let undecided = undecided.next().map(|(&i, _)| i);
        if Instant::now() >= self.deadline {
            // Also if all have accepted meanwhile: who has waited for too long takes its part back.
            let who = match undecided {
                Some(i) => format!("`{}`", units[i].name()),
                None => "the supervisor".to_owned(),
            };
            against.get_or_insert(format!("{who} has not decided within {DECISION_LIMIT:?}"));
        }
        match against {
            Some(reason) => self.stage = Stage::TakenBack(reason),
            None if undecided.is_none() => {
                self.stage = Stage::Kept;
                for (&i, part) in &self.parts {
                    let accepted = part.accepted.clone().unwrap_or_default();
                    units[i].changes.keep(&part.changes, &accepted);
                }
            }
            None => return,
        }
        self.tell(units);
    }

    /// Sends the decision to the components. A line may have been lost, so it is repeated.
    fn tell(&mut self, units: &[Unit]) {
        self.told += 1;
        self.deadline = Instant::now() + SETTLE_LIMIT;
        let (number, keep) = (self.number, matches!(self.stage, Stage::Kept));
        for (&i, _) in self.parts.iter().filter(|(_, part)| !part.settled) {
            units[i].tell(&SupervisorMessage::Settle { number, keep });
        }
    }

    fn is_settled(&self) -> bool {
        self.parts.values().all(|part| part.settled)
    }

    fn is_over(&self) -> bool {
        !matches!(self.stage, Stage::Proposed) && (self.is_settled() || self.told > MOST_TOLD)
    }

    /// Whether a worker had its part, or may have had it.
    fn has_changed(&self, units: &[Unit]) -> bool {
        let parts = self.parts.iter();
        parts.clone().any(|(_, part)| part.accepted.is_some())
            || parts
                .into_iter()
                .any(|(&i, part)| units[i].runs != part.run || !units[i].is_alive())
    }

    fn outcome(self, units: &[Unit]) -> Outcome {
        let open = self.parts.iter().filter(|(_, part)| !part.settled);
        let open: Vec<String> = open
            .map(|(&i, _)| format!("`{}`", units[i].name()))
            .collect();
        let result = match self.stage {
            Stage::Kept => {
                let parts = self.parts.into_iter();
                let changed = parts.map(|(i, part)| {
                    let name = units[i].name().to_owned();
                    (name, part.accepted.unwrap_or_default())
                });
                Ok(ParametersChanged {
                    components: changed.collect(),
                })
            }
            Stage::Proposed => Err("the network stops; nothing has changed".to_owned()),
            Stage::TakenBack(reason) if open.is_empty() => {
                Err(format!("{reason}; nothing has changed"))
            }
            Stage::TakenBack(reason) => Err(format!(
                "{reason}; {} undoes its part when its worker has time",
                open.join(", ")
            )),
        };
        (self.request, result)
    }
}
