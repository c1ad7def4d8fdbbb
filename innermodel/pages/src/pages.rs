//! A vector that shares what did not change with its earlier versions.
//!
//! It is a tree of pages. A few recently changed pages at the bottom are kept outside the tree,
//! each in the slot of its number. A change of one of these copies one page, however long the
//! vector is. A change elsewhere takes over a slot: the previous page goes back into the tree,
//! which copies one page of each level. New items wait beside the tree until they fill a page, so
//! that many of them copy no page.

use std::sync::Arc;

/// The usual number of items of a page at the bottom, as a power of two.
const LEAF: u32 = 3;
/// The usual number of pages of a page above the bottom, as a power of two.
const BRANCH: u32 = 3;
/// How many changed pages are kept outside the tree.
const RECENT: usize = 8;

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

/// A page at the bottom that replaces the one in the tree.
#[derive(Debug)]
struct Recent<T> {
    leaf: usize,
    items: Arc<[T]>,
}

impl<T> Clone for Recent<T> {
    fn clone(&self) -> Self {
        Self {
            leaf: self.leaf,
            items: Arc::clone(&self.items),
        }
    }
}

/// A vector whose clone costs a few counts.
///
/// A page above the bottom has 2^B pages, one at the bottom 2^L items. A wider tree is read faster; the
/// first change of a page that was not changed recently costs more.
#[derive(Debug)]
pub struct Pages<T, const B: u32 = BRANCH, const L: u32 = LEAF> {
    root: Page<T>,
    /// How many bits of an index distinguish items of one page below the root; 0 for a leaf.
    bits: u32,
    len: usize,
    /// At its number modulo their count.
    recent: [Option<Recent<T>>; RECENT],
    /// The last items, less than a page of them, while the tree has full pages only.
    tail: Vec<T>,
}

impl<T: Clone, const B: u32, const L: u32> Clone for Pages<T, B, L> {
    fn clone(&self) -> Self {
        Self {
            root: self.root.clone(),
            bits: self.bits,
            len: self.len,
            recent: self.recent.clone(),
            tail: self.tail.clone(),
        }
    }
}

impl<T: Clone, const B: u32, const L: u32> Default for Pages<T, B, L> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Clone, const B: u32, const L: u32> Pages<T, B, L> {
    /// How many items a page at the bottom has.
    const LEAF: usize = 1 << L;

    /// The place in a page whose pages differ by `bits`.
    #[inline]
    fn place(index: usize, bits: u32) -> usize {
        (index >> bits) & ((1 << B) - 1)
    }

    /// An empty vector.
    pub fn new() -> Self {
        Self {
            root: Page::Leaf(Arc::new([])),
            bits: 0,
            len: 0,
            recent: [const { None }; RECENT],
            tail: Vec::new(),
        }
    }

    /// How many items there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it is empty.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The item at a place.
    #[inline]
    pub fn get(&self, index: usize) -> Option<&T> {
        let leaf = self.leaf(index >> L);
        match leaf.and_then(|items| items.get(index & (Self::LEAF - 1))) {
            Some(item) => Some(item),
            None => self.tail.get(self.in_tail(index)?),
        }
    }

    /// The place beside the tree, for an index behind it.
    #[inline]
    fn in_tail(&self, index: usize) -> Option<usize> {
        index.checked_sub(self.len - self.tail.len())
    }

    /// The present page of a number.
    #[inline]
    fn leaf(&self, leaf: usize) -> Option<&Arc<[T]>> {
        match &self.recent[leaf % RECENT] {
            Some(recent) if recent.leaf == leaf => Some(&recent.items),
            _ => self.leaf_of_tree(leaf),
        }
    }

    #[inline]
    fn leaf_of_tree(&self, leaf: usize) -> Option<&Arc<[T]>> {
        let index = leaf << L;
        let mut bits = self.bits;
        let mut page = match &self.root {
            Page::Leaf(items) => return (leaf == 0).then_some(items),
            // An index beyond the tree is beyond this page.
            Page::Branch(pages) => pages.get(index >> bits)?,
        };
        loop {
            bits = bits.wrapping_sub(B);
            match page {
                Page::Leaf(items) => return Some(items),
                Page::Branch(pages) => page = pages.get(Self::place(index, bits))?,
            }
        }
    }

    /// The item for a change. Copies what an earlier version shares.
    pub fn get_mut(&mut self, index: usize) -> Option<&mut T> {
        if let Some(at) = self.in_tail(index) {
            return self.tail.get_mut(at);
        }
        let (leaf, place) = (index >> L, index & (Self::LEAF - 1));
        let slot = leaf % RECENT;
        let is_recent = matches!(&self.recent[slot], Some(recent) if recent.leaf == leaf);
        if !is_recent {
            if self.is_own(leaf) {
                let items = self.leaf_for_change(leaf)?;
                return Arc::make_mut(items).get_mut(place);
            }
            let items = Arc::clone(self.leaf_of_tree(leaf)?);
            self.put_back(slot);
            self.recent[slot] = Some(Recent { leaf, items });
        }
        let recent = self.recent[slot].as_mut()?;
        Arc::make_mut(&mut recent.items).get_mut(place)
    }

    /// Whether no other version shares the page, so that a change in the tree copies nothing.
    fn is_own(&self, leaf: usize) -> bool {
        let index = leaf << L;
        let (mut page, mut bits) = (&self.root, self.bits);
        loop {
            match page {
                Page::Leaf(items) => return Arc::strong_count(items) == 1,
                Page::Branch(pages) => {
                    if Arc::strong_count(pages) > 1 {
                        return false;
                    }
                    let Some(below) = pages.get(Self::place(index, bits)) else {
                        return false;
                    };
                    page = below;
                    bits = bits.wrapping_sub(B);
                }
            }
        }
    }

    /// The page in the tree. Copies the pages above it that an earlier version shares.
    fn leaf_for_change(&mut self, leaf: usize) -> Option<&mut Arc<[T]>> {
        let index = leaf << L;
        let (mut page, mut bits) = (&mut self.root, self.bits);
        loop {
            match page {
                Page::Leaf(items) => return Some(items),
                Page::Branch(pages) => {
                    page = Arc::make_mut(pages).get_mut(Self::place(index, bits))?;
                    bits = bits.wrapping_sub(B);
                }
            }
        }
    }

    /// Moves the page of a slot into the tree.
    fn put_back(&mut self, slot: usize) {
        if let Some(recent) = self.recent[slot].take()
            && let Some(items) = self.leaf_for_change(recent.leaf)
        {
            *items = recent.items;
        }
    }

    /// Adds an item at the end.
    pub fn push(&mut self, item: T) {
        let leaf = self.len >> L;
        let has_room = self.tail.is_empty() && !self.len.is_multiple_of(Self::LEAF);
        self.len += 1;
        if !has_room {
            if self.tail.is_empty() {
                self.tail.reserve_exact(Self::LEAF);
            }
            self.tail.push(item);
            if self.tail.len() == Self::LEAF {
                self.take_tail();
            }
            return;
        }
        if matches!(&self.recent[leaf % RECENT], Some(recent) if recent.leaf == leaf) {
            self.put_back(leaf % RECENT);
        }
        if let Some(items) = self.leaf_for_change(leaf) {
            *items = items.iter().cloned().chain([item]).collect();
        }
    }

    /// Puts the last items into the tree: a clone shares them then. It changes no item.
    pub fn settle(&mut self) {
        self.take_tail();
    }

    /// Makes a page of the items beside the tree.
    fn take_tail(&mut self) {
        if self.tail.is_empty() {
            return;
        }
        let start = self.len - self.tail.len();
        let items = std::mem::take(&mut self.tail).into();
        let above = if self.bits == 0 { L } else { self.bits + B };
        if start == 1 << above {
            self.root = Page::Branch(Arc::new([self.root.clone()]));
            self.bits = above;
        }
        append::<T, B, L>(&mut self.root, self.bits, start, items);
    }

    /// Calls `f` with the places where this vector differs from `older`, in ascending order. Pages
    /// that both share are not looked at.
    pub fn differences(&self, older: &Self, f: &mut dyn FnMut(usize)) {
        if self.bits != older.bits {
            // One has a level more: the lower one is its first page.
            return (0..self.len.max(older.len)).for_each(f);
        }
        let mut leaves = Vec::new();
        compare::<T, B, L>(&self.root, &older.root, self.bits, 0, &mut leaves);
        let recent = self.recent.iter().chain(&older.recent);
        leaves.extend(recent.flatten().map(|recent| recent.leaf));
        // The items beside a tree are less than a page.
        let tails = [self, older].map(|own| (!own.tail.is_empty()).then_some(own.len >> L));
        leaves.extend(tails.into_iter().flatten());
        leaves.sort_unstable();
        leaves.dedup();
        for leaf in leaves {
            let (new, old) = (self.leaf(leaf), older.leaf(leaf));
            let is_shared = matches!((new, old), (Some(a), Some(b)) if Arc::ptr_eq(a, b));
            if !is_shared || tails.contains(&Some(leaf)) {
                let end = self.len.max(older.len).min((leaf + 1) << L);
                (leaf << L..end).for_each(&mut *f);
            }
        }
    }
}

/// The bits of an index, one level further down.
fn lower<const B: u32, const L: u32>(bits: u32) -> u32 {
    if bits == L { 0 } else { bits - B }
}

/// Adds a page at the bottom, whose first item has this index.
fn append<T, const B: u32, const L: u32>(
    page: &mut Page<T>,
    bits: u32,
    index: usize,
    leaf: Arc<[T]>,
) {
    let Page::Branch(pages) = page else {
        *page = Page::Leaf(leaf);
        return;
    };
    let at = index >> bits;
    if at == pages.len() {
        let new = if bits == L {
            Page::Leaf(Arc::clone(&leaf))
        } else {
            Page::Branch(Arc::new([]))
        };
        *pages = pages.iter().cloned().chain([new]).collect();
    }
    if bits > L {
        let below = &mut Arc::make_mut(pages)[at];
        append::<T, B, L>(below, bits - B, index & ((1 << bits) - 1), leaf);
    }
}

/// Collects the numbers of the leaves that two trees do not share.
fn compare<T, const B: u32, const L: u32>(
    new: &Page<T>,
    old: &Page<T>,
    bits: u32,
    start: usize,
    leaves: &mut Vec<usize>,
) {
    match (new, old) {
        (Page::Leaf(a), Page::Leaf(b)) if Arc::ptr_eq(a, b) => {}
        (Page::Branch(a), Page::Branch(b)) => {
            if Arc::ptr_eq(a, b) {
                return;
            }
            for (at, pair) in a.iter().zip(b.iter()).enumerate() {
                compare::<T, B, L>(
                    pair.0,
                    pair.1,
                    lower::<B, L>(bits),
                    start + (at << bits),
                    leaves,
                );
            }
            let longer = if a.len() > b.len() { a } else { b };
            for (at, page) in longer.iter().enumerate().skip(a.len().min(b.len())) {
                each::<T, B, L>(page, lower::<B, L>(bits), start + (at << bits), leaves);
            }
        }
        _ => {
            each::<T, B, L>(new, bits, start, leaves);
            each::<T, B, L>(old, bits, start, leaves);
        }
    }
}

fn each<T, const B: u32, const L: u32>(
    page: &Page<T>,
    bits: u32,
    start: usize,
    leaves: &mut Vec<usize>,
) {
    match page {
        Page::Leaf(_) => leaves.push(start >> L),
        Page::Branch(pages) => {
            for (at, page) in pages.iter().enumerate() {
                each::<T, B, L>(page, lower::<B, L>(bits), start + (at << bits), leaves);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Pages;

    /// Under Miri, every step takes a thousand times as long.
    const STEPS: usize = if cfg!(miri) { 200 } else { 4000 };

    #[test]
    #[cfg_attr(miri, ignore = "the random changes do the same to fewer items")]
    fn versions_keep_their_items() {
        let mut pages: Pages<usize> = Pages::new();
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
        let mut pages: Pages<usize> = Pages::new();
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

    #[test]
    fn random_changes_of_versions_are_those_of_a_plain_vector() {
        // A version that was not settled has items beside its tree.
        for settles in [0, 1, 3] {
            random_changes::<3, 3>(0, settles);
            // Narrow pages make many levels of few items.
            random_changes::<1, 1>(0, settles);
            // The third level begins after 2048 items.
            random_changes::<7, 4>(2040, settles);
        }
    }

    /// Changes of pages with `B` and `L`, from the number of items `first` on. Each version of `settles` is
    /// settled; none if that is 0.
    fn random_changes<const B: u32, const L: u32>(first: usize, settles: usize) {
        let mut pages: Pages<usize, B, L> = Pages::new();
        let mut plain = Vec::new();
        for number in 0..first {
            pages.push(number);
            plain.push(number);
        }
        let mut versions = vec![(pages.clone(), plain.clone())];
        let mut seed = 1_usize;
        for step in 0..STEPS {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let random = seed >> 33;
            if plain.is_empty() || random.is_multiple_of(3) {
                pages.push(step);
                plain.push(step);
            } else {
                let at = (random / 3) % plain.len();
                *pages.get_mut(at).expect("an item") = step;
                plain[at] = step;
            }
            if step % 50 == 0 {
                if (step / 50).checked_rem(settles) == Some(0) {
                    pages.settle();
                }
                versions.push((pages.clone(), plain.clone()));
            }
        }
        for pair in versions.windows(2) {
            let ((older, was), (newer, is)) = (&pair[0], &pair[1]);
            assert!(
                is.iter()
                    .enumerate()
                    .all(|(at, item)| newer.get(at) == Some(item))
            );
            assert_eq!((newer.len(), newer.get(is.len())), (is.len(), None));
            let mut seen = Vec::new();
            newer.differences(older, &mut |at| seen.push(at));
            assert!(seen.is_sorted_by(|a, b| a < b), "{seen:?}");
            let differ = (0..is.len()).filter(|at| was.get(*at) != is.get(*at));
            for at in differ {
                assert!(seen.contains(&at), "{at} of {seen:?}");
            }
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "a deep tree has thousands of items")]
    fn a_change_of_a_recent_page_copies_no_other_page() {
        let mut pages: Pages<usize> = Pages::new();
        (0..10_000_usize).for_each(|number| pages.push(number));
        let first = pages.clone();
        *pages.get_mut(5000).expect("an item") = 0;
        let second = pages.clone();
        *pages.get_mut(5001).expect("an item") = 0;
        let root = |pages: &Pages<usize>| match &pages.root {
            super::Page::Branch(branch) => branch.as_ptr() as usize,
            super::Page::Leaf(_) => 0,
        };
        assert_eq!((root(&first), root(&second)), (root(&pages), root(&pages)));
        assert_eq!(
            (first.get(5000), second.get(5001)),
            (Some(&5000), Some(&5001))
        );
        // The page with the same slot sends this one into the tree.
        *pages.get_mut(5000 + 64).expect("an item") = 0;
        assert_ne!(root(&first), root(&pages));
        assert_eq!(
            (pages.get(5000), pages.get(5001), pages.get(5064)),
            (Some(&0), Some(&0), Some(&0))
        );
    }
}
