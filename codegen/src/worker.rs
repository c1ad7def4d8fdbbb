//! The worker of a component, in any language.

use crate::generator;
use crate::project::Project;
use crate::purpose::Purpose;
use crate::stubs::Compare;
use rc_diagnostics::{SourceMap, Span};
use std::io;

/// How its writer learns which handlers it lacks. A component in an unknown language counts as one in
/// Rust.
pub fn stubs(project: &Project) -> Compare {
    generator::of(project.language().unwrap_or_default()).stubs
}

/// Its pieces in `src`, each with the location of its name, in the order of the text. In Rust, these
/// are its `impl`s and functions; in Python, its functions, which are also those of their slot. Files
/// in other languages have none.
///
/// # Errors
/// The system does not give a file.
pub fn handlers(project: &Project, sources: &mut SourceMap) -> io::Result<Vec<(Purpose, Span)>> {
    let src = project.code().join("src");
    match project.language() {
        Some(language) if src.is_dir() => {
            (generator::of(language).handlers)(project, &src, sources)
        }
        _ => Ok(Vec::new()),
    }
}
