//! Where a worker in Python has its functions, by the text alone: an editor asks at each key stroke, and no
//! interpreter starts as quickly.

use super::handlers;
use crate::description;
use crate::project::Project;
use crate::purpose::{Purpose, of_state};
use crate::view;
use rc_cdsl::model::Middleware;
use rc_diagnostics::{SourceMap, Span};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// How many files of a worker are read.
const MOST_FILES: usize = 200;

/// The functions of the worker in `src`, each with the location of its name.
///
/// # Errors
/// The system does not give a file.
pub(crate) fn of(
    project: &Project,
    src: &Path,
    sources: &mut SourceMap,
) -> io::Result<Vec<(Purpose, Span)>> {
    let (view, _) = view::component::of(project, Middleware::DEFAULT);
    let mut wanted: BTreeMap<String, Vec<Purpose>> = BTreeMap::new();
    for (at, slot) in view
        .slots
        .iter()
        .enumerate()
        .filter(|(_, slot)| slot.receives)
    {
        let operations = view.interface(slot).map_or(&[][..], |i| &i.operations);
        for (number, operation) in operations.iter().enumerate() {
            let name = handlers::name(&slot.name, &operation.name);
            let purposes = wanted.entry(name).or_default();
            purposes.push(Purpose::Operation(at, number));
            purposes.push(Purpose::Slot(at));
        }
    }
    let states = view.machine.iter().flat_map(|machine| &machine.states);
    for state in states {
        for (kind, _) in of_state(state) {
            let name = format!("{kind}_{}", description::state_suffix(&state.name));
            wanted
                .entry(name)
                .or_default()
                .push(Purpose::State(state.name.clone()));
        }
    }
    let mut pieces = Vec::new();
    for path in files(src)? {
        let source = sources.add(&path, rc_files::read(&path)?);
        for (start, end) in functions(sources.text(source)) {
            let name = &sources.text(source)[start..end];
            let purposes = wanted.get(name).into_iter().flatten();
            let span = Span::new(source, start, end);
            pieces.extend(purposes.map(|purpose| (purpose.clone(), span)));
        }
    }
    Ok(pieces)
}

/// The files of a worker, in their order.
fn files(src: &Path) -> io::Result<Vec<PathBuf>> {
    let is_python = |path: &Path| path.extension().is_some_and(|ending| ending == "py");
    let mut files = crate::source_files::files(&[src.to_path_buf()], &is_python)?;
    files.truncate(MOST_FILES);
    Ok(files)
}

/// The names of the functions in classes: `def NAME` after white space, outside of strings of
/// several lines.
fn functions(text: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut inside: Option<&str> = None;
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let start = at;
        at += line.len();
        let was_inside = inside.is_some();
        let mut rest = line;
        loop {
            let next = match inside {
                Some(quote) => rest.find(quote).map(|at| (at, quote)),
                None => ["\"\"\"", "'''"]
                    .into_iter()
                    .filter_map(|quote| Some((rest.find(quote)?, quote)))
                    .min(),
            };
            let Some((place, quote)) = next else { break };
            inside = inside.is_none().then_some(quote);
            rest = &rest[place + quote.len()..];
        }
        let code = line.trim_start();
        let indent = line.len() - code.len();
        let head = code.strip_prefix("async ").map_or(code, str::trim_start);
        let Some(name) = head
            .strip_prefix("def ")
            .filter(|_| indent > 0 && !was_inside)
        else {
            continue;
        };
        let name = name.trim_start();
        let begins = start + line.len() - name.len();
        let length = name.find(|c: char| !c.is_alphanumeric() && c != '_');
        found.push((begins, begins + length.unwrap_or(name.len())));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::functions;

    #[test]
    fn functions_of_classes_are_found_and_no_text_in_strings() {
        let text = "def outer():\n    pass\nclass A:\n    \"\"\"One.\n    def told(self):\n    \"\"\"\n    def grip_press(self, ctx):\n        pass\n    async  def  open_ (self): ...\n";
        let names = functions(text)
            .into_iter()
            .map(|(start, end)| &text[start..end]);
        assert_eq!(names.collect::<Vec<_>>(), ["grip_press", "open_"]);
    }
}
