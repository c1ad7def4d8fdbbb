//! `rcdeploy top`.

use super::{Failure, print_line};
use crate::terminal::{self, ViewEnd};

/// Shows a network that is up.
pub(crate) fn top(network: &str) -> Result<u8, Failure> {
    if !terminal::usable() {
        let message = "standard input and output are no terminal, or one that cannot show this; `rcdeploy status` prints how a network is";
        return Err(Failure(2, message.to_owned()));
    }
    match terminal::top(network)? {
        ViewEnd::Down => print_line(format_args!("network {network} is down")),
        ViewEnd::Running | ViewEnd::Gone => {}
    }
    Ok(0)
}
