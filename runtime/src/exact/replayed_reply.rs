//! The reply of a component that is repeated.

use super::entry::{Entry, Kind, number};
use super::ports::profile_of;
use rc_middleware::{Profile, Reply};
use std::borrow::Cow;

/// The reply to a request.
pub(super) struct Replying {
    body: Vec<u8>,
    profile: Profile,
}

impl Replying {
    pub(super) fn new(profile: u16) -> Self {
        Self {
            body: Vec::new(),
            profile: profile_of(u64::from(profile)),
        }
    }

    /// The reply as an entry of the recording.
    pub(super) fn into_entry(self, slot: usize) -> Entry<'static> {
        Entry {
            value: number(rc_middleware::Encoding::Cdr),
            data: Cow::Owned(self.body),
            ..Entry::at(Kind::Reply, slot, 0)
        }
    }
}

impl Reply for Replying {
    fn body(&mut self) -> &mut Vec<u8> {
        &mut self.body
    }

    fn profile(&self) -> Profile {
        self.profile
    }
}
