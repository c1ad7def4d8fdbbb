//! Transforms to the root that were computed already.
//!
//! A cell holds the transform of one node in one version. Readers and writers of a cell never wait:
//! who finds a cell in use computes the transform itself.

use crate::transform::Transform;
use nalgebra::Matrix3;
use std::sync::atomic::{AtomicU64, Ordering, fence};

const CELLS: usize = 256;

#[derive(Debug, Default)]
#[repr(align(128))]
struct Cell {
    /// Odd while a thread writes the cell.
    sequence: AtomicU64,
    version: AtomicU64,
    node: AtomicU64,
    values: [AtomicU64; 12],
}

/// The cells of one model.
#[derive(Debug)]
pub(crate) struct Cache {
    cells: Box<[Cell]>,
}

impl Cache {
    pub(crate) fn new() -> Self {
        Self {
            cells: (0..CELLS).map(|_| Cell::default()).collect(),
        }
    }

    #[inline]
    fn cell(&self, version: u64, node: u32) -> &Cell {
        let mixed = (version ^ u64::from(node) << 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        &self.cells[(mixed >> 56) as usize % CELLS]
    }

    /// The transform of a node in a version. Versions start at 1, so an empty cell is of none.
    #[inline]
    pub(crate) fn get(&self, version: u64, node: u32) -> Option<Transform> {
        let cell = self.cell(version, node);
        let before = cell.sequence.load(Ordering::Acquire);
        if before % 2 == 1
            || cell.version.load(Ordering::Relaxed) != version
            || cell.node.load(Ordering::Relaxed) != u64::from(node)
        {
            return None;
        }
        let v = |at: usize| f64::from_bits(cell.values[at].load(Ordering::Relaxed));
        let transform = Transform {
            rotation: Matrix3::new(v(0), v(1), v(2), v(3), v(4), v(5), v(6), v(7), v(8)),
            translation: [v(9), v(10), v(11)].into(),
        };
        fence(Ordering::Acquire);
        (cell.sequence.load(Ordering::Relaxed) == before).then_some(transform)
    }

    /// Keeps a transform, unless another thread writes the same cell.
    #[inline]
    pub(crate) fn put(&self, version: u64, node: u32, transform: &Transform) {
        let cell = self.cell(version, node);
        let before = cell.sequence.load(Ordering::Relaxed);
        let free = before.is_multiple_of(2)
            && cell
                .sequence
                .compare_exchange(before, before + 1, Ordering::Acquire, Ordering::Relaxed)
                .is_ok();
        if !free {
            return;
        }
        fence(Ordering::Release);
        cell.version.store(version, Ordering::Relaxed);
        cell.node.store(u64::from(node), Ordering::Relaxed);
        let r = &transform.rotation;
        let rows = [
            (0, 0),
            (0, 1),
            (0, 2),
            (1, 0),
            (1, 1),
            (1, 2),
            (2, 0),
            (2, 1),
            (2, 2),
        ];
        let numbers = rows
            .into_iter()
            .map(|at| r[at])
            .chain(transform.translation.iter().copied());
        for (slot, number) in cell.values.iter().zip(numbers) {
            slot.store(number.to_bits(), Ordering::Relaxed);
        }
        cell.sequence.store(before + 2, Ordering::Release);
    }
}
