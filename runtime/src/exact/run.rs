//! Runs a component again, by its recording alone.

use super::entry::{Entry, Kind};
use super::error_codes;
use super::mode::Exact;
use super::replay::{Replay, Setting};
use super::replayed_reply::Replying;
use super::start::Start as Began;
use crate::arguments::Arguments;
use crate::clock::SimulatedClock;
use crate::component::Body;
use crate::component::Component;
use crate::configuration;
use crate::context::Core;
use crate::description::Description;
use crate::error::StartError;
use crate::event_loop::{answer, receive};
use crate::log;
use crate::ports::{Connections, Ports};
use crate::slots::SlotTable;
use crate::start::Start;
use crate::status::{NetworkTime, Shared};
use crate::worker_error::WorkerError;
use rc_configuration::{ParamChange, Values};
use rc_management::component::ClockKind;
use rc_middleware::{Message, WakeEvent};
use std::io;
use std::rc::Rc;
use std::sync::Arc;

/// Repeats the recording on standard input: parts of turns, each after its length (`uint32`).
/// Prints a report as JSON, and ends the process at the first difference.
pub(crate) fn replay<C: Component>(
    description: &'static Description,
    start: impl Start<C>,
    arguments: &Arguments,
) -> Result<(), StartError> {
    let _log = log::start(arguments.log.as_deref(), true, &log::Output::Process)?;
    let clock = Arc::new(SimulatedClock::default());
    let input = Box::new(io::BufReader::new(io::stdin()));
    let replay = Rc::new(Replay::new(description, Arc::clone(&clock), input));
    let wrong = |reason: String| StartError::Usage(format!("--replay: {reason}"));
    let first = replay.pop().filter(|entry| entry.kind == Kind::Start);
    let first = first.ok_or_else(|| wrong("standard input has no recording".to_owned()))?;
    let began = Began::from_json(&first.text).map_err(wrong)?;
    let values = values(description, arguments, &began).map_err(wrong)?;
    let wake_event = WakeEvent::new().map_err(|e| StartError::cannot_create("an event", &e))?;
    let names = (began.network.as_str(), began.name.as_str());
    let slots = SlotTable::replayed(description, names, began.members.clone());
    let slots = replay.slots.get_or_init(|| Arc::new(slots));
    let time = NetworkTime::new(began.clock, clock.clone());
    let shared = Arc::new(Shared::new(
        wake_event,
        description.period,
        slots.len(),
        time,
        false,
    ));
    shared.status().schema.clone_from(&began.schema);
    let exact = Exact::Replay(Rc::clone(&replay));
    let mut ports = Connections::replayed(description, slots, &began.network, began.clock, &exact);
    if began.clock == ClockKind::Source {
        ports.simulate_time(&clock);
    }
    let core = Core::exact(
        &began.name,
        &began.network,
        shared.clone(),
        exact,
        began.seed,
    );
    let settings = |setting: Setting| match setting {
        Setting::State(state) => shared.status().state = state,
        Setting::Period(period) => shared.status().period = period,
    };
    replay.settings(&mut { settings });
    let initialize = replay.begin_turn(&mut { settings });
    if initialize.is_none_or(|turn| turn.kind != Kind::Initialize) {
        return Err(wrong(
            "the recording does not begin with the start".to_owned(),
        ));
    }
    let ports: Ports = Rc::new(ports);
    let component = start(core, &ports, &values);
    let mut component = match component {
        Ok(component) => component,
        Err(StartError::Worker(reason)) => {
            replay.compare(&error_codes::of_worker(&WorkerError::Failed(reason)));
            replay.end(None)
        }
        Err(other) => return Err(other),
    };
    loop {
        let turn = replay.begin_turn(&mut |setting| {
            if matches!(setting, Setting::Period(_)) {
                component.core().new_period = None;
            }
            settings(setting);
        });
        let Some(turn) = turn else { replay.end(None) };
        run_turn(&replay, &mut component, &turn).map_err(wrong)?;
    }
}

/// Lets the worker do one turn again.
fn run_turn(
    replay: &Rc<Replay>,
    component: &mut dyn Component,
    turn: &Entry<'_>,
) -> Result<(), String> {
    let slot = usize::from(turn.slot);
    match turn.kind {
        Kind::Compute => replay.result(&component.compute()),
        Kind::React => replay.result(&component.react()),
        Kind::Turn => {
            component.turn();
        }
        Kind::Emergency => component.emergency(),
        Kind::Restore => component.restore(),
        Kind::Finalize => component.finalize(),
        Kind::Parameters => component.set_parameters(&Values::from_record(&json(turn)?, None)?),
        Kind::Changed => {
            let changes = ParamChange::from_record(&json(turn)?)?;
            replay.result(&component.parameters_changed(&changes));
        }
        Kind::Ended => {
            let of = replay.slots().get(slot);
            let of = of.ok_or_else(|| "the recording is of other slots".to_owned())?;
            replay.end_call(slot, turn.value);
            component.end_call(of.described, of.member.as_ref());
        }
        Kind::Sample => {
            let operation = usize::from(turn.operation);
            let slots = replay.slots();
            let of = slots.get(slot).filter(|of| operation < of.operations.len());
            let of = of.ok_or_else(|| "the recording is of other slots".to_owned())?;
            // Errors of the handler are in the log; an invalid value is invalid again.
            let header = turn.header(turn.value);
            let _ = receive(
                component,
                &of,
                operation,
                header,
                Body::Borrowed(&turn.data),
            );
        }
        Kind::Request => {
            let mut reply = Replying::new(turn.operation);
            let of = replay.slots().get(slot);
            let of = of.ok_or_else(|| "the recording is of other slots".to_owned())?;
            let header = turn.header(turn.value);
            let request = Message::Bytes(&turn.data);
            let _ = answer(component, &of, None, header, &request, &mut reply);
            replay.compare(&reply.into_entry(slot));
        }
        _ => return Err(format!("a turn cannot begin with `{}`", turn.kind.word())),
    }
    Ok(())
}

fn json(turn: &Entry<'_>) -> Result<serde_json::Value, String> {
    serde_json::from_str(&turn.text).map_err(|e| e.to_string())
}

/// The parameters at the start. Secrets are not recorded: they are those of the configuration.
fn values(
    description: &Description,
    arguments: &Arguments,
    began: &Began,
) -> Result<Values, String> {
    let model = format!("{:016x}", description.model_hash);
    if began.component != description.name {
        return Err(format!(
            "the recording is of `{}`, and this is `{}`",
            began.component, description.name
        ));
    }
    if began.model != model {
        return Err(format!(
            "the recording is of {} with other description files (model {}, this one has {model}); \
             build the version that was recorded",
            began.component, began.model
        ));
    }
    let configured = configuration::load(description, arguments).ok();
    let secrets = configured.map(|loaded| loaded.values());
    Values::from_record(&began.parameters, secrets.as_ref())
}
