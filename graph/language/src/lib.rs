//! GDSL: the types of a property graph.
//!
//! [`parse`] turns one `.gdsl` text into a syntax tree ([`ast`]). [`load`] loads a text with its
//! imports, also of data prototypes, resolves all names and makes a [`Schema`] of it; [`import`] does so
//! for one that a file of another language names, [`open`] for the schema of a world. [`DOMAINS`] come with this crate.
//!
#![doc = include_str!("example.md")]

pub mod ast;
mod blocks;
mod consistency;
mod imports;
mod members;
mod parse;
mod places;
mod resolve;
mod rules;
mod units;

pub use graph_schema as model;
pub use graph_schema::Schema;
pub use members::TYPES;
pub use parse::parse;
pub use places::place;
pub use resolve::{import, load};

use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::{Beside, MemoryLoader};
use std::io;
use std::path::Path;

/// Domains that every file may import: name of the file, and text.
pub const DOMAINS: [(&str, &str); 5] = [
    ("geometry.gdsl", include_str!("../domains/geometry.gdsl")),
    (
        "kinematics.gdsl",
        include_str!("../domains/kinematics.gdsl"),
    ),
    (
        "measurement.gdsl",
        include_str!("../domains/measurement.gdsl"),
    ),
    ("dsr.gdsl", include_str!("../domains/dsr.gdsl")),
    (
        "innermodel.gdsl",
        include_str!("../domains/innermodel.gdsl"),
    ),
];

/// A domain that comes with this crate.
///
/// # Panics
/// Never: a test loads all of them.
pub fn builtin(name: &str) -> Option<Schema> {
    let text = DOMAINS.iter().find(|(file, _)| *file == name)?.1;
    let mut sources = SourceMap::new();
    let source = sources.add(name, text);
    load(&mut sources, &MemoryLoader::default(), source).0
}

/// The schema of a file, which `read` reads with its imports beside it, or if there is no such file a domain
/// that comes with this crate. The texts are added to `sources`.
///
/// # Errors
/// The findings, or why the file is not readable, as text.
pub fn open(
    sources: &mut SourceMap,
    path: &Path,
    read: fn(&Path) -> io::Result<String>,
) -> Result<Schema, String> {
    let domain = || DOMAINS.iter().find(|(name, _)| Path::new(name) == path);
    let text = read(path).or_else(|error| match domain() {
        Some((_, text)) if error.kind() == io::ErrorKind::NotFound => Ok((*text).to_owned()),
        _ => Err(format!("cannot read {}: {error}", path.display())),
    })?;
    let source = sources.add(path, text);
    let (schema, found) = load(sources, &Beside(read), source);
    let schema = schema.filter(|_| !found.has_errors());
    schema.ok_or_else(|| render(sources, &found, Format::Human))
}

/// The schema of texts, each with the name of its file; the first one names the others.
///
/// # Errors
/// The findings, as text.
pub fn of_texts<N: AsRef<str>>(files: &[(N, N)]) -> Result<Schema, String> {
    let mut sources = SourceMap::new();
    let (name, text) = files.first().ok_or("a schema has a file")?;
    let source = sources.add(name.as_ref(), text.as_ref());
    let texts = files.iter();
    let loader = MemoryLoader::new(texts.map(|(name, text)| (name.as_ref(), text.as_ref())));
    let (schema, found) = load(&mut sources, &loader, source);
    let schema = schema.filter(|_| !found.has_errors());
    schema.ok_or_else(|| render(&sources, &found, Format::Short))
}

/// The schema of the world of a component that was generated from the files `own`. In a network
/// whose schema has more, the network hands over its files.
///
/// # Errors
/// The findings, or a declaration of the component's files that the network does not have, as text.
pub fn of_component<N: AsRef<str>>(
    own: &[(N, N)],
    network: &[(String, String)],
) -> Result<Schema, String> {
    let own = of_texts(own)?;
    if network.is_empty() {
        return Ok(own);
    }
    let whole = of_texts(network)?;
    match whole.lacks(&own).first() {
        None => Ok(whole),
        Some(difference) => Err(format!(
            "the schema of the network does not have that of this component: {}",
            difference.of_part()
        )),
    }
}

/// The formatting options of `.gdsl` files.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
