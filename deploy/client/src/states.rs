//! The state machine of a running component: its states, and the events that may be fired from
//! outside.

use crate::error::Error;
use crate::params::call;
use rc_management::component::{Fired, MachineStatus, Request, Status};

/// Fires an event, and returns the active states after the transition.
pub fn fire(network: &str, name: &str, event: &str) -> Result<Fired, Error> {
    let event = event.to_owned();
    call(network, name, &Request::Fire { event })
}

/// The state machine of a component; `None` if it has none.
pub fn machine(network: &str, name: &str) -> Result<Option<MachineStatus>, Error> {
    let status: Status = call(network, name, &Request::Status)?;
    Ok(status.machine)
}

/// The active states, and the last transitions, the newest first, for people. The component has run
/// for `up_s` seconds: `in turning, charged`, and
/// `cruising => turning [blocked] in 40 µs, 3.2 s ago`.
pub fn lines(machine: &MachineStatus, up_s: f64) -> (String, Vec<String>) {
    let newest_first = machine.transitions.iter().rev();
    let last = newest_first.map(|transition| {
        let event = transition.event.as_ref();
        let event = event.map_or_else(String::new, |event| format!(" [{event}]"));
        let ago = (up_s - transition.at_s).max(0.0);
        format!(
            "{} => {}{event} in {} µs, {ago:.1} s ago",
            transition.from,
            transition.to.join(", "),
            transition.took_us
        )
    });
    let states = match machine.states.as_slice() {
        [] => "in no state".to_owned(),
        states => format!("in {}", states.join(", ")),
    };
    (states, last.collect())
}
