//! `rcdeploy params` and `emergency`.

use super::arguments::Action;
use super::networks::network_of;
use super::output::{Failure, print_note, show};
use rc_deploy_client::{Format, params, status};
use rc_management::component::{ParameterStatus, Parameters};
use serde::Serialize;

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
            for (at, (path, _)) in changes.iter().enumerate() {
                if changes[..at].iter().any(|(before, _)| before == path) {
                    return Err(Failure(2, format!("`{path}` is given twice")));
                }
            }
            let (network, name) = (network_of(&of.network)?, of.name);
            let values = params::values(&network, &name, &changes, &mut std::io::stdin().lock())?;
            let changed = params::set(&network, &name, &values)?;
            show(of.format, &changed, |changed| {
                let now = changed
                    .changed
                    .iter()
                    .map(|c| format!("{}\n", params::change_text(c)));
                let later = changed.pending.iter();
                let later = later.map(|c| {
                    let change = params::change_text(c);
                    format!("{change}, at the next start if it is saved\n")
                });
                let lines: String = now.chain(later).collect();
                if lines.is_empty() {
                    "these are the values already\n".to_owned()
                } else {
                    lines
                }
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
