//! One component with everything that its `.cdsl` names.

use rc_cdsl::Component;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap};
use rc_pdsl::model::Parameters;
use rc_syntax::{Loader, Trivia};
use std::path::{Path, PathBuf};

/// A component that was loaded.
#[derive(Debug)]
pub struct Project {
    /// The `.cdsl` file.
    pub path: PathBuf,
    /// The component.
    pub component: Component,
    /// Its parameters, where its `.cdsl` names a `.pdsl`.
    pub parameters: Option<Parameters>,
    /// Hash of all its description files, comments and white space aside.
    pub hash: u64,
}

impl Project {
    /// Reads a component. There is one unless a file could not be read at all; it may be used only where no
    /// diagnostic is an error. An error is a `.cdsl` that the system does not give.
    pub fn load(
        path: &Path,
        sources: &mut SourceMap,
        loader: &dyn Loader,
    ) -> Result<(Option<Self>, Diagnostics), std::io::Error> {
        let text = std::fs::read_to_string(path)?;
        let first = sources.ids().count();
        let source = sources.add(path, text);
        let (component, mut found) = rc_cdsl::load(sources, loader, source);
        let Some(component) = component else {
            return Ok((None, found));
        };
        let mut parameters = None;
        if let Some(file) = &component.parameters {
            let pdsl = path.parent().unwrap_or(Path::new("")).join(&file.text);
            match std::fs::read_to_string(&pdsl) {
                Ok(text) => {
                    let source = sources.add(pdsl, text);
                    let (loaded, more) = rc_pdsl::load(sources, source);
                    parameters = loaded;
                    found.extend(more);
                }
                Err(error) => {
                    let message = format!("`{}` cannot be read: {error}", file.text);
                    let help = "the path is relative to the .cdsl file";
                    found.push(
                        Diagnostic::error("parameters-not-found", file.span, message).help(help),
                    );
                }
            }
        }
        let mut texts: Vec<String> = sources
            .ids()
            .skip(first)
            .map(|id| Trivia::new(sources.text(id)).significant())
            .collect();
        // The order in which imports are written changes nothing.
        texts[1..].sort();
        let hash = rc_idsl::canonical::hash(&texts.join("\n"));
        Ok((
            Some(Self {
                path: path.to_path_buf(),
                component,
                parameters,
                hash,
            }),
            found,
        ))
    }

    /// The folder of the `.cdsl` file.
    pub fn folder(&self) -> &Path {
        match self.path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        }
    }
}
