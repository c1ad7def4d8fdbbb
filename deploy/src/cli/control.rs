//! `rcdeploy start`, `stop` and `restart`, and the commands of the life cycle.

use super::arguments::{Managed, Named};
use super::networks::{by_hand_or, network_of};
use super::output::{Failure, print_failure, show};
use rc_deploy_client::{Format, connection, lifecycle};
use rc_management::lifecycle::Transition;
use rc_management::supervisor::{CommandResult, Verb};

/// Starts, stops or restarts components, and prints the result.
pub(super) fn control(verb: Verb, named: &Named) -> Result<u8, Failure> {
    let network = network_of(&named.network)?;
    let result = connection::command(&network, verb, &named.names)
        .map_err(|error| by_hand_or(&network, error))?;
    let word = match verb {
        Verb::Stop => "stopped",
        Verb::Restart => "ready again",
        Verb::Start | Verb::Lifecycle(_) => "ready",
    };
    print(&result, word, named.format)
}

/// Takes managed components through their life cycle, and prints the result.
pub(super) fn lifecycle(transition: Transition, managed: &Managed) -> Result<u8, Failure> {
    let network = network_of(&managed.network)?;
    let result = lifecycle::change(&network, transition, &managed.names)?;
    let word = match transition {
        Transition::Configure => "configured",
        Transition::Activate => "active",
        Transition::Deactivate => "not active",
        Transition::Cleanup | Transition::Shutdown => "unconfigured",
    };
    print(&result, word, managed.format)
}

fn print(result: &CommandResult, word: &str, format: Format) -> Result<u8, Failure> {
    let lines = |result: &CommandResult| -> String {
        let done = result.done.iter();
        done.map(|name| format!("{name}: {word}\n")).collect()
    };
    if format == Format::Json || !result.done.is_empty() {
        show(format, result, lines)?;
    }
    for failed in &result.failed {
        print_failure(&format_args!("{}: {}", failed.name, failed.reason));
    }
    Ok(if result.failed.is_empty() { 0 } else { 3 })
}
