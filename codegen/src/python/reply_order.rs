//! Workers that were written for an earlier order of replies. The package of an earlier generation
//! shows it: it has the result after the `out` parameters.

use super::{handlers, interfaces, names};
use crate::files::GENERATED;
use crate::project::Project;
use crate::source_files;
use crate::view;
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};

/// The most places that a finding names.
const SHOWN: usize = 8;

/// Reports each operation whose replies in `generated` are in the earlier order, with the lines of
/// `src` and `tests` that name it.
///
/// # Errors
/// The system does not give a file.
pub(crate) fn check(
    project: &Project,
    view: &view::Component,
    folder: &Path,
    found: &mut Diagnostics,
) -> io::Result<()> {
    let package = folder.join(GENERATED).join(names::package(&view.name));
    let mut code: Option<Vec<(PathBuf, String)>> = None;
    for file in interfaces::of(view) {
        let path = package.join("interfaces").join(format!("{}.py", file.stem));
        // The first generation has no package before it.
        let Ok(before) = rc_files::read(&path) else {
            continue;
        };
        let of = |(_, class, fields): &(&str, &str, &[String])| {
            fields_of(&before, class).is_some_and(|old| is_earlier(&old, fields))
        };
        for (operation, class, fields) in file.replies().filter(of) {
            let code = match &mut code {
                Some(code) => code,
                none => none.insert(read(folder)?),
            };
            let name_of = |field: &String| field.split(':').next().unwrap_or_default().to_owned();
            let order: Vec<String> = fields.iter().map(name_of).collect();
            let words = words(view, &file.name, operation, class);
            let places = places(code, folder, &words);
            let message = format!(
                "the replies of `{operation}` begin with the result now, in the order of the IDSL: ({})",
                order.join(", ")
            );
            let help = if places.is_empty() {
                "nothing in `src` and `tests` names it".to_owned()
            } else {
                format!("change where the order matters: {places}")
            };
            let place = project.component.name.span;
            found.push(Diagnostic::warning("reply-order", place, message).help(help));
        }
    }
    Ok(())
}

/// The fields of a class of replies in a generated file.
fn fields_of<'t>(text: &'t str, class: &str) -> Option<Vec<&'t str>> {
    let head = format!("class {class}(_typing.NamedTuple):");
    let mut lines = text.lines().skip_while(|line| *line != head).skip(1);
    lines.next()?;
    let fields = lines.skip(1).take_while(|line| !line.trim().is_empty());
    Some(fields.map(str::trim).collect())
}

fn is_earlier(old: &[&str], new: &[String]) -> bool {
    let mut earlier = new.to_vec();
    earlier.rotate_left(1);
    // Equal types and names would show nothing, but names of fields differ.
    old == earlier && new.len() > 1
}

/// The names of the operation in code: the function of clients and fakes, the handlers, the class.
fn words(
    view: &view::Component,
    interface: &str,
    operation: &str,
    class: &str,
) -> BTreeSet<String> {
    let method = names::method(operation);
    let fake = format!("on_{}", method.trim_end_matches('_'));
    let slots = view.slots.iter().filter(|slot| slot.interface == interface);
    let handlers = slots.map(|slot| handlers::name(&slot.name, operation));
    let own = [method, fake, class.to_owned()];
    own.into_iter().chain(handlers).collect()
}

fn read(folder: &Path) -> io::Result<Vec<(PathBuf, String)>> {
    let folders = ["src", "tests"].map(|name| folder.join(name));
    let folders: Vec<PathBuf> = folders.into_iter().filter(|path| path.is_dir()).collect();
    if folders.is_empty() {
        return Ok(Vec::new());
    }
    let is_python = |path: &Path| path.extension().is_some_and(|ending| ending == "py");
    let files = source_files::files(&folders, &is_python)?;
    // A file that is not text is reported elsewhere.
    let texts = files.into_iter().filter_map(|path| {
        let text = rc_files::read(&path).ok()?;
        Some((path, text))
    });
    Ok(texts.collect())
}

/// The lines that have one of the words, as `src/specific_worker.py:12`.
fn places(code: &[(PathBuf, String)], folder: &Path, words: &BTreeSet<String>) -> String {
    let mut all = Vec::new();
    for (path, text) in code {
        let path = path.strip_prefix(folder).unwrap_or(path).display();
        for (at, line) in text.lines().enumerate() {
            let mut parts = line.split(|c: char| !(c.is_alphanumeric() || c == '_'));
            if parts.any(|part| words.contains(part)) {
                all.push(format!("{path}:{}", at + 1));
            }
        }
    }
    let more = all.len().saturating_sub(SHOWN);
    all.truncate(SHOWN);
    let mut text = all.join(", ");
    if more > 0 {
        let _ = write!(text, ", and {more} more");
    }
    text
}
