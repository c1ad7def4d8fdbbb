//! Names of types and attributes, each once. Elements hold their numbers.

use graph_pages::{Ids, Pages};
use std::sync::Arc;

/// The number of a name. It is the same in all versions of one graph and of its forks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Symbol(pub(crate) u32);

/// All names of a graph.
#[derive(Clone, Debug, Default)]
pub(crate) struct Names {
    texts: Pages<Arc<str>>,
    places: Ids<Arc<str>>,
}

impl Names {
    pub(crate) fn get(&self, text: &str) -> Option<Symbol> {
        self.places.get(text).map(Symbol)
    }

    pub(crate) fn text(&self, symbol: Symbol) -> &str {
        self.texts.get(symbol.0 as usize).map_or("", |text| text)
    }

    pub(crate) fn add(&mut self, text: &str) -> Symbol {
        if let Some(known) = self.get(text) {
            return known;
        }
        let symbol = Symbol(self.texts.len() as u32);
        let text: Arc<str> = text.into();
        self.texts.push(Arc::clone(&text));
        self.places.insert(text, symbol.0);
        symbol
    }
}

mod sealed {
    use super::Symbol;

    pub trait Named: Copy {
        /// The symbol; `known` looks a text up.
        fn symbol(self, known: impl FnOnce(&str) -> Option<Symbol>) -> Option<Symbol>;
        /// The text; `known` gives that of a symbol.
        fn text(self, known: impl FnOnce(Symbol) -> String) -> String;
    }
}

/// Names a type or an attribute: a text, or a [`Symbol`], which is found without a look-up.
pub trait Named: sealed::Named {}

impl<T: sealed::Named> Named for T {}

impl sealed::Named for Symbol {
    #[inline]
    fn symbol(self, _: impl FnOnce(&str) -> Option<Symbol>) -> Option<Symbol> {
        Some(self)
    }

    fn text(self, known: impl FnOnce(Symbol) -> String) -> String {
        known(self)
    }
}

impl sealed::Named for &str {
    #[inline]
    fn symbol(self, known: impl FnOnce(&str) -> Option<Symbol>) -> Option<Symbol> {
        known(self)
    }

    fn text(self, _: impl FnOnce(Symbol) -> String) -> String {
        self.to_owned()
    }
}

impl sealed::Named for &String {
    fn symbol(self, known: impl FnOnce(&str) -> Option<Symbol>) -> Option<Symbol> {
        known(self)
    }

    fn text(self, _: impl FnOnce(Symbol) -> String) -> String {
        self.clone()
    }
}
