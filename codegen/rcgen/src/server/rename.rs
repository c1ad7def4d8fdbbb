//! Another name for a thing, in all files that name it. The code in `src/` is listed, and left alone.

use super::file_key::key;
use super::hover::worker_files;
use super::names::{Kind, Place, Symbol};
use super::networks::Wiring;
use super::requests::Answer;
use super::{INVALID_PARAMETERS, REQUEST_FAILED, Server, send};
use rc_diagnostics::{Diagnostics, Severity, SourceMap};
use rc_files::unsaved;
use rc_syntax::Trivia;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

/// The most listed places of code.
const MOST_TOLD: usize = 20;

/// How the protocol numbers a message that only informs.
const INFORMATION: u8 = 3;

/// An edit of a file: bytes, and the new text.
type Edit = (usize, usize, String);

impl Server {
    /// The name at a position that may be changed: its range and its text.
    pub(super) fn renamable(&mut self, path: &Path, position: &Value) -> Answer {
        let (place, symbol) = self.target(path, position)?;
        let Some(names) = self.files.get(path) else {
            return Ok(Value::Null);
        };
        let old = last(&symbol.name).to_owned();
        let written = names.text.as_str().get(place.start..place.end);
        let part = written.and_then(|written| part(written, &symbol, &old));
        let Some((start, end)) = part else {
            return Ok(Value::Null);
        };
        let (start, end) = (place.start + start, place.start + end);
        let range = self.editor.range(&names.text, start, end);
        Ok(json!({ "range": range, "placeholder": old }))
    }

    /// The edits that give the thing at a position another name. No edit makes an error.
    pub(super) fn rename(
        &mut self,
        path: &Path,
        position: &Value,
        new: &Value,
    ) -> io::Result<Answer> {
        let new = new.as_str().unwrap_or_default();
        if !is_name(new) {
            let message = format!(
                "`{new}` is not a name: a letter or `_` comes first, then letters, digits and `_`"
            );
            return Ok(Err((INVALID_PARAMETERS, message)));
        }
        let symbol = match self.target(path, position) {
            Ok((_, symbol)) => symbol,
            Err(error) => return Ok(Err(error)),
        };
        let old = last(&symbol.name).to_owned();
        if old == new {
            return Ok(Ok(json!({ "changes": {} })));
        }
        let mut symbols = BTreeSet::from([symbol.clone()]);
        if symbol.kind == Kind::Interface {
            symbols.extend(self.slots_named_after(&symbol));
        }
        if let Some(file) = self.unreadable_with(&old) {
            let message = format!(
                "{} has `{old}` and a mistake that hides what it means: fix it first",
                self.path_shown(&file)
            );
            return Ok(Err((REQUEST_FAILED, message)));
        }
        let mut edits = self.edits(&symbols, &old, new, symbol.kind);
        // Not every editor says when a closed file changes.
        let stale: Vec<PathBuf> = edits
            .keys()
            .filter(|file| self.is_stale(file))
            .cloned()
            .collect();
        if !stale.is_empty() {
            for file in stale {
                self.check(&file)?;
            }
            edits = self.edits(&symbols, &old, new, symbol.kind);
        }
        if let Some(message) = self.breaks(&edits) {
            return Ok(Err((REQUEST_FAILED, message)));
        }
        let told = self.code_with(&symbols, &old);
        if !told.is_empty() {
            let more = told.len().saturating_sub(MOST_TOLD);
            let mut lines: Vec<String> = told.into_iter().take(MOST_TOLD).collect();
            if more > 0 {
                lines.push(format!("and {more} more"));
            }
            let message = format!(
                "The code in src/ is yours, and still names `{old}`:\n{}",
                lines.join("\n")
            );
            let parameters = json!({ "type": INFORMATION, "message": message });
            send(json!({ "method": "window/showMessage", "params": parameters }))?;
        }
        Ok(Ok(self.written(edits)))
    }

    /// Edits as the protocol has them: of versions of open texts, if the editor compares them.
    fn written(&self, edits: BTreeMap<PathBuf, Vec<Edit>>) -> Value {
        let mut changes = serde_json::Map::new();
        let mut versioned = Vec::new();
        for (file, edits) in edits {
            let Some(names) = self.files.get(&file) else {
                continue;
            };
            let edits = edits.into_iter().map(|(start, end, text)| {
                json!({ "range": self.editor.range(&names.text, start, end), "newText": text })
            });
            let edits: Value = edits.collect();
            let uri = self.editor.address(&file);
            let version = self
                .editor
                .document(&file)
                .map_or(Value::Null, |open| open.version.clone());
            versioned.push(
                json!({ "textDocument": { "uri": uri, "version": version }, "edits": edits }),
            );
            changes.insert(uri, edits);
        }
        if self.editor.compares_versions() {
            json!({ "documentChanges": versioned })
        } else {
            json!({ "changes": changes })
        }
    }

    /// A file that has a word whose target is unknown because of a mistake.
    fn unreadable_with(&self, word: &str) -> Option<PathBuf> {
        let mut files = self.files.iter();
        let found = files.find(|(_, names)| {
            let text = names.text.as_str();
            let mut words = words(text, word);
            if names.places.is_empty() {
                return words.next().is_some();
            }
            let trivia = Trivia::new(text);
            let is_known = |at: usize| {
                let mut places = names.places.iter();
                let mut comments = trivia.comments().iter();
                places.any(|place| (place.start..place.end).contains(&at))
                    || comments.any(|(start, stop)| (*start..*stop).contains(&at))
            };
            names.has_mistake && words.any(|at| !is_known(at))
        });
        found.map(|(file, _)| file.clone())
    }

    /// Whether a closed file has another text than the one that was checked.
    fn is_stale(&self, file: &Path) -> bool {
        let is_open = self.editor.document(file).is_some();
        let names = self.files.get(file).filter(|_| !is_open);
        names
            .is_some_and(|names| rc_files::read(file).is_ok_and(|text| text != names.text.as_str()))
    }

    /// A file below a folder of the editor.
    fn path_shown(&self, file: &Path) -> String {
        let below = self.editor.below_root(file);
        below.unwrap_or(file).display().to_string()
    }

    /// The thing at a position whose name may be changed, and the place that names it.
    fn target(&mut self, path: &Path, position: &Value) -> Result<(Place, Symbol), (i64, String)> {
        let mut found: Vec<(Place, Symbol)> = Vec::new();
        for place in self.files.places(path, position, self.editor.encoding()) {
            if place.declares {
                let symbols = place.symbols.iter().filter(|one| one.kind != Kind::File);
                found.extend(symbols.map(|symbol| (place.clone(), symbol.clone())));
            } else if let Some(symbol) = self.files.resolved(&place.symbols) {
                found.push((place, symbol));
            }
        }
        // A slot without a name of its own gets one: its interface is renamed in its file.
        let slot = found
            .iter()
            .position(|(place, symbol)| symbol.kind == Kind::Slot && place.declares);
        let first = found.into_iter().nth(slot.unwrap_or(0));
        let nothing = || (REQUEST_FAILED, "there is no name here".to_owned());
        let (place, symbol) = first.ok_or_else(nothing)?;
        let why = match symbol.kind {
            Kind::Module => Some("a module has the name of its file: rename the file"),
            Kind::File => Some("this is the path of a file"),
            Kind::Parameter if self.is_block(&symbol) => Some(
                "a group of parameters is a table of configurations, which this does not rename",
            ),
            _ => None,
        };
        match why {
            Some(why) => Err((REQUEST_FAILED, why.to_owned())),
            None => Ok((place, symbol)),
        }
    }

    /// Whether a parameter has others inside.
    fn is_block(&self, symbol: &Symbol) -> bool {
        let names = self.files.known(&symbol.file);
        let places = names.map_or(&[][..], |names| &names.places);
        let inside = format!("{}.", symbol.name);
        let mut symbols = places.iter().flat_map(|place| &place.symbols);
        symbols.any(|one| one.kind == Kind::Parameter && one.name.starts_with(&inside))
    }

    /// The slots that have the name of an interface, because they have none of their own.
    fn slots_named_after(&self, interface: &Symbol) -> Vec<Symbol> {
        let mut slots = Vec::new();
        for (_, names) in self.files.iter() {
            let places = names.places.iter();
            for place in places.filter(|place| place.symbols.contains(interface)) {
                let same = names
                    .at(place.start)
                    .into_iter()
                    .filter(|one| one.declares && one.start == place.start && one.end == place.end);
                let symbols = same.flat_map(|one| &one.symbols);
                slots.extend(symbols.filter(|one| one.kind == Kind::Slot).cloned());
            }
        }
        slots
    }

    /// The edits of all files, in the order of each file.
    fn edits(
        &mut self,
        symbols: &BTreeSet<Symbol>,
        old: &str,
        new: &str,
        kind: Kind,
    ) -> BTreeMap<PathBuf, Vec<Edit>> {
        let mut all: BTreeMap<PathBuf, Vec<Edit>> = BTreeMap::new();
        for (file, places) in self.files.named(symbols) {
            let Some(names) = self.files.get(&file) else {
                continue;
            };
            let text = names.text.as_str();
            for place in places {
                let Some(written) = text.get(place.start..place.end) else {
                    continue;
                };
                let is_declared_slot = place.declares
                    && kind == Kind::Slot
                    && place.symbols.iter().any(|one| one.kind == Kind::Slot);
                let is_interface = names.at(place.start).into_iter().any(|one| {
                    (one.start, one.end) == (place.start, place.end)
                        && one.symbols.iter().any(|one| one.kind == Kind::Interface)
                });
                let edit = if is_declared_slot && is_interface {
                    let at = behind_interface(text, place.end);
                    Some((at, at, format!(" as {new}")))
                } else {
                    let meant = place.symbols.first();
                    let part = meant.and_then(|symbol| part(written, symbol, old));
                    part.map(|(start, end)| {
                        (place.start + start, place.start + end, new.to_owned())
                    })
                };
                all.entry(file.clone()).or_default().extend(edit);
            }
        }
        for edits in all.values_mut() {
            edits.sort();
            edits.dedup();
        }
        all.retain(|_, edits| !edits.is_empty());
        all
    }

    /// Why edits are wrong: the first error that they make in a file or in one that reads it.
    fn breaks(&mut self, edits: &BTreeMap<PathBuf, Vec<Edit>>) -> Option<String> {
        let mut files: BTreeSet<PathBuf> = edits.keys().cloned().collect();
        for file in edits.keys() {
            files.extend(self.findings.readers(file));
        }
        let before: Vec<BTreeMap<(String, &'static str), String>> =
            files.iter().map(|file| self.errors(file)).collect();
        for (file, edits) in edits {
            let Some(names) = self.files.get(file) else {
                continue;
            };
            let mut text = names.text.as_str().to_owned();
            for (start, end, new) in edits.iter().rev() {
                text.replace_range(start..end, new);
            }
            unsaved::set(file, &text);
        }
        let broken = files.iter().zip(&before).find_map(|(file, before)| {
            // Its message may contain the renamed word, so an error is identified by its place and
            // its code.
            let mut after = self.errors(file).into_iter();
            let new = after.find(|(error, _)| !before.contains_key(error));
            new.map(|((place, _), message)| format!("{place}: {message}"))
        });
        for file in edits.keys() {
            self.editor.take_from_disk(file);
        }
        broken
    }

    /// The errors of a file, by their places and codes; those of a network as a whole.
    fn errors(&self, file: &Path) -> BTreeMap<(String, &'static str), String> {
        let looked = self.files.look_at(file);
        let has_errors = looked.found.has_errors();
        let mut all = BTreeMap::new();
        let mut take = |sources: &SourceMap, found: &Diagnostics| {
            let errors = found.iter().filter(|one| one.severity == Severity::Error);
            for error in errors {
                let (source, at) = (error.span.source, error.span.start);
                let line = sources.position(source, at).line;
                let place = format!("{}:{line}", sources.path(source).display());
                all.insert((place, error.code), error.message.clone());
            }
        };
        take(&looked.sources, &looked.found);
        if let Some(network) = looked.network.filter(|_| !has_errors) {
            let wiring = Wiring::new(file, looked.sources, *network);
            let checked = wiring.check(&self.files.loader());
            take(&checked.sources, &checked.found);
        }
        all
    }

    /// The places of workers that name one of `symbols`: handlers, and words of the old name in the
    /// components that read its file.
    fn code_with(&mut self, symbols: &BTreeSet<Symbol>, old: &str) -> Vec<String> {
        let mut files: BTreeSet<PathBuf> = BTreeSet::new();
        for symbol in symbols {
            let readers = self.findings.readers(&symbol.file).into_iter();
            let readers = readers.chain([symbol.file.clone()]);
            files.extend(readers.filter(|file| file.extension().is_some_and(|e| e == "cdsl")));
        }
        let mut words = vec![old.to_owned()];
        if symbols.iter().any(|symbol| symbol.kind == Kind::Component) {
            words.push(format!("{old}_generated"));
        }
        let mut told: BTreeSet<(PathBuf, usize, String)> = BTreeSet::new();
        for handler in self.handlers_of(symbols) {
            let text = handler.text.as_str();
            let named = text.get(handler.start..handler.end).unwrap_or_default();
            let line = handler.text.line(handler.start) + 1;
            told.insert((handler.file.clone(), line, named.to_owned()));
        }
        for cdsl in files {
            let Some(folder) = cdsl.parent() else {
                continue;
            };
            for file in worker_files(&folder.join("src")) {
                let Ok(text) = rc_files::read(&file) else {
                    continue;
                };
                let file = key(&file);
                for (number, line) in text.lines().enumerate() {
                    if words.iter().any(|word| has_word(line, word)) {
                        told.insert((file.clone(), number + 1, old.to_owned()));
                    }
                }
            }
        }
        let mut lines = BTreeSet::new();
        told.retain(|(file, line, _)| lines.insert((file.clone(), *line)));
        let shown = told.into_iter();
        let shown =
            shown.map(|(file, line, name)| format!("{}:{line}: {name}", self.path_shown(&file)));
        shown.collect()
    }
}

/// A name without those around it.
fn last(name: &str) -> &str {
    let name = name.rsplit('.').next().unwrap_or(name);
    name.split('#').next().unwrap_or(name)
}

/// The part of a written path that is the name of a symbol. `None` if it has another one there, such as a
/// path of a file.
fn part(written: &str, symbol: &Symbol, old: &str) -> Option<(usize, usize)> {
    let inner = written
        .strip_prefix('"')
        .and_then(|rest| rest.strip_suffix('"'));
    let offset = usize::from(inner.is_some());
    let path = inner.unwrap_or(written);
    let steps: Vec<(usize, &str)> = path
        .split('.')
        .scan(offset, |at, step| {
            let start = *at;
            *at += step.len() + 1;
            Some((start, step.split('[').next().unwrap_or(step)))
        })
        .collect();
    let step = match symbol.kind {
        // The steps of a path of parameters are those of its name; of a rule inside a block, the last ones.
        Kind::OfComponent | Kind::Parameter => {
            let number = symbol.name.matches('.').count();
            steps
                .get(number)
                .filter(|(_, step)| *step == old)
                .or(steps.last())
        }
        // A member of an array comes after the array.
        Kind::Slot => steps.first(),
        _ => steps.last(),
    };
    let (start, step) = step?;
    (*step == old).then_some((*start, start + step.len()))
}

/// The place for the name of a slot: after its interface, `[]` and a middleware.
fn behind_interface(text: &str, end: usize) -> usize {
    let mut at = end;
    for (open, close) in [('[', ']'), ('(', ')')] {
        let rest = &text[at..];
        let begins = rest.trim_start().starts_with(open);
        if let Some(end) = rest.find(close).filter(|_| begins) {
            at += end + close.len_utf8();
        }
    }
    at
}

fn is_name(text: &str) -> bool {
    let mut letters = text.chars();
    let first = letters.next();
    first.is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

fn has_word(line: &str, word: &str) -> bool {
    words(line, word).next().is_some()
}

/// The places of a word in a text.
fn words(text: &str, word: &str) -> impl Iterator<Item = usize> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let found = text.match_indices(word).filter(move |(at, word)| {
        let (before, behind) = (&text[..*at], &text[at + word.len()..]);
        !before.ends_with(is_part) && !behind.starts_with(is_part)
    });
    found.map(|(at, _)| at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_of_a_path_with_a_name_is_found() {
        for (written, kind, name, expected) in [
            (
                "motor.speed",
                Kind::OfComponent,
                "motor.speed",
                Some("speed"),
            ),
            (
                "motors[2].max",
                Kind::OfComponent,
                "motors.max",
                Some("max"),
            ),
            ("speed", Kind::Parameter, "motor.speed", Some("speed")),
            (
                "\"left\"",
                Kind::ArrayMember,
                "brain.hands.left",
                Some("left"),
            ),
            ("\"hands.left\"", Kind::Slot, "hands", Some("hands")),
            ("\"hand.cdsl\"", Kind::Component, "hand", None),
            ("arm.hand", Kind::Instance, "arm.hand", Some("hand")),
        ] {
            let symbol = Symbol {
                file: PathBuf::new(),
                kind,
                name: name.to_owned(),
            };
            let found = part(written, &symbol, last(name));
            assert_eq!(
                found.map(|(start, end)| &written[start..end]),
                expected,
                "{written}"
            );
        }
    }

    #[test]
    fn a_slot_is_named_behind_its_interface() {
        for text in [
            "Grip|;",
            "Grip[]|, x",
            "Grip [] (dds)|;",
            "Grip(dds)| { depth 1; }",
        ] {
            let at = text.find('|').expect("a place");
            assert_eq!(
                behind_interface(&text.replace('|', ""), "Grip".len()),
                at,
                "{text}"
            );
        }
    }
}
