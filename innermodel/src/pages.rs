//! A vector that shares what did not change with its earlier versions.
//!
//! It is a tree of pages. A change copies one page of each level, which is a few kilobytes however
//! long the vector is.

use std::sync::Arc;

/// How many items a page at the bottom has, and how many pages each page above.
const LEAF: usize = 8;
const BRANCH: usize = 32;

#[derive(Debug)]
enum Page<T> {
    Leaf(Arc<[T]>),
    Branch(Arc<[Page<T>]>),
}

impl<T> Clone for Page<T> {
    fn clone(&self) -> Self {
        match self {
            Self::Leaf(page) => Self::Leaf(Arc::clone(page)),
            Self::Branch(page) => Self::Branch(Arc::clone(page)),
        }
    }
}

/// A vector whose clone costs one count.
#[derive(Debug)]
pub(crate) struct Pages<T> {
    root: Page<T>,
    /// How many items a page of the level below the root holds; 1 if the root is a leaf.
    below: usize,
    len: usize,
}

impl<T> Clone for Pages<T> {
    fn clone(&self) -> Self {
        Self {
            root: self.root.clone(),
            below: self.below,
            len: self.len,
        }
    }
}

impl<T: Clone> Pages<T> {
    pub(crate) fn new() -> Self {
        Self {
            root: Page::Leaf(Arc::new([])),
            below: 1,
            len: 0,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    #[inline]
    pub(crate) fn get(&self, index: usize) -> Option<&T> {
        let mut page = &self.root;
        let mut below = self.below;
        let mut index = index;
        loop {
            match page {
                Page::Leaf(items) => return items.get(index),
                Page::Branch(pages) => {
                    page = pages.get(index / below)?;
                    index %= below;
                    below = lower(below);
                }
            }
        }
    }

    /// The item for a change. Copies what an earlier version shares.
    pub(crate) fn get_mut(&mut self, index: usize) -> Option<&mut T> {
        if index >= self.len {
            return None;
        }
        let mut page = &mut self.root;
        let mut below = self.below;
        let mut index = index;
        loop {
            match page {
                Page::Leaf(items) => return Arc::make_mut(items).get_mut(index),
                Page::Branch(pages) => {
                    page = Arc::make_mut(pages).get_mut(index / below)?;
                    index %= below;
                    below = lower(below);
                }
            }
        }
    }

    pub(crate) fn push(&mut self, item: T) {
        let full = match self.below {
            1 => LEAF,
            below => below * BRANCH,
        };
        if self.len == full {
            self.root = Page::Branch(Arc::new([self.root.clone()]));
            self.below = full;
        }
        append(&mut self.root, self.below, self.len, item);
        self.len += 1;
    }

    /// Calls `f` with the places where this vector differs from `older`. Pages that both share are
    /// not looked at.
    pub(crate) fn differences(&self, older: &Self, f: &mut dyn FnMut(usize)) {
        if self.below == older.below {
            compare(&self.root, &older.root, self.below, 0, f);
        } else {
            // One has a level more: the lower one is its first page.
            (0..self.len.max(older.len)).for_each(f);
        }
    }
}

/// The capacity of a page, one level further down.
fn lower(below: usize) -> usize {
    if below == LEAF { 1 } else { below / BRANCH }
}

fn append<T: Clone>(page: &mut Page<T>, below: usize, index: usize, item: T) {
    match page {
        Page::Leaf(items) => *items = longer(items, item),
        Page::Branch(pages) => {
            if index / below == pages.len() {
                let new = match below {
                    LEAF => Page::Leaf(Arc::new([])),
                    _ => Page::Branch(Arc::new([])),
                };
                *pages = longer(pages, new);
            }
            let pages = Arc::make_mut(pages);
            append(&mut pages[index / below], lower(below), index % below, item);
        }
    }
}

/// A copy with one more item.
fn longer<T: Clone>(items: &Arc<[T]>, item: T) -> Arc<[T]> {
    items.iter().cloned().chain(std::iter::once(item)).collect()
}

fn compare<T>(new: &Page<T>, old: &Page<T>, below: usize, start: usize, f: &mut dyn FnMut(usize)) {
    match (new, old) {
        (Page::Leaf(a), Page::Leaf(b)) => {
            if !Arc::ptr_eq(a, b) {
                (0..a.len().max(b.len())).for_each(|at| f(start + at));
            }
        }
        (Page::Branch(a), Page::Branch(b)) => {
            if Arc::ptr_eq(a, b) {
                return;
            }
            for (at, pair) in a.iter().zip(b.iter()).enumerate() {
                compare(pair.0, pair.1, lower(below), start + at * below, f);
            }
            let longer = if a.len() > b.len() { a } else { b };
            for (at, page) in longer.iter().enumerate().skip(a.len().min(b.len())) {
                each(page, lower(below), start + at * below, f);
            }
        }
        _ => {
            each(new, below, start, f);
            each(old, below, start, f);
        }
    }
}

fn each<T>(page: &Page<T>, below: usize, start: usize, f: &mut dyn FnMut(usize)) {
    match page {
        Page::Leaf(items) => (0..items.len()).for_each(|at| f(start + at)),
        Page::Branch(pages) => {
            for (at, page) in pages.iter().enumerate() {
                each(page, lower(below), start + at * below, f);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Pages;

    #[test]
    fn versions_keep_their_items() {
        let mut pages = Pages::new();
        let mut versions = Vec::new();
        for number in 0..3000_usize {
            pages.push(number);
            if number % 500 == 0 {
                versions.push(pages.clone());
            }
        }
        let before = pages.clone();
        *pages.get_mut(1234).expect("an item") = 7;
        assert_eq!((before.get(1234), pages.get(1234)), (Some(&1234), Some(&7)));
        assert!((0..3000).all(|at| before.get(at) == Some(&at)));
        assert_eq!(pages.get(3000), None);
        assert_eq!(pages.get_mut(3000), None);
        for (count, version) in versions.iter().enumerate() {
            assert_eq!(version.len(), count * 500 + 1);
            assert_eq!(version.get(version.len() - 1), Some(&(count * 500)));
        }
    }

    #[test]
    fn differences_are_those_of_changed_pages() {
        let mut pages = Pages::new();
        (0..1000_usize).for_each(|number| pages.push(number));
        let before = pages.clone();
        let mut seen = Vec::new();
        pages.differences(&before, &mut |at| seen.push(at));
        assert!(seen.is_empty());
        *pages.get_mut(900).expect("an item") = 0;
        pages.push(1000);
        pages.differences(&before, &mut |at| seen.push(at));
        assert!(
            seen.contains(&900) && seen.contains(&1000) && seen.len() < 20,
            "{seen:?}"
        );
    }
}
