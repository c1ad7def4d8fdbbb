//! The parameters of a running component, for `rcdeploy params`, and its emergency. The component itself is asked, so that it does not matter
//! who has started it.

use crate::client::connection::Connection;
use crate::client::lines::LIMIT;
use crate::client::names::check_name;
use crate::error::{Error, ErrorContext};
use rc_configuration::ParameterStatus;
use rc_middleware::RunDirectory;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::fmt;
use std::io::{BufRead, Read};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Duration;

/// How long a component may take to answer: longer than it gives its worker for a change.
const ANSWER_LIMIT: Duration = Duration::from_secs(5);
/// The codes with which management says that the input is wrong: refused by the checker, by the worker; the file is
/// not as it was.
const INPUT: [i64; 3] = [-32602, -32001, -32003];

/// Parameters of one component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// The configuration that it has read.
    pub file: Option<PathBuf>,
    /// Those that were asked for.
    pub parameters: Vec<ParameterStatus>,
}

/// One value that is another one now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Its path.
    pub path: String,
    /// What it was.
    pub old: Value,
    /// What it is.
    pub new: Value,
}

/// What a change has done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Changed {
    /// What is another value now.
    pub changed: Vec<Change>,
    /// What will be another value at the next start.
    pub pending: Vec<Change>,
}

/// What was written into a configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// The file.
    pub file: PathBuf,
    /// The values that it did not have.
    pub saved: Vec<Change>,
}

/// The parameters that `paths` name; all where there is none.
pub fn list(network: &str, name: &str, paths: &[String]) -> Result<Parameters, Error> {
    ask(network, name, "parameters", &json!({ "paths": paths }))
}

/// What the words of a command line say, where each follows a path and a `=`. Values are those of TOML; a text needs
/// no quotes, also where it could be something else. For a secret, `-` is the first line of `input`.
pub fn values(
    network: &str,
    name: &str,
    words: &[(String, String)],
    input: &mut dyn BufRead,
) -> Result<Map<String, Value>, Error> {
    let mut values = Map::new();
    for (path, word) in words {
        // What does not fit its parameter is for the component to refuse, and with it a path that is none.
        let plain = rc_configuration::argument(word);
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
                    rc_configuration::argument(&line)
                }
            }
            [one] if one.is_text() => Value::String(word.clone()),
            _ => plain,
        };
        values.insert(path.clone(), value);
    }
    Ok(values)
}

/// A line, without its end.
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

/// Changes values, all or none.
pub fn set(network: &str, name: &str, changes: &Map<String, Value>) -> Result<Changed, Error> {
    let changes = json!({ "changes": changes });
    ask(network, name, "parameters_set", &changes)
}

/// Has the component write its changed values into its configuration.
pub fn save(network: &str, name: &str) -> Result<Saved, Error> {
    ask(network, name, "parameters_save", &json!({}))
}

/// Has a component enter its emergency, or leave it.
pub fn emergency(network: &str, name: &str, active: bool) -> Result<(), Error> {
    let active = json!({ "active": active });
    ask::<Value>(network, name, "emergency", &active).map(drop)
}

fn ask<T: DeserializeOwned>(
    network: &str,
    name: &str,
    method: &str,
    params: &Value,
) -> Result<T, Error> {
    check_name("network", network)?;
    check_name("component", name)?;
    let directory = RunDirectory::of(network);
    // As rcdeploy calls a component of a group.
    let path = directory.socket(&name.replace('.', "-"));
    let who = format!("component {name} of network {network}");
    let Some(mut connection) = Connection::to(&path, who, ANSWER_LIMIT)? else {
        return Err(Error::NoComponent {
            network: network.to_owned(),
            name: name.to_owned(),
            others: running(&directory),
        });
    };
    let answer = connection.request(method, params)?;
    if let Some(result) = answer.get("result") {
        return T::deserialize(result).map_err(|_| connection.strange(&answer));
    }
    let code = answer["error"]["code"].as_i64();
    let (Some(code), Some(reason)) = (code, reason(&answer["error"])) else {
        return Err(connection.strange(&answer));
    };
    let name = name.to_owned();
    Err(if INPUT.contains(&code) {
        Error::Refused { name, reason }
    } else {
        Error::Failed { name, reason }
    })
}

/// What an error says, each finding of the checker on a line of its own.
pub(crate) fn reason(error: &Value) -> Option<String> {
    let Some(findings) = error["data"]["findings"].as_array() else {
        return error["message"].as_str().map(str::to_owned);
    };
    let line = |finding: &Value| {
        let (code, message) = (finding["code"].as_str()?, finding["message"].as_str()?);
        let help = finding["help"].as_str();
        let help = help.map_or_else(String::new, |help| format!(" ({help})"));
        Some(format!("error[{code}]: {message}{help}"))
    };
    let lines: Option<Vec<String>> = findings.iter().map(line).collect();
    lines.map(|lines| format!("\n  {}", lines.join("\n  ")))
}

/// The components of a network that answer.
fn running(directory: &RunDirectory) -> Vec<String> {
    let entries = std::fs::read_dir(directory.path());
    let mut names: Vec<String> = entries
        .into_iter()
        .flatten()
        .flatten()
        .filter(|entry| UnixStream::connect(entry.path()).is_ok())
        .filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            name.strip_suffix(".sock").map(str::to_owned)
        })
        .filter(|name| check_name("component", name).is_ok())
        .collect();
    names.sort();
    names
}

impl fmt::Display for Parameters {
    /// A table for people.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let head = ["parameter", "value", "default", "allowed", "changes"].map(str::to_owned);
        let rows = self.parameters.iter().map(|parameter| {
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
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
        let widths = [0, 1, 2, 3].map(|column| width(column).unwrap_or(0));
        for row in &rows {
            for (cell, width) in row.iter().zip(widths) {
                write!(f, "{cell:width$}  ")?;
            }
            writeln!(f, "{}", row[4])?;
        }
        for parameter in &self.parameters {
            let path = &parameter.path;
            let unsaved = if parameter.unsaved {
                ", if it is saved"
            } else {
                ""
            };
            if let Some(pending) = &parameter.pending {
                let pending = text(pending);
                writeln!(f, "{path} will be {pending} at the next start{unsaved}")?;
            } else if parameter.unsaved {
                writeln!(f, "{path} is not saved")?;
            }
        }
        Ok(())
    }
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

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: {} -> {}",
            self.path,
            text(&self.old),
            text(&self.new)
        )
    }
}
