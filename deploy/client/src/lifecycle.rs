//! The life cycle of managed components: through their supervisor, or, of components that were
//! started by hand, over their own sockets.

use crate::connection::{self, Connection};
use crate::{Error, by_hand, place};
use rc_management::CallError;
use rc_management::component;
use rc_management::lifecycle::{LifecycleState, Transition};
use rc_management::supervisor::{CommandResult, FailedCommand, Verb};
use std::time::Duration;

/// The limit for one transition: a component replies within a minute.
const LIMIT: Duration = Duration::from_secs(70);

/// Takes managed components of a network through their life cycle, as far as
/// [`Transition::meant`] says. Without names, all of them.
///
/// # Errors
/// Nothing of the network runs, or a name is unknown or not managed.
pub fn change(
    network: &str,
    transition: Transition,
    names: &[String],
) -> Result<CommandResult, Error> {
    match connection::command(network, Verb::Lifecycle(transition), names) {
        Err(error @ Error::NotUp { .. }) => by_hand(network, transition, names, error),
        other => other,
    }
}

/// Changes the states of components that no supervisor watches.
fn by_hand(
    network: &str,
    transition: Transition,
    names: &[String],
    not_up: Error,
) -> Result<CommandResult, Error> {
    let components = by_hand::components(network, []);
    if components.is_empty() {
        return Err(not_up);
    }
    let known: Vec<&str> = components.iter().map(|c| c.name.as_str()).collect();
    for name in names {
        match components.iter().find(|c| c.name == *name) {
            None => {
                let help = match rc_diagnostics::nearest(name, known.iter().copied()) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("there are {}", known.join(", ")),
                };
                let text = format!("there is no component `{name}`; {help}");
                return Err(Error::Command(text));
            }
            Some(component) if component.lifecycle.is_none() => {
                let text =
                    format!("`{name}` is not managed: its .cdsl has no `lifecycle managed;`");
                return Err(Error::Command(text));
            }
            Some(_) => {}
        }
    }
    let is_meant = |name: &str| names.is_empty() || names.iter().any(|meant| meant == name);
    let mut result = CommandResult::default();
    for component in components.iter().filter(|c| is_meant(&c.name)) {
        let Some(state) = component.lifecycle else {
            continue;
        };
        let name = component.name.clone();
        match steps(network, &name, state, transition.meant(state)) {
            Ok(()) => result.done.push(name),
            Err(reason) => result.failed.push(FailedCommand { name, reason }),
        }
    }
    if result.done.is_empty() && result.failed.is_empty() {
        let text = "no component of this network is managed".to_owned();
        return Err(Error::Command(text));
    }
    Ok(result)
}

/// Takes one component from `state` to `goal`.
fn steps(
    network: &str,
    name: &str,
    mut state: LifecycleState,
    goal: LifecycleState,
) -> Result<(), String> {
    let path = place::directory(network).socket(&name.replace('.', "-"));
    let peer = format!("component {name} of network {network}");
    let connection = Connection::to(&path, peer, LIMIT).map_err(|error| error.to_string())?;
    let mut connection = connection.ok_or("it has ended")?;
    while state != goal {
        let Some(transition) = state.towards(goal) else {
            return Err(if state.is_primary() {
                format!("is {state}; end it and start it again")
            } else {
                format!("is {state}; repeat the command when its function has ended")
            });
        };
        let request = component::Request::Lifecycle { transition };
        let reply = connection.request::<component::Lifecycle>(&request);
        let reply = reply.map_err(|error| match error {
            CallError::Refused(error) => error.reason(),
            error @ (CallError::Io(_)
            | CallError::TimedOut(_)
            | CallError::Closed
            | CallError::Unexpected(_)) => connection.error(error).to_string(),
        })?;
        state = reply.state;
    }
    Ok(())
}
