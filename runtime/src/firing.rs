//! Events that tools fire: on their way to the state machine, and the result on its way back.
//!
//! The management thread checks the name. The worker's thread gives the event to the machine in the
//! component's turn, after the events that wait, and says what became of it.

use crate::commands::{Command, CommandQueue};
use crate::fired_event::FiredEvent;
use crate::lifecycle::LifecycleState;
use crate::machine_record::MachineRecord;
use crate::parameter_server::{Answer, Requester};
use crate::status::Shared;
use crate::waker::Waker;
use rc_management::component::Fired;
use rc_management::rpc::{self, Error};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The limit for the machine to take an event.
const FIRE_LIMIT: Duration = Duration::from_secs(3);

/// The most events that are with the worker's thread. A client that leaves can leave one behind.
const MOST_FIRED: usize = 64;

struct InFlight {
    requester: Requester,
    until: Instant,
    fired: Arc<FiredEvent>,
}

/// The events that are with the worker's thread.
pub(crate) struct FireServer {
    in_flight: Vec<InFlight>,
    commands: Arc<CommandQueue>,
    management: Waker,
}

impl FireServer {
    pub(crate) fn new(commands: Arc<CommandQueue>, management: Waker) -> Self {
        Self {
            in_flight: Vec::new(),
            commands,
            management,
        }
    }

    /// Fires an event, if the component allows it from outside. [`FireServer::turn`] returns the
    /// result.
    pub(crate) fn fire(
        &mut self,
        requester: Requester,
        event: &str,
        shared: &Shared,
    ) -> Result<(), Error> {
        let state = shared.lifecycle.as_ref().map(|lifecycle| lifecycle.state());
        if let Some(state) = state.filter(|state| *state != LifecycleState::Active) {
            return Err(Error::new(Error::WORKER_REFUSES, not_active(state)));
        }
        let event = number(shared.status().machine.as_ref(), event)?;
        if self.in_flight.len() >= MOST_FIRED {
            let message = format!("{MOST_FIRED} other events wait; fire it again later");
            return Err(Error::new(Error::WORKER_TIMEOUT, message));
        }
        let fired = Arc::new(FiredEvent::new(event, self.management.clone()));
        self.commands.push(Command::Fire(fired.clone()));
        self.in_flight.push(InFlight {
            requester,
            until: Instant::now() + FIRE_LIMIT,
            fired,
        });
        Ok(())
    }

    /// The results that are due.
    pub(crate) fn turn(&mut self) -> Vec<Answer> {
        let now = Instant::now();
        let is_due = |one: &InFlight| {
            let ended = one.fired.has_ended();
            ended || now >= one.until
        };
        self.conclude(is_due, |in_machine| {
            if in_machine {
                format!("the event has begun, and has not ended within {FIRE_LIMIT:?}")
            } else {
                format!(
                    "the machine has not taken the event within {FIRE_LIMIT:?}; it is withdrawn"
                )
            }
        })
    }

    /// Withdraws all events: the component ends.
    pub(crate) fn end(&mut self) -> Vec<Answer> {
        let reason = |in_machine| {
            let what = if in_machine {
                "has not ended"
            } else {
                "is withdrawn"
            };
            format!("the component ends; the event {what}")
        };
        self.conclude(|_| true, reason)
    }

    /// The time until the first limit.
    pub(crate) fn time_left(&self) -> Option<Duration> {
        let first = self.in_flight.iter().map(|one| one.until).min()?;
        Some(first.saturating_duration_since(Instant::now()))
    }

    /// The results of the events that are due. Without one, `reason` says why, from whether the
    /// machine has the event.
    fn conclude(
        &mut self,
        is_due: impl Fn(&InFlight) -> bool,
        reason: impl Fn(bool) -> String,
    ) -> Vec<Answer> {
        let due = self.in_flight.extract_if(.., |one| is_due(one));
        due.map(
            |InFlight {
                 requester, fired, ..
             }| {
                let result = fired.conclude(&reason);
                let fired = result.and_then(|states| rpc::result(&Fired { states }));
                (requester, fired)
            },
        )
        .collect()
    }
}

/// Why a component that is not active takes no event.
pub(crate) fn not_active(state: LifecycleState) -> String {
    format!("the component is {state}; its machine takes events while it is active")
}

/// The number of an event that may be fired from outside.
fn number(machine: Option<&MachineRecord>, event: &str) -> Result<u16, Error> {
    let refuse = |message: String| Error::new(Error::INVALID_PARAMS, message);
    let machine = machine.ok_or_else(|| {
        refuse("the component has no state machine, or has not started it yet".to_owned())
    })?;
    if let Some(number) = machine.external(event) {
        return Ok(number);
    }
    let external: Vec<&str> = machine.external_events().collect();
    if external.is_empty() {
        let message = "no event of this component may be fired from outside; \
                       list those that may in its .cdsl: `statemachine \"FILE\" { external EVENT; }`";
        return Err(refuse(message.to_owned()));
    }
    let what = if machine.has_event(event) {
        "may not be fired from outside"
    } else {
        "is not an event of this component"
    };
    let near = rc_diagnostics::nearest(event, external.iter().copied());
    let instead = near.map_or_else(
        || format!("expected one of `{}`", external.join("`, `")),
        |near| format!("did you mean `{near}`?"),
    );
    Err(refuse(format!("`{event}` {what}; {instead}")))
}
