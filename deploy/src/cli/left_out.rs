//! The name of the network, where a command line leaves it out because only one runs.

use super::networks::{running_here, running_networks};
use super::output::Failure;
use clap::Command;
use rc_deploy_client::names::check_name;
use rc_deploy_client::{logs, place, status};
use std::ffi::OsString;
use std::path::Path;

/// The words of the command line with the name of the network, if it is missing.
///
/// The first word of a command that needs a network is its name if such a network runs, or has
/// logs, or if the word looks like a mistyped name. Otherwise it is the next argument, if that fits.
pub(super) fn with_network(
    command: &Command,
    words: Vec<OsString>,
) -> Result<Vec<OsString>, Failure> {
    // The recorder of a supervisor is started before its network runs.
    let is_whole = |word: &OsString| ["-h", "--help", "--supervised"].iter().any(|w| word == w);
    let place = place(command, &words).filter(|_| !words.iter().any(is_whole));
    let Some((at, argument)) = place else {
        return Ok(words);
    };
    let first = rc_command_line::value_of(command.clone(), words.iter().cloned(), argument);
    let networks = running_networks();
    if let Some(first) = &first
        && (networks.contains(first) || Path::new(first).extension().is_some_and(|e| e == "ddsl"))
    {
        return Ok(words);
    }
    let with = |network: &String| {
        let mut words = words.clone();
        words.insert(at, network.into());
        words
    };
    match (networks.as_slice(), first) {
        ([one], None) => Ok(with(one)),
        ([], None) => Err(Failure(3, place::none_is_up())),
        (many, None) => Err(Failure(
            2,
            format!("several networks run: {}; name one", many.join(", ")),
        )),
        // A word is never taken for a part of a network that runs elsewhere: it may be the name of
        // one of this environment that has ended.
        ([one], Some(first)) if running_here().contains(one) => {
            let fits = || command.clone().try_get_matches_from(with(one)).is_ok();
            let is_mistyped = rc_diagnostics::nearest(&first, [one.as_str()]).is_some();
            // The path of a file is no name.
            let has_logs =
                || check_name("network", &first).is_ok() && logs::directory(&first).exists();
            let is_network = (is_mistyped || has_logs()) && !is_component(one, &first);
            Ok(if is_network || !fits() {
                words
            } else {
                with(one)
            })
        }
        (_, Some(_)) => Ok(words),
    }
}

const NETWORK: &str = "network";

/// The argument of `graph`, which with `--live` may be the name of a network.
const FILE: &str = "file";

/// Where the name of the network belongs, if the command needs one first, and as what argument.
fn place(command: &Command, words: &[OsString]) -> Option<(usize, &'static str)> {
    let mut command = command;
    let mut place = None;
    let mut is_value = false;
    for (at, word) in words.iter().enumerate().skip(1) {
        let word = word.to_str()?;
        if is_value || word.starts_with('-') {
            // The only option before a command.
            is_value = word == "--color";
            continue;
        }
        let Some(inner) = command.find_subcommand(word) else {
            break;
        };
        command = inner;
        place = Some(at + 1);
    }
    let first = command.get_positionals().next()?;
    let is_live = command.get_name() == "graph" && words.iter().any(|word| word == "--live");
    let argument = if is_live { FILE } else { NETWORK };
    let place = place.filter(|_| first.get_id() == argument && first.is_required_set());
    Some((place?, argument))
}

/// Whether a component or a group of the network has this name.
fn is_component(network: &str, name: &str) -> bool {
    let group = format!("{name}.");
    status::report(network).is_ok_and(|report| {
        let mut all = report.components();
        all.any(|component| component.name == name || component.name.starts_with(&group))
    })
}
