//! Slot arrays, as a worker sees them: it opens their members in `initialize`, and handlers learn
//! which member is asked.

use crate::ports::{Connections, Ports};
use rc_middleware::OpenError;
use rc_settings::member::MOST;
use std::ops::{Index, IndexMut};
use std::sync::Arc;

/// A member of a slot array. Its clones are the same member; they are cheap.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Member {
    index: usize,
    /// Its number among all slots of the component.
    slot: usize,
    name: Arc<str>,
}

impl Member {
    pub(crate) fn new(index: usize, slot: usize, name: &str) -> Self {
        Self {
            index,
            slot,
            name: Arc::from(name),
        }
    }

    /// Its number in the array, in the order in which the worker opened the members, from 0: an
    /// index into a list that the worker keeps.
    pub fn index(&self) -> usize {
        self.index
    }

    /// Its name, as the worker opened it: `front`.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn slot(&self) -> usize {
        self.slot
    }
}

/// A member was not opened.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MemberError {
    /// A middleware would not take the name.
    #[error("`{name}` cannot be a member of `{array}`: {reason}")]
    BadName {
        /// The slot array.
        array: String,
        /// The name that was given.
        name: String,
        /// What is allowed.
        reason: String,
    },
    /// The array has such a member, perhaps in other letters: `Front` and `front`.
    #[error("`{array}` already has the member `{first}`; give `{name}` another name")]
    Taken {
        /// The slot array.
        array: String,
        /// The name that was given.
        name: String,
        /// The name of the member that is there.
        first: String,
    },
    /// The array has as many members as it can have.
    #[error("`{array}` has {MOST} members, which is the maximum; there is no place for `{name}`")]
    TooMany {
        /// The slot array.
        array: String,
        /// The name that was given.
        name: String,
    },
    /// The component runs: its members are known to its peers and to its tools.
    #[error("`{array}.{name}` comes too late; open members in `initialize`")]
    TooLate {
        /// The slot array.
        array: String,
        /// The name that was given.
        name: String,
    },
    /// The connection could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
}

/// A slot array of the context: `E` is the client or the publisher of a member, `()` where members
/// receive.
///
/// The worker opens the members in `initialize`. Afterwards they stay as they are.
///
/// ```no_run
/// # use rc_runtime::{Member, MemberError, SlotArray};
/// # fn initialize(lasers: &mut SlotArray<()>, poses: &mut SlotArray<u8>) -> Result<(), MemberError> {
/// let front: Member = lasers.open("front")?;
/// assert_eq!((front.index(), front.name()), (0, "front"));
/// // A component whose members the network decides:
/// poses.open_listed()?;
/// for (member, publisher) in poses.iter_mut() {
///     println!("{}: {publisher}", member.name());
/// }
/// # Ok(())
/// # }
/// ```
pub struct SlotArray<E> {
    ports: Ports,
    slot: usize,
    open: fn(&Connections, usize) -> Result<E, OpenError>,
    members: Vec<Member>,
    ends: Vec<E>,
}

impl<E> SlotArray<E> {
    pub(crate) fn new(
        ports: &Ports,
        slot: usize,
        open: fn(&Connections, usize) -> Result<E, OpenError>,
    ) -> Self {
        Self {
            ports: Ports::clone(ports),
            slot,
            open,
            members: Vec::new(),
            ends: Vec::new(),
        }
    }

    /// Opens a member. Its address is `NETWORK/INSTANCE/ARRAY/MEMBER`.
    ///
    /// # Errors
    /// The name is no name of a member or is taken, `initialize` has ended, or the middleware
    /// refuses.
    pub fn open(&mut self, name: &str) -> Result<Member, MemberError> {
        let (member, end) = self.ports.open_member(self.slot, name, self.open)?;
        self.members.push(member.clone());
        self.ends.push(end);
        Ok(member)
    }

    /// The members that the network lists in `slots { … }`, or the command line after `--members`.
    /// `None` if neither does: the component was started by hand. The runtime ends a component that
    /// does not open exactly these.
    pub fn listed(&self) -> Option<Vec<String>> {
        self.ports.listed(self.slot)
    }

    /// Opens the members that the network lists.
    ///
    /// # Errors
    /// Those of [`SlotArray::open`].
    pub fn open_listed(&mut self) -> Result<(), MemberError> {
        let listed = self.listed().unwrap_or_default();
        listed.iter().try_for_each(|name| self.open(name).map(drop))
    }

    /// The open members, in their order.
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// A member by its name.
    pub fn get(&self, name: &str) -> Option<&Member> {
        self.members.iter().find(|member| member.name() == name)
    }

    /// How many members are open.
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Whether no member is open.
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// The members with their clients or publishers.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&Member, &E)> {
        self.members.iter().zip(&self.ends)
    }

    /// The same, to call or to publish.
    pub fn iter_mut(&mut self) -> impl ExactSizeIterator<Item = (&Member, &mut E)> {
        self.members.iter().zip(&mut self.ends)
    }

    /// Writes the number of peers of each member into `peers`, for generated code.
    #[doc(hidden)]
    pub fn count_peers(&self, peers: &mut [usize], count: impl Fn(&E) -> usize) {
        for (member, end) in self.iter() {
            if let Some(place) = peers.get_mut(member.slot()) {
                *place = count(end);
            }
        }
    }
}

impl<E> Index<usize> for SlotArray<E> {
    type Output = E;

    fn index(&self, index: usize) -> &E {
        &self.ends[index]
    }
}

impl<E> IndexMut<usize> for SlotArray<E> {
    fn index_mut(&mut self, index: usize) -> &mut E {
        &mut self.ends[index]
    }
}

impl<E> Index<&Member> for SlotArray<E> {
    type Output = E;

    fn index(&self, member: &Member) -> &E {
        &self.ends[member.index()]
    }
}

impl<E> IndexMut<&Member> for SlotArray<E> {
    fn index_mut(&mut self, member: &Member) -> &mut E {
        &mut self.ends[member.index()]
    }
}
