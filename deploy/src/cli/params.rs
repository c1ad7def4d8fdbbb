//! `rcdeploy params` and `emergency`.

use super::arguments::{Action, ChangeOrName};
use super::networks::network_of;
use super::output::{Failure, print_data, print_line, print_note, show, system};
use rc_deploy_client::network_parameters::{self, NetworkValues};
use rc_deploy_client::{Format, connection, params};
use rc_management::component::{Changed, ParameterStatus, Parameters};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::Read;
use std::path::Path;

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
    let (all, missing) = network_parameters::list_all(network)?;
    missing.iter().for_each(|error| print_note(error));
    let one = |(component, listed)| OfComponent { component, listed };
    let all: Vec<OfComponent> = all.into_iter().map(one).collect();
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
            set(&network, values, format)
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
        Action::Dump { network, output } => dump(&network_of(&network)?, output.as_deref()),
        Action::Load {
            network,
            file,
            save,
            format,
        } => load(&network_of(&network)?, &file, save, format),
    }
}

/// Changes parameters, all or none, and shows the changes.
fn set(network: &str, values: NetworkValues, format: Format) -> Result<u8, Failure> {
    if values.len() == 1
        && let Some((name, values)) = values.first_key_value()
    {
        let changed = params::set(network, name, values)?;
        return show(format, &changed, |changed| {
            lines_or_none(change_lines("", changed))
        });
    }
    let changed = connection::set_parameters(network, values)?;
    show(format, &changed, |changed| {
        let of_all = changed.components.iter();
        let of_all = of_all.map(|(name, changed)| change_lines(&format!("{name}."), changed));
        lines_or_none(of_all.collect())
    })
}

/// Writes the parameters of a network into a file. If a component does not name its parameters, the
/// exit code is 3.
fn dump(network: &str, output: Option<&Path>) -> Result<u8, Failure> {
    let (all, missing) = network_parameters::list_all(network)?;
    missing.iter().for_each(|error| print_note(error));
    let text = network_parameters::file(network, &all);
    match output {
        Some(path) => rc_files::write(path, &text)
            .map_err(|e| system(&format_args!("{}: {e}", path.display())))?,
        None => print_data(&text),
    }
    Ok(if missing.is_empty() { 0 } else { 3 })
}

/// Sets the parameters of a file.
fn load(network: &str, file: &Path, save: bool, format: Format) -> Result<u8, Failure> {
    let text = if file == Path::new("-") {
        let mut text = String::new();
        let most = rc_files::LARGEST;
        let limited = &mut std::io::stdin().lock().take(most + 1);
        let size = limited.read_to_string(&mut text);
        // A part of a file may be a file, too.
        size.and_then(|size| {
            if size as u64 > most {
                let reason = format!("it has more than {most} bytes");
                return Err(std::io::Error::other(reason));
            }
            Ok(text)
        })
    } else {
        rc_files::read(file)
    };
    let wrong = |reason: &dyn Display| Failure(1, format!("{}: {reason}", file.display()));
    let text = text.map_err(|error| wrong(&error))?;
    let wanted = network_parameters::read(&text).map_err(|error| wrong(&error))?;
    let names: Vec<String> = wanted.keys().cloned().collect();
    let changes = network_parameters::only_changes(network, wanted)?;
    if changes.is_empty() {
        show(
            format,
            &Changed::default(),
            |_| lines_or_none(String::new()),
        )?;
    } else {
        set(network, changes, format)?;
    }
    // Also what was changed before and not saved.
    for name in names.iter().filter(|_| save) {
        let saved = params::save(network, name)?;
        if format == Format::Human && !saved.saved.is_empty() {
            print_line(format_args!("{}", saved.file.display()));
        }
    }
    Ok(0)
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
