//! `rcgen graph`: the picture of a state machine.

use crate::command_line::Common;
use crate::reports::{Failure, load, print, report, system, unreadable};
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_smdsl::StateMachine;
use std::path::Path;

/// Draws the machine of a file, or of a component.
pub(crate) fn graph(file: &Path, common: &Common, output: Option<&Path>) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let extension = file.extension().and_then(|extension| extension.to_str());
    let machine = match extension {
        Some("cdsl") => of_component(file, common, &mut sources)?,
        Some("smdsl" | "scxml") => of_file(file, common, &mut sources)?,
        _ => {
            let what = "expected a file with the extension smdsl, scxml or cdsl";
            return Err(Failure::Usage(format!(
                "{what}, found `{}`",
                file.display()
            )));
        }
    };
    let picture = rc_state_graph::document(&machine);
    if let Some(path) = output {
        let written = rc_files::write(path, &picture);
        return written.map_err(|error| system(format!("{}: {error}", path.display())));
    }
    print(&picture);
    Ok(())
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
