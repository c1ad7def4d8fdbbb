//! Names of types and attributes, each once. Elements hold their numbers.

use graph_pages::{Ids, Pages};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// The number of a name. It is the same in all versions of one graph and of its forks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Symbol(pub(crate) u32);

/// All names of a graph. It is public for the sealed trait alone.
#[derive(Clone, Debug, Default)]
pub struct Names {
    texts: Pages<Arc<str>>,
    places: Ids<Arc<str>>,
}

impl Names {
    pub(crate) fn get(&self, text: &str) -> Option<Symbol> {
        self.places.get(text).map(Symbol)
    }

    fn has(&self, symbol: Symbol, text: &str) -> bool {
        let known = self.texts.get(symbol.0 as usize);
        known.is_some_and(|known| **known == *text)
    }

    pub(crate) fn text(&self, symbol: Symbol) -> &str {
        self.texts.get(symbol.0 as usize).map_or("", |text| text)
    }

    pub(crate) fn settle(&mut self) {
        self.texts.settle();
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

/// A name that remembers its number. In all versions of the graph where it was found last, a comparison
/// finds it again in place of a look-up; in other graphs, it is looked up.
#[derive(Debug)]
pub struct KnownName {
    text: String,
    last: AtomicU32,
}

impl KnownName {
    /// A name whose number is not known yet.
    pub fn new(text: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            last: AtomicU32::new(u32::MAX),
        }
    }

    /// The name.
    pub fn text(&self) -> &str {
        &self.text
    }
}

impl Clone for KnownName {
    fn clone(&self) -> Self {
        Self {
            text: self.text.clone(),
            last: AtomicU32::new(self.last.load(Ordering::Relaxed)),
        }
    }
}

mod sealed {
    use super::{Names, Symbol};

    pub trait Named: Copy {
        /// The symbol among these names.
        fn symbol(self, names: &Names) -> Option<Symbol>;
        /// The text; `known` gives that of a symbol.
        fn text(self, known: impl FnOnce(Symbol) -> String) -> String;
    }
}

/// Names a type or an attribute: a text, a [`KnownName`], or a [`Symbol`], which is found without a look-up.
pub trait Named: sealed::Named {}

impl<T: sealed::Named> Named for T {}

impl sealed::Named for Symbol {
    #[inline]
    fn symbol(self, _: &Names) -> Option<Symbol> {
        Some(self)
    }

    fn text(self, known: impl FnOnce(Symbol) -> String) -> String {
        known(self)
    }
}

impl sealed::Named for &str {
    #[inline]
    fn symbol(self, names: &Names) -> Option<Symbol> {
        names.get(self)
    }

    fn text(self, _: impl FnOnce(Symbol) -> String) -> String {
        self.to_owned()
    }
}

impl sealed::Named for &String {
    fn symbol(self, names: &Names) -> Option<Symbol> {
        names.get(self)
    }

    fn text(self, _: impl FnOnce(Symbol) -> String) -> String {
        self.clone()
    }
}

impl sealed::Named for &KnownName {
    #[inline]
    fn symbol(self, names: &Names) -> Option<Symbol> {
        let last = Symbol(self.last.load(Ordering::Relaxed));
        if names.has(last, &self.text) {
            return Some(last);
        }
        let found = names.get(&self.text)?;
        self.last.store(found.0, Ordering::Relaxed);
        Some(found)
    }

    fn text(self, _: impl FnOnce(Symbol) -> String) -> String {
        self.text.clone()
    }
}
