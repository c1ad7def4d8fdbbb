//! Files that wait, each once. Each operation takes a time that grows with the logarithm of their number.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// A queue of files.
#[derive(Debug, Default)]
pub(super) struct Queue {
    /// The files by their place.
    order: BTreeMap<i64, PathBuf>,
    places: HashMap<PathBuf, i64>,
}

impl Queue {
    pub(super) fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Adds a file at the end, unless it waits.
    pub(super) fn push(&mut self, path: &Path) {
        if !self.places.contains_key(path) {
            let last = self.order.last_key_value();
            let place = last.map_or(0, |(place, _)| place + 1);
            self.put(path, place);
        }
    }

    /// Puts a file before all others.
    pub(super) fn push_front(&mut self, path: &Path) {
        self.remove(path);
        let first = self.order.first_key_value();
        let place = first.map_or(0, |(place, _)| place - 1);
        self.put(path, place);
    }

    fn put(&mut self, path: &Path, place: i64) {
        self.order.insert(place, path.to_path_buf());
        self.places.insert(path.to_path_buf(), place);
    }

    /// Takes a file out. Returns whether it waited.
    pub(super) fn remove(&mut self, path: &Path) -> bool {
        let place = self.places.remove(path);
        place.is_some_and(|place| self.order.remove(&place).is_some())
    }

    /// Takes the first file out.
    pub(super) fn pop(&mut self) -> Option<PathBuf> {
        let (_, path) = self.order.pop_first()?;
        self.places.remove(&path);
        Some(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_waits_once_and_the_one_put_first_comes_first() {
        let mut queue = Queue::default();
        for name in ["a", "b", "a", "c"] {
            queue.push(Path::new(name));
        }
        queue.push_front(Path::new("c"));
        queue.push_front(Path::new("d"));
        assert!(queue.remove(Path::new("b")));
        assert!(!queue.remove(Path::new("b")));
        let all: Vec<PathBuf> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(all, ["d", "c", "a"].map(PathBuf::from));
        assert!(queue.is_empty());
    }
}
