//! `rcdeploy graph`.

use super::arguments::Input;
use super::description::{examine, read};
use super::networks::network_of;
use super::output::{Failure, print_data, system};
use rc_deploy_client::status::{self, NetworkReport};
use rc_deploy_graph::{Graph, GraphFormat, Live};
use std::path::Path;

pub(super) fn graph(
    mut input: Input,
    format: GraphFormat,
    output: Option<&Path>,
    unbuilt: bool,
    live: bool,
) -> Result<u8, Failure> {
    let report = live.then(|| report(&mut input)).transpose()?;
    let human = rc_diagnostics::Format::Human;
    let examine = examine(&input, unbuilt || live);
    let (network, sources, found) = read(&input, human, examine)?;
    // Without even the name of the network, there is nothing to draw.
    let network = network.ok_or(Failure(1, String::new()))?;
    let mut graph = Graph::of(&network, &sources, &found);
    if let Some(report) = report {
        let now = report.components().map(|component| {
            let machine = component.machine.as_ref();
            let live = Live {
                state: component.state.to_string(),
                states: machine.map_or_else(Vec::new, |machine| machine.states.clone()),
            };
            (component.name.clone(), live)
        });
        graph.set_live(now.collect());
    }
    let text = graph.draw(format).map_err(|e| system(&e))?;
    match output {
        Some(path) => {
            rc_files::write(path, &text)
                .map_err(|e| system(&format!("{}: {e}", path.display())))?;
        }
        None => print_data(&format!("{}\n", text.trim_end())),
    }
    Ok(u8::from(found.has_errors()))
}

/// The status of the network that the command line names. A network that is named has the file that
/// it was started from.
fn report(input: &mut Input) -> Result<NetworkReport, Failure> {
    let argument = input.file.to_string_lossy().into_owned();
    let report = status::report(&network_of(&argument)?)?;
    if input.file.extension().is_none_or(|e| e != "ddsl") {
        let Some(supervised) = &report.supervised else {
            let message = format!("network {argument} has no supervisor; give its .ddsl");
            return Err(Failure(2, message));
        };
        input.file.clone_from(&supervised.ddsl);
    }
    Ok(report)
}
