//! The changes of one type.

use crate::kind::Kind;
use crate::view::View;
use property_graph::Element;
use rc_world::{News, NewsOf};
use std::marker::PhantomData;
use std::sync::Arc;

/// The changes of one type, and of those that inherit from it, between two versions.
#[derive(Clone, Debug)]
pub struct Change<K> {
    /// The earlier version.
    pub before: View,
    /// The later version.
    pub after: View,
    news: NewsOf,
    kind: PhantomData<fn() -> K>,
}

impl<K: Kind> Change<K> {
    /// The changes of the type. `None` if there are none.
    pub fn of(news: &News) -> Option<Self> {
        let of_type = news.of(K::NAME);
        (!of_type.is_empty()).then(|| Self {
            before: View(Arc::clone(&news.before)),
            after: View(Arc::clone(&news.after)),
            news: of_type,
            kind: PhantomData,
        })
    }

    /// New elements.
    pub fn added(&self) -> impl Iterator<Item = K::In<'_>> {
        let all = self.news.added.iter();
        all.filter_map(|element| K::of(&self.after, *element))
    }

    /// Elements with other attributes, as they are now. New ones are none of them.
    pub fn changed(&self) -> impl Iterator<Item = K::In<'_>> {
        let all = self.news.changed.keys();
        all.filter_map(|element| K::of(&self.after, *element))
    }

    /// The attributes that are others.
    pub fn attributes(&self, element: impl Into<Element>) -> impl Iterator<Item = &str> {
        let all = self.news.changed.get(&element.into());
        let all = all.into_iter().flatten();
        all.map(|symbol| self.after.text(*symbol))
    }

    /// Removed elements, as they were.
    pub fn removed(&self) -> impl Iterator<Item = K::In<'_>> {
        let all = self.news.removed.iter();
        all.filter_map(|element| K::of(&self.before, *element))
    }
}
