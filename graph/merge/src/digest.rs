//! Digests: equal on all machines and in all versions of this crate, because the bytes are defined.
//!
//! An element that is not removed is these bytes: its id (16), then 0 and the type for a node, or
//! 1, the type and the ids of both ends for an edge, then the stamp of what made it. Each attribute
//! follows, in the order of the bytes of their names: name, stamp, and its value, or 0 if it was
//! removed. A stamp is count, writer and sequence (8 each). A text is its number of bytes (8) and
//! its UTF-8. A value is a number for its type and its content: 1 a bool (1), 2 an integer (8), 3 a
//! float as its bits (8), 4 a text, 5 bytes like a text, 6 integers, 7 floats and 8 texts, each
//! list with its count (8) before it, 9 the topic, the type and the number (8) of a sample. A
//! removed element at which an edge starts or ends that is not removed is its id and 2. All numbers
//! begin with their lowest byte.
//!
//! The hash of an element is FNV-1a with 64 bits over them, a digest the sum of hashes without
//! carry, and the range of an element the same hash of its id, modulo the number of ranges.

use crate::hash::{Hash, range_of};
use crate::record::Stamp;
use crate::replica::{Element, Made, Replica};
use property_graph::Id;

fn hash(id: Id, (stamp, made): &(Stamp, Made), element: &Element) -> u64 {
    let mut hash = Hash::new();
    hash.id(id);
    match made {
        Made::Node(kind) => {
            hash.bytes(&[0]);
            hash.text(kind.as_bytes());
        }
        Made::Edge(kind, from, to) => {
            hash.bytes(&[1]);
            hash.text(kind.as_bytes());
            hash.id(*from);
            hash.id(*to);
        }
    }
    hash.stamp(stamp);
    for (name, (stamp, value)) in element.attributes.iter() {
        hash.text(name.as_bytes());
        hash.stamp(stamp);
        hash.value(value.as_ref());
    }
    hash.0
}

impl Replica {
    /// Digests of the elements that are not removed, and of removed ends of edges, by ranges of
    /// their ids: replicas with equal digests have equal views. A digest that differs names the
    /// range in which to look. The bytes are those that the module `digest` of this crate defines.
    pub fn digests(&self, ranges: usize) -> Vec<u64> {
        let ranges = ranges.max(1);
        let mut digests = vec![0_u64; ranges];
        for (id, element) in &self.elements {
            if let Some(made) = element.made.as_ref().filter(|_| element.removed.is_none()) {
                // The order of elements does not matter.
                let digest = &mut digests[range_of(*id, ranges)];
                *digest = digest.wrapping_add(hash(*id, made, element));
            }
        }
        for (end, edges) in &self.edges {
            if self.is_removed(*end) && edges.iter().any(|edge| self.has(*edge)) {
                let mut hash = Hash::new();
                hash.id(*end);
                hash.bytes(&[2]);
                let digest = &mut digests[range_of(*end, ranges)];
                *digest = digest.wrapping_add(hash.0);
            }
        }
        digests
    }
}
