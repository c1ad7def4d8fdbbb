//! How old a value is, and what it is made of.
//!
//! The labels are those of `RobMoSys`, deliverable 3.2, section 2.2: a result of a fresh computation, one
//! of cached parts, and one that was cached as a whole.

use std::ops::Deref;
use std::time::Duration;

/// Origin of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Made {
    /// All of it is new: no part was used before, and no reply was kept.
    Computed,
    /// Some parts are new, others were used before or kept.
    PartlyCached,
    /// No part is new.
    Cached,
}

impl Made {
    /// The label of a value with parts of both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        if self == other {
            self
        } else {
            Self::PartlyCached
        }
    }

    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Computed => "computed",
            Self::PartlyCached => "partly cached",
            Self::Cached => "cached",
        }
    }
}

/// The age of a value, and what it is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Freshness {
    /// The time since it was sent; of a reply, since its call began, or since its value was made, if
    /// that was earlier and the reply says so.
    pub age: Duration,
    /// Origin of the value.
    pub made: Made,
    /// Whether it is no older than its slot allows.
    pub is_fresh: bool,
}

/// A value that knows its age.
///
/// ```
/// use rc_middleware::freshness::{Fresh, Freshness, Made};
/// use std::time::Duration;
///
/// let new = Freshness { age: Duration::from_millis(3), made: Made::Computed, is_fresh: true };
/// let old = Freshness { age: Duration::from_millis(90), made: Made::Cached, is_fresh: false };
/// let both = Fresh::new(2.5, new).with(Fresh::new("front", old));
/// assert_eq!(both.value, (2.5, "front"));
/// assert_eq!(both.freshness.age, old.age);
/// assert_eq!(both.freshness.made, Made::PartlyCached);
/// assert!(!both.freshness.is_fresh);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fresh<T> {
    /// The value.
    pub value: T,
    /// Its age, and what it is made of.
    pub freshness: Freshness,
}

impl<T> Fresh<T> {
    /// A value with its age.
    pub fn new(value: T, freshness: Freshness) -> Self {
        Self { value, freshness }
    }

    /// Its age.
    pub fn age(&self) -> Duration {
        self.freshness.age
    }

    /// What it is made of.
    pub fn made(&self) -> Made {
        self.freshness.made
    }

    /// Whether it is no older than its slot allows.
    pub fn is_fresh(&self) -> bool {
        self.freshness.is_fresh
    }

    /// Another value that is made of this one.
    pub fn map<U>(self, make: impl FnOnce(T) -> U) -> Fresh<U> {
        Fresh::new(make(self.value), self.freshness)
    }

    /// Both values: as old as the older one, and made of both.
    pub fn with<U>(self, other: Fresh<U>) -> Fresh<(T, U)> {
        let (own, others) = (self.freshness, other.freshness);
        let freshness = Freshness {
            age: own.age.max(others.age),
            made: own.made.and(others.made),
            is_fresh: own.is_fresh && others.is_fresh,
        };
        Fresh::new((self.value, other.value), freshness)
    }
}

impl<T> Deref for Fresh<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}
