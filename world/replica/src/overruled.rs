//! Values that two replicas gave one attribute without knowing of each other.

use graph_merge::{Record, Replica};
use property_graph::{Id, Value};
use std::collections::VecDeque;

/// How many are kept until the component takes them.
const MOST_KEPT: usize = 256;

/// Another replica gave an attribute a value at the same time as this one, whose value is shown.
/// The component may change its decision by a change.
#[derive(Clone, Debug, PartialEq)]
pub struct Overruled {
    /// The element.
    pub of: Id,
    /// The attribute.
    pub attribute: String,
    /// The value of this replica, which all show.
    pub shown: Option<Value>,
    /// The value of the other one, which none shows.
    pub other: Option<Value>,
    /// The writer of the other value.
    pub writer: u64,
}

/// Notes the values of changes that lose against those of this replica. They were made without
/// knowing of each other: this replica gets the other value only now, and the greater count says
/// that the other one did not know this value.
pub(crate) fn note(all: &mut VecDeque<Overruled>, replica: &Replica, records: &[Record]) {
    let own = replica.writer();
    for record in records {
        let Record::Attribute {
            stamp,
            of,
            name,
            value,
        } = record
        else {
            continue;
        };
        let is_lost = stamp.writer != own
            && stamp.sequence
                > replica
                    .seen()
                    .get(&stamp.writer)
                    .copied()
                    .unwrap_or_default()
            && replica.stamp_of(*of, name).is_some_and(|shown| {
                shown.writer == own && (stamp.count, stamp.writer) < (shown.count, shown.writer)
            });
        if !is_lost {
            continue;
        }
        let shown = replica.get(*of, name);
        if shown == value.as_ref() {
            continue;
        }
        if all.len() == MOST_KEPT {
            all.pop_front();
        }
        all.push_back(Overruled {
            of: *of,
            attribute: name.to_string(),
            shown: shown.cloned(),
            other: value.clone(),
            writer: stamp.writer,
        });
    }
}
