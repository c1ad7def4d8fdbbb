//! `rcdeploy graph`.

use super::arguments::Input;
use super::description::{examine, read};
use super::output::{Failure, print_line, system};
use rc_deploy_graph::{Graph, GraphFormat};
use std::path::Path;

pub(super) fn graph(
    input: &Input,
    format: GraphFormat,
    output: Option<&Path>,
    unbuilt: bool,
) -> Result<u8, Failure> {
    let human = rc_diagnostics::Format::Human;
    let (network, sources, found) = read(input, human, examine(input, unbuilt))?;
    // Without even the name of the network, there is nothing to draw.
    let network = network.ok_or(Failure(1, String::new()))?;
    let graph = Graph::of(&network, &sources, &found);
    let text = graph.draw(format).map_err(|e| system(&e))?;
    match output {
        Some(path) => {
            write(path, &text).map_err(|e| system(&format!("{}: {e}", path.display())))?;
        }
        None => print_line(format_args!("{}", text.trim_end())),
    }
    Ok(u8::from(found.has_errors()))
}

/// Writes a file atomically. A device or a pipe is written directly.
fn write(path: &Path, text: &str) -> std::io::Result<()> {
    if path.metadata().is_ok_and(|file| !file.is_file()) {
        return std::fs::write(path, text);
    }
    // A link stays one.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}", std::process::id()));
    let beside = path.with_file_name(name);
    let written = std::fs::write(&beside, text).and_then(|()| std::fs::rename(&beside, &path));
    if written.is_err() {
        let _ = std::fs::remove_file(&beside);
    }
    written
}
