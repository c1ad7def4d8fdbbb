//! `rcdeploy params` and `emergency`.

use super::arguments::{Action, ChangeOrName};
use super::networks::network_of;
use super::output::{Failure, print_note, show};
use rc_deploy_client::{Format, connection, params, status};
use rc_management::component::{Changed, ParameterStatus, Parameters};
use serde::Serialize;
use std::collections::BTreeMap;

/// Shows all parameters of a component.
pub(super) fn of_component(network: &str, name: &str, format: Format) -> Result<u8, Failure> {
    let listed = params::list(network, name, &[])?;
    show(format, &listed, params::table)
}

/// The parameters of one component of a network.
#[derive(Serialize)]
struct OfComponent {
    component: String,
    #[serde(flatten)]
    listed: Parameters,
}

/// Shows the parameters of all components. One that does not run or reply has a note.
pub(super) fn of_network(network: &str, format: Format) -> Result<u8, Failure> {
    let report = status::report(network)?;
    let mut all = Vec::new();
    for component in report.components().map(|c| c.name.clone()) {
        match params::list(network, &component, &[]) {
            Ok(listed) => all.push(OfComponent { component, listed }),
            Err(error) => print_note(&error),
        }
    }
    show(format, &all, |all| {
        let of = |one: &OfComponent| {
            let table = if one.listed.parameters.is_empty() {
                "no parameters\n".to_owned()
            } else {
                params::table(&one.listed)
            };
            let lines = table.lines().map(|line| format!("  {line}\n"));
            format!("{}\n{}", one.component, lines.collect::<String>())
        };
        all.iter().map(of).collect()
    })
}

pub(super) fn params(action: Action) -> Result<u8, Failure> {
    match action {
        Action::Get { of, paths } => {
            let listed = params::list(&network_of(&of.network)?, &of.name, &paths)?;
            show(of.format, &listed, |listed| {
                let line =
                    |p: &ParameterStatus| format!("{} = {}\n", p.path, params::text(&p.value));
                listed.parameters.iter().map(line).collect()
            })
        }
        Action::Set { of, changes } => {
            let (format, network) = (of.format, network_of(&of.network)?);
            let mut input = std::io::stdin().lock();
            let mut values = BTreeMap::new();
            for (name, changes) in by_component(of.name, changes)? {
                let of_one = params::values(&network, &name, &changes, &mut input)?;
                values.insert(name, of_one);
            }
            if values.len() == 1
                && let Some((name, values)) = values.first_key_value()
            {
                let changed = params::set(&network, name, values)?;
                return show(format, &changed, |changed| {
                    lines_or_none(change_lines("", changed))
                });
            }
            let changed = connection::set_parameters(&network, values)?;
            show(format, &changed, |changed| {
                let of_all = changed.components.iter();
                let of_all =
                    of_all.map(|(name, changed)| change_lines(&format!("{name}."), changed));
                lines_or_none(of_all.collect())
            })
        }
        Action::Save { of } => {
            let saved = params::save(&network_of(&of.network)?, &of.name)?;
            show(of.format, &saved, |saved| {
                let file = saved.file.display();
                if saved.saved.is_empty() {
                    return format!("{file}: nothing has changed\n");
                }
                let lines = saved.saved.iter();
                let lines = lines.map(|change| format!("  {}\n", params::change_text(change)));
                format!("{file}\n{}", lines.collect::<String>())
            })
        }
    }
}

/// The changes of each component: `first`, and those that are named between changes.
fn by_component(
    first: String,
    words: Vec<ChangeOrName>,
) -> Result<BTreeMap<String, Vec<(String, String)>>, Failure> {
    let mut all: BTreeMap<String, Vec<(String, String)>> = BTreeMap::new();
    let mut name = first;
    for word in words {
        let (path, value) = match word {
            ChangeOrName::Change(path, value) => (path, value),
            ChangeOrName::Name(next) if all.contains_key(&name) => {
                name = next;
                continue;
            }
            ChangeOrName::Name(next) => return Err(no_change(&name, &next)),
        };
        let changes = all.entry(name.clone()).or_default();
        if changes.iter().any(|(before, _)| *before == path) {
            return Err(Failure(2, format!("`{path}` is given twice")));
        }
        changes.push((path, value));
    }
    if all.contains_key(&name) {
        Ok(all)
    } else {
        Err(Failure(
            2,
            format!("no change follows `{name}`; a change looks like `speed=300`"),
        ))
    }
}

fn no_change(name: &str, word: &str) -> Failure {
    let text = format!("`{word}` is not a change of `{name}`; a change looks like `speed=300`");
    Failure(2, text)
}

/// The changes of one component, a line each, with what precedes each path.
fn change_lines(before: &str, changed: &Changed) -> String {
    let now = changed.changed.iter();
    let now = now.map(|c| format!("{before}{}\n", params::change_text(c)));
    let later = changed.pending.iter().map(|c| {
        let change = params::change_text(c);
        format!("{before}{change}, at the next start if it is saved\n")
    });
    now.chain(later).collect()
}

fn lines_or_none(lines: String) -> String {
    if lines.is_empty() {
        "these are the values already\n".to_owned()
    } else {
        lines
    }
}
