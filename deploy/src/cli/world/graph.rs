//! `rcdeploy world graph`: a picture of the world.

use super::arguments::PictureFormat;
use super::replica::Listener;
use crate::cli::output::{Failure, print_data, system};
use graph_exchange::Document;
use std::path::Path;

/// The picture of a world. `None` at Ctrl-C.
pub(super) fn drawn(network: &str, format: PictureFormat) -> Result<Option<String>, Failure> {
    let Some(listener) = Listener::joined(network, None)? else {
        return Ok(None);
    };
    let document = Document::of(&listener.world.snapshot());
    let picture = graph_drawing::of_graph(&document, &listener.network.name);
    let text = match format {
        PictureFormat::Dot => picture.dot(),
        PictureFormat::Svg => picture.svg().map_err(|error| {
            let hint = "`rcdeploy world graph --format dot` has no limit";
            system(&format_args!("{error}; {hint}"))
        })?,
    };
    Ok(Some(text))
}

pub(super) fn graph(
    network: &str,
    format: PictureFormat,
    output: Option<&Path>,
) -> Result<u8, Failure> {
    let Some(text) = drawn(network, format)? else {
        return Ok(0);
    };
    let Some(file) = output else {
        print_data(&text);
        return Ok(0);
    };
    rc_files::write(file, &text)
        .map_err(|error| system(&format_args!("{}: {error}", file.display())))?;
    Ok(0)
}
