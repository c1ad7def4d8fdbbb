//! Slot arrays, as a worker sees them: it opens their members in `initialize`, and handlers learn
//! which member is asked.

use crate::member::MemberError;
use crate::ports::{Connections, Ports};
use rc_middleware::{Member, OpenError};
use std::ops::{Index, IndexMut};
use std::rc::Rc;

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
    fn new(
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
    /// The name is not a name of a member or is taken, `initialize` has ended, or the middleware
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

    /// The members with their ends, to call or to publish.
    pub fn iter_mut(&mut self) -> impl ExactSizeIterator<Item = (&Member, &mut E)> {
        self.members.iter().zip(&mut self.ends)
    }

    fn place_of(&self, member: &Member) -> usize {
        let place = member.index();
        assert!(
            self.members.get(place) == Some(member),
            "`{}` is a member of another slot array; find its namesake with `get`",
            member.name()
        );
        place
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

impl Connections {
    /// A slot array, whose members `open` opens by their numbers.
    pub fn array<E>(
        self: &Rc<Self>,
        slot: usize,
        open: fn(&Self, usize) -> Result<E, OpenError>,
    ) -> SlotArray<E> {
        SlotArray::new(self, slot, open)
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

    /// # Panics
    /// It is a member of another array.
    fn index(&self, member: &Member) -> &E {
        &self.ends[self.place_of(member)]
    }
}

impl<E> IndexMut<&Member> for SlotArray<E> {
    fn index_mut(&mut self, member: &Member) -> &mut E {
        let place = self.place_of(member);
        &mut self.ends[place]
    }
}
