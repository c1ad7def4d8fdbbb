//! `rcgen graph`: pictures of state machines, graphs and schemas.

use crate::command_line::{Common, Form};
use crate::graph_views;
use crate::reports::{Failure, load, print, report, system, unreadable};
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_smdsl::StateMachine;
use std::path::Path;

/// Draws a graph, a schema, or the machine of a file or of a component.
pub(crate) fn graph(
    file: &Path,
    common: &Common,
    form: Option<Form>,
    output: Option<&Path>,
) -> Result<(), Failure> {
    let is_dot = |path: &Path| path.extension().is_some_and(|ending| ending == "dot");
    let form = form.unwrap_or_else(|| match output {
        Some(path) if is_dot(path) => Form::Dot,
        _ => Form::Svg,
    });
    let picture = if graph_views::is_graph(file) {
        let picture = graph_views::picture(file, common)?;
        match form {
            Form::Dot => picture.dot(),
            Form::Svg => picture.svg().map_err(|error| {
                let help = "draw a part (`rcgen export --to graph --domain`), or use `--to dot`";
                Failure::Usage(format!("{}: {error}; {help}", file.display()))
            })?,
        }
    } else {
        let machine = machine(file, common)?;
        if matches!(form, Form::Dot) {
            let message = "a state machine is drawn as svg only";
            return Err(Failure::Usage(message.to_owned()));
        }
        rc_state_graph::document(&machine)
    };
    if let Some(path) = output {
        let written = rc_files::write(path, &picture);
        return written.map_err(|error| system(format!("{}: {error}", path.display())));
    }
    print(&picture);
    Ok(())
}

fn machine(file: &Path, common: &Common) -> Result<StateMachine, Failure> {
    let mut sources = SourceMap::new();
    let extension = file.extension().and_then(|extension| extension.to_str());
    match extension {
        Some("cdsl") => of_component(file, common, &mut sources),
        Some("smdsl" | "scxml") => of_file(file, common, &mut sources),
        _ => {
            let what = "expected a file with the extension smdsl, scxml, cdsl, graph, json or gdsl";
            Err(Failure::Usage(format!(
                "{what}, found `{}`",
                file.display()
            )))
        }
    }
}

fn of_component(
    file: &Path,
    common: &Common,
    sources: &mut SourceMap,
) -> Result<StateMachine, Failure> {
    let (project, found) = load(file, common, sources)?;
    report(sources, &found, common.format)?;
    project.state_machine.ok_or_else(|| {
        Failure::Usage(format!(
            "the component of {} has no state machine",
            file.display()
        ))
    })
}

fn of_file(file: &Path, common: &Common, sources: &mut SourceMap) -> Result<StateMachine, Failure> {
    let mut found = Diagnostics::new();
    let text = match rc_files::read(file) {
        Ok(text) => text,
        Err(error) => {
            let mut refused = None;
            unreadable(file, &error, sources, &mut found, &mut refused);
            report(sources, &found, common.format)?;
            return Err(Failure::System(refused.unwrap_or_default()));
        }
    };
    let source = sources.add(file.to_path_buf(), text);
    let (machine, more) = rc_smdsl::load(sources, source);
    found.extend(more);
    report(sources, &found, common.format)?;
    machine.ok_or(Failure::Input)
}
