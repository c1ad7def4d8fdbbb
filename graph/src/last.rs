//! The change that made a version, if it is a small one of attributes: whoever follows a graph version
//! by version gets the differences without a comparison.

use crate::edit::Edit;
use crate::element::Element;
use crate::snapshot::Snapshot;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// How many elements it names at most.
const MOST: usize = 16;

/// Makes the numbers of versions.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// The elements that a change has touched. A clone is another version with the same content, perhaps the
/// beginning of the next one.
#[derive(Debug)]
pub(crate) struct LastChange {
    /// Number of the version among those of all graphs of this process.
    number: u64,
    /// The number of the version before.
    before: u64,
    /// The elements of which attributes were set. `None`: others may have changed.
    touched: Option<Vec<Element>>,
}

impl Default for LastChange {
    fn default() -> Self {
        Self {
            number: NEXT.fetch_add(1, Ordering::Relaxed),
            before: 0,
            touched: None,
        }
    }
}

impl Clone for LastChange {
    fn clone(&self) -> Self {
        Self {
            before: self.number,
            ..Self::default()
        }
    }
}

impl Edit {
    /// Notes in the version that it becomes what it has touched.
    pub(crate) fn note_touched(&mut self, before: &Snapshot) {
        if self.touched_since(before).is_some() {
            // Versions are kept; many steps may have touched a few elements.
            self.touched.shrink_to(MOST);
            self.next.last.touched = Some(std::mem::take(&mut self.touched));
        }
    }

    /// The elements that differ from the version before, if only attributes of a few do.
    pub(crate) fn touched_since(&mut self, before: &Snapshot) -> Option<&[Element]> {
        let is_next = self.next.last.before == before.last.number;
        if !is_next || !Arc::ptr_eq(&self.next.shape, &before.shape) {
            return None;
        }
        if self.touched.len() > 1 {
            self.touched.sort_unstable();
            self.touched.dedup();
        }
        (self.touched.len() <= MOST).then_some(&self.touched)
    }
}

impl Snapshot {
    /// The elements that differ from the version before, if only attributes of a few do.
    pub(crate) fn touched_since(&self, before: &Self) -> Option<&[Element]> {
        let touched = self.last.touched.as_deref()?;
        (self.last.before == before.last.number).then_some(touched)
    }
}
