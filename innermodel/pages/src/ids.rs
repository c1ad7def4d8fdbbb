//! The map from ids to places, shared with earlier versions as far as it did not change.

use std::borrow::Borrow;
use std::hash::{BuildHasher, Hash, RandomState};
use std::sync::Arc;

/// How many ids a bucket holds before it is split.
const BUCKET: usize = 8;
const BITS: u32 = 4;

#[derive(Clone, Debug)]
enum Page<K> {
    Bucket(Vec<(u64, K, u32)>),
    Branch([Option<Arc<Page<K>>>; 1 << BITS]),
}

/// A map from ids to places. A clone costs one count.
#[derive(Clone, Debug)]
pub struct Ids<K> {
    root: Option<Arc<Page<K>>>,
    hash: RandomState,
}

impl<K: Clone + Eq + Hash> Default for Ids<K> {
    fn default() -> Self {
        Self::new()
    }
}

impl<K: Clone + Eq + Hash> Ids<K> {
    /// An empty map.
    pub fn new() -> Self {
        Self {
            root: None,
            hash: RandomState::new(),
        }
    }

    /// The place of an id.
    pub fn get<Q: Eq + Hash + ?Sized>(&self, id: &Q) -> Option<u32>
    where
        K: Borrow<Q>,
    {
        let page = self.root.as_deref()?;
        find(page, self.hash.hash_one(id), id)
    }

    /// Adds an id that is not there yet.
    pub fn insert(&mut self, id: K, place: u32) {
        let hash = self.hash.hash_one(&id);
        insert(&mut self.root, (hash, id, place), 0);
    }

    /// Gives an id a place, and returns the one that it had.
    pub fn replace(&mut self, id: K, place: u32) -> Option<u32> {
        let hash = self.hash.hash_one(&id);
        let known = self.root.as_deref();
        let known = known.and_then(|page| find(page, hash, &id));
        if known.is_some() {
            remove(&mut self.root, hash, &id);
        }
        insert(&mut self.root, (hash, id, place), 0);
        known
    }

    /// Removes an id, if it is there.
    pub fn remove<Q: Eq + Hash + ?Sized>(&mut self, id: &Q)
    where
        K: Borrow<Q>,
    {
        remove(&mut self.root, self.hash.hash_one(id), id);
    }
}

fn find<K: Borrow<Q>, Q: Eq + ?Sized>(mut page: &Page<K>, hash: u64, id: &Q) -> Option<u32> {
    let mut shift = 0;
    loop {
        match page {
            Page::Bucket(items) => {
                let mut items = items.iter();
                let found = items.find(|(h, known, _)| *h == hash && known.borrow() == id);
                return found.map(|(_, _, place)| *place);
            }
            Page::Branch(pages) => {
                page = pages[slot(hash, shift)].as_deref()?;
                shift += BITS;
            }
        }
    }
}

fn remove<K: Clone + Borrow<Q>, Q: Eq + ?Sized>(
    mut page: &mut Option<Arc<Page<K>>>,
    hash: u64,
    id: &Q,
) {
    let mut shift = 0;
    while let Some(here) = page {
        match Arc::make_mut(here) {
            Page::Bucket(items) => {
                items.retain(|(h, known, _)| *h != hash || known.borrow() != id);
                return;
            }
            Page::Branch(pages) => page = &mut pages[slot(hash, shift)],
        }
        shift += BITS;
    }
}

fn slot(hash: u64, shift: u32) -> usize {
    (hash >> shift) as usize % (1 << BITS)
}

fn insert<K: Clone>(page: &mut Option<Arc<Page<K>>>, item: (u64, K, u32), shift: u32) {
    let Some(here) = page else {
        let mut items = Vec::with_capacity(BUCKET / 2);
        items.push(item);
        *page = Some(Arc::new(Page::Bucket(items)));
        return;
    };
    let here = Arc::make_mut(here);
    match here {
        // Ids of one hash share a bucket, however many they are.
        Page::Bucket(items) if items.len() < BUCKET || shift >= u64::BITS => items.push(item),
        Page::Bucket(items) => {
            let mut pages: [Option<Arc<Page<K>>>; 1 << BITS] = Default::default();
            for old in items.drain(..).chain([item]) {
                let at = slot(old.0, shift);
                insert(&mut pages[at], old, shift + BITS);
            }
            *here = Page::Branch(pages);
        }
        Page::Branch(pages) => {
            let at = slot(item.0, shift);
            insert(&mut pages[at], item, shift + BITS);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Ids;
    use std::sync::Arc;

    /// Under Miri, every step takes a thousand times as long.
    const COUNT: u32 = if cfg!(miri) { 200 } else { 5000 };

    #[test]
    fn ids_come_and_go() {
        let mut ids: Ids<Arc<str>> = Ids::new();
        let name = |number: u32| format!("node{number}");
        (0..COUNT).for_each(|number| ids.insert(name(number).into(), number));
        let before = ids.clone();
        (0..COUNT)
            .step_by(2)
            .for_each(|number| ids.remove(name(number).as_str()));
        for number in 0..COUNT {
            assert_eq!(before.get(name(number).as_str()), Some(number));
            assert_eq!(
                ids.get(name(number).as_str()),
                (number % 2 == 1).then_some(number)
            );
        }
        ids.remove("nothing");
        assert_eq!(ids.get("nothing"), None);
        for number in 0..COUNT {
            let before = ids.get(name(number).as_str());
            assert_eq!(ids.replace(name(number).into(), number + 1), before);
            assert_eq!(ids.get(name(number).as_str()), Some(number + 1));
        }
    }
}
