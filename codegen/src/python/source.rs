//! The classes in a component's `src/`, as Python's own `ast` reads them.

use super::component::WORKER_MODULE;
use super::interpreter::{self, Unusable};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use serde::Deserialize;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// The generated class that a worker inherits from.
const BASE: &str = "Worker";

/// Output of the script.
#[derive(Deserialize)]
struct Read {
    version: String,
    files: Option<Vec<File>>,
}

#[derive(Deserialize)]
struct File {
    path: PathBuf,
    classes: Vec<Class>,
    error: Option<SyntaxError>,
}

#[derive(Deserialize)]
struct SyntaxError {
    message: String,
    line: usize,
    column: usize,
}

/// A class.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Class {
    pub(super) name: String,
    line: usize,
    /// The last line.
    pub(super) end: usize,
    bases: Vec<String>,
    methods: Vec<Method>,
    /// Other names that its body sets.
    names: Vec<String>,
    #[serde(skip)]
    file: usize,
}

/// A function of a class.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Method {
    pub(super) name: String,
    line: usize,
    column: usize,
    /// The names of the parameters that a position sets, with their types as they are written.
    pub(super) parameters: Vec<(String, Option<String>)>,
    /// How many of the last ones have defaults.
    pub(super) defaults: usize,
    /// Whether it takes any number of arguments.
    pub(super) more: bool,
    /// How many parameters must be set by their names.
    pub(super) keywords: usize,
    pub(super) returns: Option<String>,
    /// Whether a decorator may have changed its signature.
    pub(super) decorated: bool,
    pub(super) coroutine: bool,
    #[serde(skip)]
    file: usize,
}

/// The code of a component's user.
pub(super) struct Code {
    files: Vec<(PathBuf, SourceId)>,
    classes: Vec<Class>,
}

impl Code {
    /// The class of a worker and all that it inherits in these files, the nearest first.
    pub(super) fn line_of(&self, worker: &str) -> Vec<&Class> {
        let mut line: Vec<&Class> = Vec::new();
        let mut wanted = vec![worker.to_owned()];
        let mut seen = BTreeSet::new();
        while let Some(name) = wanted.pop() {
            // The generated class is not in these files, whatever else is called so.
            let named = (name != BASE).then(|| self.named(&name)).flatten();
            if let Some(class) = named.filter(|_| seen.insert(name)) {
                wanted.extend(class.bases.iter().rev().cloned());
                line.push(class);
            }
        }
        line
    }

    /// Whether `worker` inherits from a class that these files do not declare, besides the
    /// generated one.
    pub(super) fn has_strangers(&self, worker: &str) -> bool {
        let line = self.line_of(worker);
        let own = |name: &String| line.iter().any(|class| class.name == *name);
        let mut bases = line.iter().flat_map(|class| &class.bases);
        bases.any(|base| base != BASE && !own(base))
    }

    /// The class of a name: one of the module that the component starts goes first.
    fn named(&self, name: &str) -> Option<&Class> {
        let all = || self.classes.iter().filter(|class| class.name == name);
        let starts = |class: &&Class| {
            let stem = self.path(class).file_stem();
            stem.is_some_and(|stem| stem == WORKER_MODULE)
        };
        all().find(starts).or_else(|| all().next())
    }

    /// All files.
    pub(super) fn files(&self) -> impl Iterator<Item = (&Path, SourceId)> {
        self.files
            .iter()
            .map(|(path, source)| (path.as_path(), *source))
    }

    /// The place of a function's name.
    pub(super) fn place(&self, method: &Method, sources: &SourceMap) -> Span {
        self.at(method.file, method.line, method.column, sources)
    }

    /// The place of a class.
    pub(super) fn place_of_class(&self, class: &Class, sources: &SourceMap) -> Span {
        self.at(class.file, class.line, 0, sources)
    }

    /// The file that declares a class.
    pub(super) fn path(&self, class: &Class) -> &Path {
        &self.files[class.file].0
    }

    fn at(&self, file: usize, line: usize, column: usize, sources: &SourceMap) -> Span {
        let source = self.files[file].1;
        span(source, sources.text(source), line, column)
    }
}

impl Class {
    pub(super) fn methods(&self) -> &[Method] {
        &self.methods
    }

    /// Whether the body of the class says what `name` is, other than by a function.
    pub(super) fn sets(&self, name: &str) -> bool {
        self.names.iter().any(|other| other == name)
    }
}

/// The rest of a line, from a column in bytes on.
fn span(source: SourceId, text: &str, line: usize, column: usize) -> Span {
    let before: usize = text
        .split_inclusive('\n')
        .take(line.saturating_sub(1))
        .map(str::len)
        .sum();
    let rest = text.get(before..).unwrap_or_default();
    let rest = rest.lines().next().unwrap_or_default();
    let mut column = column.min(rest.len());
    while !rest.is_char_boundary(column) {
        column -= 1;
    }
    Span::new(
        source,
        before + column,
        before + rest.trim_end().len().max(column),
    )
}

/// Reads all files of `src`. Reports files that are not Python. `None` if no interpreter can read
/// them; then a finding, an error if `needed`, says why.
///
/// # Errors
/// The system does not give a file.
pub(super) fn read(
    src: &Path,
    name: Span,
    needed: bool,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> io::Result<Option<Code>> {
    const SCRIPT: &str = include_str!("read_worker.py");
    let is_python = |path: &Path| path.extension().is_some_and(|ending| ending == "py");
    let paths = crate::source_files::files(&[crate::paths::normal(src)], &is_python)?;
    let python = interpreter::active();
    let read = interpreter::run(&python, SCRIPT, &paths).and_then(|json| {
        let read: Result<Read, _> = serde_json::from_slice(&json);
        let read = read.map_err(|error| {
            Unusable(format!("`{}` printed no JSON: {error}", python.display()))
        })?;
        let version = rc_diagnostics::foreign::clean(&read.version);
        read.files
            .ok_or_else(|| Unusable(format!("`{}` is Python {version}", python.display())))
    });
    let read = match read {
        Ok(read) => read,
        Err(Unusable(reason)) => {
            let versions = interpreter::needed();
            let message = format!("the worker cannot be checked: {reason}; {versions}");
            let finding = if needed {
                Diagnostic::error
            } else {
                Diagnostic::warning
            };
            let help = "install it, or activate a virtual environment that has it";
            found.push(finding("no-python", name, message).help(help));
            return Ok(None);
        }
    };
    let mut code = Code {
        files: Vec::new(),
        classes: Vec::new(),
    };
    for (at, file) in read.into_iter().enumerate() {
        let text = match rc_files::read(&file.path) {
            Err(error) if error.kind() == io::ErrorKind::InvalidData => String::new(),
            other => other?,
        };
        let source = sources.add(&file.path, text);
        if let Some(error) = file.error {
            let place = span(source, sources.text(source), error.line, error.column);
            let message = format!(
                "this is not Python: {}",
                rc_diagnostics::foreign::clean(&error.message)
            );
            found.push(Diagnostic::error("python-syntax", place, message));
        }
        for mut class in file.classes {
            class.file = at;
            class.methods.iter_mut().for_each(|method| method.file = at);
            code.classes.push(class);
        }
        code.files.push((file.path, source));
    }
    Ok(Some(code))
}
