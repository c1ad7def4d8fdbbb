//! Names of types and attributes, each once. Elements hold their numbers.

use crate::snapshot::Snapshot;
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
    pub trait Named: Copy {
        fn symbol(self, snapshot: &super::Snapshot) -> Option<super::Symbol>;
        fn text(self, snapshot: &super::Snapshot) -> String;
    }
}

/// Names a type or an attribute: a text, or a [`Symbol`], which is found without a look-up.
pub trait Named: sealed::Named {}

impl<T: sealed::Named> Named for T {}

impl sealed::Named for Symbol {
    #[inline]
    fn symbol(self, _: &Snapshot) -> Option<Symbol> {
        Some(self)
    }

    fn text(self, snapshot: &Snapshot) -> String {
        snapshot.text(self).to_owned()
    }
}

impl sealed::Named for &str {
    #[inline]
    fn symbol(self, snapshot: &Snapshot) -> Option<Symbol> {
        snapshot.shape.names.get(self)
    }

    fn text(self, _: &Snapshot) -> String {
        self.to_owned()
    }
}

impl sealed::Named for &String {
    fn symbol(self, snapshot: &Snapshot) -> Option<Symbol> {
        snapshot.shape.names.get(self)
    }

    fn text(self, _: &Snapshot) -> String {
        self.clone()
    }
}
