//! `rcdeploy start`, `stop` and `restart`.

use super::arguments::Named;
use super::networks::network_of;
use super::output::{Failure, print_failure, show};
use rc_deploy_client::{Format, connection};
use rc_management::supervisor::{CommandResult, Verb};

/// Starts, stops or restarts components, and prints the result.
pub(super) fn control(verb: Verb, named: &Named) -> Result<u8, Failure> {
    let result = connection::command(&network_of(&named.network)?, verb, &named.names)?;
    let lines = |result: &CommandResult| -> String {
        let word = match verb {
            Verb::Start => "ready",
            Verb::Stop => "stopped",
            Verb::Restart => "ready again",
        };
        let done = result.done.iter();
        done.map(|name| format!("{name}: {word}\n")).collect()
    };
    if named.format == Format::Json || !result.done.is_empty() {
        show(named.format, &result, lines)?;
    }
    for failed in &result.failed {
        print_failure(&format_args!("{}: {}", failed.name, failed.reason));
    }
    Ok(if result.failed.is_empty() { 0 } else { 3 })
}
