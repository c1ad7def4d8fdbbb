//! `rcdeploy graph`.

use super::arguments::Input;
use super::description::{examine, read};
use super::look;
use super::networks::network_of;
use super::output::{Failure, print_data, print_note, system};
use rc_deploy_client::status::{self, NetworkReport};
use rc_deploy_graph::{Graph, GraphFormat, Live};
use std::collections::BTreeMap;
use std::path::Path;

pub(super) fn graph(
    mut input: Input,
    format: GraphFormat,
    output: Option<&Path>,
    unbuilt: bool,
    live: bool,
    with_world: bool,
) -> Result<u8, Failure> {
    if with_world && format != GraphFormat::Svg {
        let message = "`--world` needs the form svg; `rcdeploy world graph` has a world as dot";
        return Err(Failure(2, message.to_owned()));
    }
    let report = live.then(|| report(&mut input)).transpose()?;
    let human = rc_diagnostics::Format::Human;
    let examine = examine(&input, unbuilt || live);
    let (network, sources, found) = read(&input, human, examine)?;
    // Without even the name of the network, there is nothing to draw.
    let network = network.ok_or(Failure(1, String::new()))?;
    let mut graph = Graph::of(&network, &sources, &found);
    let mut world = None;
    if let Some(report) = report {
        if with_world {
            world = super::world::picture(&report.network)?;
            if world.is_none() {
                print_note(&format_args!(
                    "no component of `{}` has a world",
                    report.network
                ));
            }
        }
        // A component that was started by hand may have no counts.
        let rates = look::measured(&report.network).map_or_else(|_| BTreeMap::new(), |(_, r)| r);
        let now = report.components().map(|component| {
            let own = rates
                .iter()
                .filter(|((of, _), rate)| *of == component.name && **rate > 0.0);
            let machine = component.machine.as_ref();
            let live = Live {
                state: component.state.to_string(),
                states: machine.map_or_else(Vec::new, |machine| machine.states.clone()),
                rates_hz: own.map(|((_, slot), rate)| (slot.clone(), *rate)).collect(),
                lost: component.lost.clone(),
            };
            (component.name.clone(), live)
        });
        graph.set_live(now.collect());
    }
    let mut text = graph.draw(format).map_err(|e| system(&e))?;
    if let Some(world) = world {
        text = beside(&text, &world).ok_or_else(|| system(&"a picture has no size"))?;
    }
    match output {
        Some(path) => {
            rc_files::write(path, &text)
                .map_err(|e| system(&format!("{}: {e}", path.display())))?;
        }
        None => print_data(&format!("{}\n", text.trim_end())),
    }
    Ok(u8::from(found.has_errors()))
}

/// Two pictures in one, the second one to the right. `None` if one of them does not say its size.
fn beside(first: &str, second: &str) -> Option<String> {
    let size = |picture: &str| -> Option<(u32, u32)> {
        let (_, rest) = picture.split_once("viewBox=\"0 0 ")?;
        let (width, height) = rest.split_once('"')?.0.split_once(' ')?;
        Some((width.parse().ok()?, height.parse().ok()?))
    };
    let ((left, one), (right, other)) = (size(first)?, size(second)?);
    let (width, height) = (left + right, one.max(other));
    let moved = second.replacen("<svg ", &format!("<svg x=\"{left}\" "), 1);
    Some(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n{first}{moved}</svg>\n"
    ))
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
