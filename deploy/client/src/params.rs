//! Parameters and emergency of a running component. The component itself is asked, so rcdeploy need
//! not have started it.

use crate::by_hand;
use crate::connection::{self, Connection, is_listening};
use crate::error::{Error, ErrorContext};
use crate::names::check_name;
use crate::place;
use rc_management::component::{
    Changed, Done, ParameterChange, ParameterStatus, Parameters, Request, Saved,
};
use rc_management::lines::LIMIT;
use rc_management::{CallError, rpc};
use rc_middleware::RunDirectory;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::io::{BufRead, Read};
use std::time::Duration;

/// How long a component may take to reply. It is longer than the limit of its worker for a change.
const ANSWER_LIMIT: Duration = Duration::from_secs(5);

/// The widest column of a table.
const WIDEST: usize = 200;

/// Lists the parameters with these paths, or all parameters.
pub fn list(network: &str, name: &str, paths: &[String]) -> Result<Parameters, Error> {
    let paths = Some(paths.to_vec());
    call(network, name, &Request::Parameters { paths })
}

/// Parses the changes of a command line. Values are TOML; a text needs no quotes, even if it could
/// be something else. `-` as a secret reads the first line of `input`.
pub fn values(
    network: &str,
    name: &str,
    words: &[(String, String)],
    input: &mut dyn BufRead,
) -> Result<Map<String, Value>, Error> {
    let mut values = Map::new();
    for (path, word) in words {
        // The component refuses wrong values and unknown paths.
        let plain = rc_configuration::parse_argument(word);
        let dashed = word == "-";
        if !dashed && (plain == word.as_str() || word.starts_with(['"', '\''])) {
            values.insert(path.clone(), plain);
            continue;
        }
        let listed = match list(network, name, std::slice::from_ref(path)) {
            Ok(listed) => listed.parameters,
            Err(Error::Refused { .. }) => Vec::new(),
            Err(error) => return Err(error),
        };
        let value = match listed.as_slice() {
            [one] if one.secret && dashed => {
                let line = line(input)?;
                if one.is_text() {
                    Value::String(line)
                } else {
                    rc_configuration::parse_argument(&line)
                }
            }
            [one] if one.is_text() => Value::String(word.clone()),
            _ => plain,
        };
        values.insert(path.clone(), value);
    }
    Ok(values)
}

/// Reads a line without its end.
fn line(input: &mut dyn BufRead) -> Result<String, Error> {
    let mut line = String::new();
    input
        .take(LIMIT as u64)
        .read_line(&mut line)
        .context("read the secret from standard input")?;
    if line.is_empty() {
        return Err(Error::NoSecret);
    }
    Ok(line.trim_end_matches(['\r', '\n']).to_owned())
}

/// Changes parameters of one component, all or none. If a rule of the network reads one of them, its
/// supervisor is asked.
pub fn set(network: &str, name: &str, changes: &Map<String, Value>) -> Result<Changed, Error> {
    let own = changes.clone();
    match call_unless_ruled(network, name, &Request::ParametersSet { changes: own }) {
        Err(Refusal::Ruled) => {
            let all = BTreeMap::from([(name.to_owned(), changes.clone())]);
            let mut changed = connection::set_parameters(network, all)?;
            Ok(changed.components.remove(name).unwrap_or_default())
        }
        Err(Refusal::Error(error)) => Err(error),
        Ok(changed) => Ok(changed),
    }
}

/// Saves the changed values of a component in its configuration.
pub fn save(network: &str, name: &str) -> Result<Saved, Error> {
    call(network, name, &Request::ParametersSave)
}

/// Puts a component into its emergency state, or ends this state.
pub fn emergency(network: &str, name: &str, active: bool) -> Result<(), Error> {
    let Done {} = call(network, name, &Request::Emergency { active })?;
    Ok(())
}

/// Why a component did not do what the command asked for.
enum Refusal {
    /// A rule of the network reads a parameter.
    Ruled,
    Error(Error),
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

/// Asks a component of a network.
pub(crate) fn call<T: DeserializeOwned>(
    network: &str,
    name: &str,
    request: &Request,
) -> Result<T, Error> {
    call_unless_ruled(network, name, request).map_err(|refusal| match refusal {
        Refusal::Error(error) => error,
        Refusal::Ruled => {
            let reason = "it is in a rule of the network".to_owned();
            let name = name.to_owned();
            Error::Refused { name, reason }
        }
    })
}

fn call_unless_ruled<T: DeserializeOwned>(
    network: &str,
    name: &str,
    request: &Request,
) -> Result<T, Refusal> {
    check_name("network", network)?;
    check_name("component", name)?;
    let directory = place::directory(network);
    // Dots in names are dashes in file names.
    let path = directory.socket(&name.replace('.', "-"));
    let peer = format!("component {name} of network {network}");
    let Some(mut connection) = Connection::to(&path, peer, ANSWER_LIMIT)? else {
        return Err(Refusal::Error(Error::NoComponent {
            network: network.to_owned(),
            name: name.to_owned(),
            others: running(&directory),
        }));
    };
    connection.request(request).map_err(|error| match error {
        CallError::Refused(error) if error.code == rpc::Error::RULED => Refusal::Ruled,
        CallError::Refused(error) => {
            let (name, reason) = (name.to_owned(), error.reason());
            Refusal::Error(if error.is_input() {
                Error::Refused { name, reason }
            } else {
                Error::Failed { name, reason }
            })
        }
        error @ (CallError::Io(_)
        | CallError::TimedOut(_)
        | CallError::Closed
        | CallError::Unexpected(_)) => Refusal::Error(connection.error(error)),
    })
}

/// The components of a network that reply.
fn running(directory: &RunDirectory) -> Vec<String> {
    let mut names = by_hand::sockets(directory, []);
    names.retain(|name| is_listening(&directory.socket(name)));
    names
}

/// The parameters as a table for people.
pub fn table(parameters: &Parameters) -> String {
    let head = ["parameter", "value", "default", "allowed", "changes"].map(str::to_owned);
    let rows = parameters.parameters.iter().map(|parameter| {
        let default = parameter.default.as_ref();
        let changes = match parameter {
            ParameterStatus { restart: true, .. } => "at the next start",
            ParameterStatus { editable: true, .. } => "now",
            _ => "never",
        };
        [
            parameter.path.clone(),
            text(&parameter.value),
            default.map_or_else(String::new, text),
            parameter.allowed.clone(),
            changes.to_owned(),
        ]
    });
    let rows: Vec<[String; 5]> = std::iter::once(head).chain(rows).collect();
    // One long value does not move the others, and a width is a `u16` for the formatter.
    let long = |row: &[String; 5], at: usize| row[at].chars().count().min(WIDEST);
    let width = |column: usize| rows.iter().map(|row| long(row, column)).max();
    let mut table = String::new();
    let widths = [0, 1, 2, 3].map(|column| width(column).unwrap_or(0));
    for row in &rows {
        for (cell, width) in row.iter().zip(widths) {
            table.push_str(&format!("{cell:width$}  "));
        }
        table.push_str(&format!("{}\n", row[4]));
    }
    for parameter in &parameters.parameters {
        let path = &parameter.path;
        let unsaved = if parameter.unsaved {
            ", if it is saved"
        } else {
            ""
        };
        if let Some(pending) = &parameter.pending {
            let pending = text(pending);
            table.push_str(&format!(
                "{path} will be {pending} at the next start{unsaved}\n"
            ));
        } else if parameter.unsaved {
            table.push_str(&format!("{path} is not saved\n"));
        }
    }
    table
}

/// A value as TOML writes it.
pub fn text(value: &Value) -> String {
    match value {
        Value::Array(values) => {
            let values: Vec<String> = values.iter().map(text).collect();
            format!("[{}]", values.join(", "))
        }
        Value::String(secret) if secret == "***" => secret.clone(),
        other => other.to_string(),
    }
}

/// A change as one line for people.
pub fn change_text(change: &ParameterChange) -> String {
    let (old, new) = (text(&change.old), text(&change.new));
    format!("{}: {old} -> {new}", change.path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_value_is_shown_and_moves_no_other_one_far() {
        let parameter = |path: &str, value: &str| ParameterStatus {
            path: path.to_owned(),
            value: value.into(),
            pending: None,
            unsaved: false,
            default: None,
            allowed: "string".to_owned(),
            unit: None,
            editable: true,
            restart: false,
            secret: false,
            doc: Vec::new(),
        };
        // A width of the formatter has 16 bits.
        let long = "x".repeat(70_000);
        let parameters = Parameters {
            file: None,
            parameters: vec![parameter("map", &long), parameter("name", "robot")],
        };
        let table = table(&parameters);
        assert!(table.contains(&format!("\"{long}\"")));
        let short = table.lines().find(|line| line.starts_with("name "));
        let short = short.expect("the other parameter");
        assert!(short.ends_with("now") && short.len() < 300, "{short}");
    }
}
