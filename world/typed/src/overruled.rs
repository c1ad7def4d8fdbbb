//! Values that two components gave one attribute without knowing of each other.

use crate::kind::Kind;
use crate::view::View;
use property_graph::{Element, Value};
use rc_world_member::Member;

/// Another component gave an attribute a value at the same time as this one, whose value is shown. A
/// change decides otherwise.
#[derive(Clone, Debug)]
pub struct Overruled {
    /// The present version.
    pub now: View,
    /// The element.
    pub element: Element,
    /// The attribute.
    pub attribute: String,
    /// The value of this component, which all show. `None` if it took the value away.
    pub shown: Option<Value>,
    /// The value of the other one, which none shows.
    pub other: Option<Value>,
}

impl Overruled {
    /// The next one whose element is still there.
    pub fn next(member: &Member) -> Option<Self> {
        loop {
            let one = member.overruled()?;
            let now = View(member.snapshot());
            if let Some(element) = now.find(one.of) {
                return Some(Self {
                    now,
                    element,
                    attribute: one.attribute,
                    shown: one.shown,
                    other: one.other,
                });
            }
        }
    }

    /// The element, if it has this type, or one that inherits from it.
    pub fn of<K: Kind>(&self) -> Option<K::In<'_>> {
        K::of(&self.now, self.element)
    }
}
