//! Declarations and references, across languages and in the worker's Rust.

use super::Server;
use super::names::{Kind, Place, Symbol};
use super::place::Text;
use super::workers::{Handler, component_of};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;

/// The most places of an answer.
const MOST: usize = 5_000;

impl Server {
    /// The declaration of a symbol.
    fn declaration(&mut self, symbol: &Symbol) -> Option<Value> {
        if symbol.kind == Kind::File {
            return Some(self.editor.location(&symbol.file, &Text::default(), 0, 0));
        }
        // The text of its file may have changed.
        if self.waiting.remove(&symbol.file) {
            let _ = self.check(&symbol.file);
        }
        self.files.know(&symbol.file);
        if !rc_files::unsaved::exists(&symbol.file) {
            return None;
        }
        let names = self.files.known(&symbol.file)?;
        let place = names.declaration(symbol.kind, &symbol.name)?;
        Some(
            self.editor
                .location(&symbol.file, &names.text, place.start, place.end),
        )
    }

    /// The declaration of the symbol at a position. For a declaration, the code that implements it.
    pub(super) fn definition(&mut self, path: &Path, position: &Value) -> Value {
        let mut locations = Vec::new();
        let places = self.files.places(path, position, self.editor.encoding());
        for used in places.iter().filter(|place| !place.declares) {
            let symbol = self.files.resolved(&used.symbols);
            locations.extend(symbol.and_then(|symbol| self.declaration(&symbol)));
        }
        for handler in self.handlers_at(path, position) {
            locations.extend(self.declaration(&handler));
        }
        if locations.is_empty() {
            locations = self.implementations(&places);
        }
        if locations.is_empty() {
            let declared = places.iter().find(|place| place.declares);
            let symbol = declared.and_then(|place| place.symbols.first());
            locations.extend(symbol.and_then(|symbol| self.declaration(symbol)));
        }
        json!(once(locations))
    }

    /// The code that implements the thing at a position.
    pub(super) fn implementation(&mut self, path: &Path, position: &Value) -> Value {
        let places = self.files.places(path, position, self.editor.encoding());
        json!(self.implementations(&places))
    }

    fn implementations(&mut self, places: &[Place]) -> Vec<Value> {
        let symbols: BTreeSet<Symbol> = places
            .iter()
            .filter_map(|place| self.files.resolved(&place.symbols))
            .collect();
        let handlers = self.handlers_of(&symbols);
        let locations = handlers.iter().map(|handler| self.handler(handler));
        once(locations.collect())
    }

    fn handler(&self, handler: &Handler) -> Value {
        self.editor
            .location(&handler.file, &handler.text, handler.start, handler.end)
    }

    /// The symbols at a position.
    pub(super) fn symbols(&mut self, path: &Path, position: &Value) -> BTreeSet<Symbol> {
        let mut symbols = BTreeSet::new();
        for place in self.files.places(path, position, self.editor.encoding()) {
            if place.declares {
                symbols.extend(place.symbols);
            } else {
                symbols.extend(self.files.resolved(&place.symbols));
            }
        }
        symbols.extend(self.handlers_at(path, position));
        symbols
    }

    /// The places in all files that name the symbol at a position.
    pub(super) fn references(&mut self, path: &Path, position: &Value, declared: bool) -> Value {
        let symbols = self.symbols(path, position);
        let mut locations = Vec::new();
        for (path, places) in self.files.named(&symbols) {
            let Some(names) = self.files.get(&path) else {
                continue;
            };
            let places = places.iter().filter(|place| declared || !place.declares);
            let places = places.map(|place| {
                self.editor
                    .location(&path, &names.text, place.start, place.end)
            });
            locations.extend(places.take(MOST));
        }
        let handlers = self.handlers_of(&symbols);
        locations.extend(handlers.iter().map(|handler| self.handler(handler)));
        locations.truncate(MOST);
        json!(once(locations))
    }

    /// The other places of an open file that name the thing at a position.
    pub(super) fn highlights(&mut self, path: &Path, position: &Value) -> Value {
        let symbols = self.symbols(path, position);
        let places = self.files.named_in(path, &symbols);
        let Some(names) = self.files.get(path) else {
            return Value::Null;
        };
        let ranges = places
            .iter()
            .map(|place| self.editor.range(&names.text, place.start, place.end));
        let ranges = once(ranges.collect()).into_iter();
        json!(
            ranges
                .map(|range| json!({ "range": range }))
                .collect::<Vec<_>>()
        )
    }

    /// The pieces of workers that implement one of `symbols`: of the components that name it.
    pub(super) fn handlers_of(&mut self, symbols: &BTreeSet<Symbol>) -> Vec<Handler> {
        let mut components = BTreeSet::new();
        for symbol in symbols {
            let named = match symbol.kind {
                Kind::Slot => {
                    components.insert(symbol.file.clone());
                    continue;
                }
                Kind::Operation => Symbol {
                    kind: Kind::Interface,
                    name: symbol.name.split('.').next().unwrap_or_default().to_owned(),
                    file: symbol.file.clone(),
                },
                Kind::State => Symbol {
                    kind: Kind::File,
                    name: String::new(),
                    file: symbol.file.clone(),
                },
                _ => continue,
            };
            let users = self.files.named(&BTreeSet::from([named])).into_iter();
            let users = users.map(|(path, _)| path);
            components.extend(users.filter(|path| path.extension().is_some_and(|e| e == "cdsl")));
        }
        let mut all = Vec::new();
        for cdsl in components {
            let handlers = self.workers.handlers(&cdsl, &self.files.loader());
            all.extend(
                handlers
                    .iter()
                    .filter(|one| symbols.contains(&one.symbol))
                    .cloned(),
            );
        }
        all
    }

    /// The symbols that the code of a worker at a position implements.
    fn handlers_at(&mut self, path: &Path, position: &Value) -> Vec<Symbol> {
        let Some(cdsl) = component_of(path) else {
            return Vec::new();
        };
        let encoding = self.editor.encoding();
        let all = self.workers.handlers(&cdsl, &self.files.loader());
        let here = all.iter().filter(|handler| {
            let byte = handler.text.byte(encoding, position);
            let inside = |byte| handler.start <= byte && byte <= handler.end;
            handler.file == path && byte.is_some_and(inside)
        });
        here.map(|handler| handler.symbol.clone()).collect()
    }
}

/// Each value once, in their order.
fn once(values: Vec<Value>) -> Vec<Value> {
    let mut seen = BTreeSet::new();
    let values = values.into_iter();
    values
        .filter(|value| seen.insert(value.to_string()))
        .collect()
}
