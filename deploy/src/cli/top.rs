//! `rcdeploy top`.

use super::output::{Failure, print_line};
use crate::process::signals::Signals;
use rc_deploy_client::error::ErrorContext;
use rc_deploy_terminal::ViewEnd;

/// Shows a network that is up.
pub(super) fn top(network: &str) -> Result<u8, Failure> {
    if !rc_deploy_terminal::usable() {
        let message = "standard input and output are not a terminal, or not a capable one; `rcdeploy status` prints the state of a network";
        return Err(Failure(2, message.to_owned()));
    }
    let signals = Signals::new().context("listen to signals")?;
    match rc_deploy_terminal::top(network, signals.descriptor())? {
        ViewEnd::Down => print_line(format_args!("network {network} is down")),
        ViewEnd::Running | ViewEnd::Gone => {}
    }
    Ok(0)
}
