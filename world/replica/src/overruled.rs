//! Values that two replicas gave one attribute without knowing of each other.

use crate::core::Core;
use graph_merge::{Delta, Record};
use property_graph::{Id, Value};

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

/// Notes the values of a delta that lose against those of this replica. They were made without
/// knowing of each other: this replica gets the other value only now, and the greater count says
/// that the other one did not know this value.
pub(crate) fn note(core: &mut Core, delta: &Delta) {
    let own = core.replica.writer();
    for record in &delta.records {
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
            && stamp.sequence > core.seen(stamp.writer)
            && core.replica.stamp_of(*of, name).is_some_and(|shown| {
                shown.writer == own && (stamp.count, stamp.writer) < (shown.count, shown.writer)
            });
        let shown = core.replica.get(*of, name);
        if !is_lost || shown == value.as_ref() {
            continue;
        }
        if core.overruled.len() == MOST_KEPT {
            core.overruled.pop_front();
        }
        core.overruled.push_back(Overruled {
            of: *of,
            attribute: name.clone(),
            shown: shown.cloned(),
            other: value.clone(),
            writer: stamp.writer,
        });
    }
}
