//! The announcement of a replica's state.

use graph_merge::Replica;
use graph_schema::Schema;

/// How many ranges the digests of a replica have.
pub(crate) const RANGES: usize = 64;

/// Digests of the present state, kept until it changes.
#[derive(Default)]
pub(crate) struct Digests {
    ranges: Vec<u64>,
}

impl Digests {
    pub(crate) fn clear(&mut self) {
        self.ranges.clear();
    }

    /// The digests of a replica.
    pub(crate) fn of(&mut self, replica: &Replica) -> Vec<u64> {
        if self.ranges.is_empty() {
            self.ranges = replica.digests(RANGES);
        }
        self.ranges.clone()
    }
}

/// One number for all digests: the sum without carry.
pub(crate) fn one(ranges: &[u64]) -> u64 {
    ranges.iter().fold(0, |sum, range| sum.wrapping_add(*range))
}

/// Equal for schemas with equal declarations: FNV-1a with 64 bits over these.
pub(crate) fn of_schema(schema: &Schema) -> u64 {
    let all = Schema::default().differences(schema);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for declared in all {
        let second = declared.second.unwrap_or_default();
        for byte in declared
            .what
            .bytes()
            .chain([0])
            .chain(second.bytes())
            .chain([0])
        {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    hash
}
