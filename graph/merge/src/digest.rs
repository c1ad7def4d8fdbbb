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

use crate::record::Stamp;
use crate::replica::{Element, Made, Replica};
use property_graph::{Id, Value};

/// The hash FNV-1a of all that is added.
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn count(&mut self, count: usize) {
        self.bytes(&(count as u64).to_le_bytes());
    }

    fn text(&mut self, text: &[u8]) {
        self.count(text.len());
        self.bytes(text);
    }

    fn id(&mut self, id: Id) {
        self.bytes(&id.0.to_le_bytes());
    }

    fn stamp(&mut self, stamp: &Stamp) {
        for number in [stamp.count, stamp.writer, stamp.sequence] {
            self.bytes(&number.to_le_bytes());
        }
    }

    fn value(&mut self, value: Option<&Value>) {
        match value {
            None => self.bytes(&[0]),
            Some(Value::Bool(yes)) => self.bytes(&[1, u8::from(*yes)]),
            Some(Value::Int(number)) => {
                self.bytes(&[2]);
                self.bytes(&number.to_le_bytes());
            }
            Some(Value::Float(number)) => {
                self.bytes(&[3]);
                self.bytes(&number.to_le_bytes());
            }
            Some(Value::Text(text)) => {
                self.bytes(&[4]);
                self.text(text.as_bytes());
            }
            Some(Value::Bytes(bytes)) => {
                self.bytes(&[5]);
                self.text(bytes);
            }
            Some(Value::Ints(all)) => {
                self.bytes(&[6]);
                self.count(all.len());
                all.iter()
                    .for_each(|number| self.bytes(&number.to_le_bytes()));
            }
            Some(Value::Floats(all)) => {
                self.bytes(&[7]);
                self.count(all.len());
                all.iter()
                    .for_each(|number| self.bytes(&number.to_le_bytes()));
            }
            Some(Value::Texts(all)) => {
                self.bytes(&[8]);
                self.count(all.len());
                all.iter().for_each(|text| self.text(text.as_bytes()));
            }
            Some(Value::Sample(sample)) => {
                self.bytes(&[9]);
                self.text(sample.topic.as_bytes());
                self.text(sample.kind.as_bytes());
                self.bytes(&sample.sequence.to_le_bytes());
            }
        }
    }
}

/// The range of an element.
pub(crate) fn range_of(id: Id, ranges: usize) -> usize {
    let mut hash = Hash::new();
    hash.id(id);
    (hash.0 % ranges.max(1) as u64) as usize
}

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
    for (name, (stamp, value)) in &element.attributes {
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
