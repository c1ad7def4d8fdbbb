//! The hash of digests, see [`digest`](crate::digest).

use crate::record::Stamp;
use property_graph::{Id, Value};

/// The hash FNV-1a of all that is added.
pub(crate) struct Hash(pub(crate) u64);

impl Hash {
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    pub(crate) fn count(&mut self, count: usize) {
        self.bytes(&(count as u64).to_le_bytes());
    }

    pub(crate) fn text(&mut self, text: &[u8]) {
        self.count(text.len());
        self.bytes(text);
    }

    pub(crate) fn id(&mut self, id: Id) {
        self.bytes(&id.0.to_le_bytes());
    }

    pub(crate) fn stamp(&mut self, stamp: &Stamp) {
        for number in [stamp.count, stamp.writer, stamp.sequence] {
            self.bytes(&number.to_le_bytes());
        }
    }

    pub(crate) fn value(&mut self, value: Option<&Value>) {
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
