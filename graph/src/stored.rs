//! Values as elements hold them. A value that several attributes have in their representations is
//! there once, with those that somebody has asked for.

use crate::names::Symbol;
use crate::value::Value;
use once_cell::race::OnceBox;
use std::fmt;
use std::sync::Arc;

/// Attributes, in the order of their symbols.
pub(crate) type Attributes = Option<Arc<[(Symbol, Stored)]>>;

/// A value of an element.
#[derive(Clone, Debug)]
pub(crate) enum Stored {
    Plain(Value),
    /// Several attributes have it.
    Shared(Arc<Shared>),
}

/// A value in the representation in which it was set, and in others.
pub(crate) struct Shared {
    value: Value,
    /// By the places of the attributes that have it. A representation is kept once converted, and
    /// no reader waits while another one converts.
    others: Box<[OnceBox<Option<Value>>]>,
}

impl fmt::Debug for Shared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.value.fmt(f)
    }
}

impl Stored {
    /// A value that so many attributes have.
    pub(crate) fn shared(value: Value, count: usize) -> Self {
        let others = (0..count).map(|_| OnceBox::new()).collect();
        Self::Shared(Arc::new(Shared { value, others }))
    }

    /// The value as it was set.
    #[inline]
    pub(crate) fn value(&self) -> &Value {
        match self {
            Self::Plain(value) => value,
            Self::Shared(shared) => &shared.value,
        }
    }

    /// The value as that of the attribute at a place, which `convert` makes the first time.
    pub(crate) fn other(
        &self,
        at: usize,
        convert: impl FnOnce(&Value) -> Option<Value>,
    ) -> Option<&Value> {
        let Self::Shared(shared) = self else {
            return None;
        };
        let other = shared.others.get(at)?;
        let made = other.get_or_init(|| Box::new(convert(&shared.value)));
        made.as_ref()
    }
}

/// How many attributes are looked through in their order.
const FEW: usize = 16;

/// The content of an element under a name.
#[inline]
pub(crate) fn stored(attributes: &Attributes, attribute: Symbol) -> Option<&Stored> {
    let all = attributes.as_deref()?;
    // For a few, a search from the start is faster.
    if all.len() <= FEW {
        let found = all.iter().find(|(known, _)| *known == attribute);
        return found.map(|(_, stored)| stored);
    }
    let at = all.binary_search_by_key(&attribute, |(known, _)| *known);
    all.get(at.ok()?).map(|(_, stored)| stored)
}

/// The value that was set under a name.
#[inline]
pub(crate) fn value(attributes: &Attributes, attribute: Symbol) -> Option<&Value> {
    stored(attributes, attribute).map(Stored::value)
}
