//! The slots of a running component: those of its description, then the members of its arrays in
//! the order in which the worker opens them. Their numbers are indices into this table.

use crate::description::{Description, Slot};
use crate::error::StartError;
use crate::member::MemberError;
use rc_middleware::{Address, Member, OpenError};
use rc_vocabulary::member;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::ops::Deref;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard};

/// The members that the network lists, by array. An array without an entry takes any.
pub(crate) type Listed = BTreeMap<String, Vec<String>>;

/// The middlewares of slots and members that the network chooses, by name.
pub(crate) type Transports = BTreeMap<String, Vec<&'static str>>;

/// A slot of the component, or a member of an array. It dereferences to its description.
#[derive(Debug)]
pub(crate) struct OpenSlot {
    /// The number in the description, of the array for a member.
    pub(crate) described: usize,
    pub(crate) slot: &'static Slot,
    /// `Laser`, or `lasers.front` for a member.
    pub(crate) name: Cow<'static, str>,
    pub(crate) member: Option<Member>,
    /// `None` for an array itself, and in a repeated run.
    pub(crate) address: Option<Address>,
    /// Its middlewares; at least one. Tools use the first one.
    pub(crate) transports: Vec<&'static str>,
}

/// A slot, or a member that the network lists, before it is open.
#[derive(Debug)]
pub(crate) struct NamedSlot {
    /// `Laser`, or `lasers/front` for a member.
    pub(crate) path: String,
    pub(crate) of: &'static Slot,
    pub(crate) address: Address,
    pub(crate) transports: Vec<&'static str>,
}

impl Deref for OpenSlot {
    type Target = Slot;

    fn deref(&self) -> &Slot {
        self.slot
    }
}

impl OpenSlot {
    /// Name as a path, as rules of settings write it: `Laser`, or `lasers/front` for a member.
    pub(crate) fn path(&self) -> String {
        match &self.member {
            Some(member) => format!("{}/{}", self.slot.name, member.name()),
            None => self.slot.name.to_owned(),
        }
    }

    /// The middleware that tools use.
    pub(crate) fn middleware(&self) -> &'static str {
        self.transports
            .first()
            .copied()
            .unwrap_or(self.slot.backend)
    }

    /// Whether it is an array, which has no connection itself.
    pub(crate) fn is_whole_array(&self) -> bool {
        self.slot.is_array && self.member.is_none()
    }
}

/// The slots by their numbers. Worker and management share them.
#[derive(Debug)]
pub(crate) struct SlotTable {
    description: &'static Description,
    slots: RwLock<Vec<Arc<OpenSlot>>>,
    /// `NETWORK/INSTANCE`, where members are.
    own: String,
    /// Addresses of members that are not the default ones.
    bindings: BTreeMap<String, Address>,
    /// The middlewares of slots and members that have others than the description gives them.
    transports: Transports,
    listed: RwLock<Listed>,
    /// Whether the worker has opened all members.
    is_complete: AtomicBool,
}

impl SlotTable {
    /// The slots at these addresses. The default of a slot is `NETWORK/Interface`, that of a member
    /// `NETWORK/INSTANCE/ARRAY/MEMBER`.
    pub(crate) fn new(
        description: &'static Description,
        (network, instance): (&str, &str),
        bindings: &BTreeMap<String, Address>,
        transports: &Transports,
        listed: Listed,
    ) -> Result<Self, OpenError> {
        let addressed = |slot: &'static Slot| match bindings.get(slot.name) {
            _ if slot.is_array => Ok(None),
            Some(address) => Ok(Some(address.clone())),
            None => parse(format!("{network}/{}", slot.interface)).map(Some),
        };
        let mut slots = Vec::new();
        for slot in description.slots {
            slots.push((slot, addressed(slot)?));
        }
        let bound = bindings
            .iter()
            .filter(|(slot, _)| member::split(slot).is_some());
        Ok(Self {
            bindings: bound.map(|(slot, to)| (slot.clone(), to.clone())).collect(),
            listed: RwLock::new(listed),
            ..Self::of(description, (network, instance), transports, slots)
        })
    }

    /// The slots of a component that is repeated: they have no addresses.
    pub(crate) fn replayed(
        description: &'static Description,
        names: (&str, &str),
        listed: Listed,
    ) -> Self {
        let slots = description.slots.iter().map(|slot| (slot, None));
        Self {
            listed: RwLock::new(listed),
            ..Self::of(description, names, &Transports::new(), slots.collect())
        }
    }

    fn of(
        description: &'static Description,
        (network, instance): (&str, &str),
        transports: &Transports,
        slots: Vec<(&'static Slot, Option<Address>)>,
    ) -> Self {
        let slots = slots.into_iter().enumerate();
        let slots = slots.map(|(described, (slot, address))| {
            Arc::new(OpenSlot {
                described,
                slot,
                name: Cow::Borrowed(slot.name),
                member: None,
                address,
                transports: chosen(transports, slot.name, slot),
            })
        });
        Self {
            description,
            slots: RwLock::new(slots.collect()),
            own: format!("{network}/{}", instance.replace('.', "/")),
            bindings: BTreeMap::new(),
            transports: transports.clone(),
            listed: RwLock::default(),
            is_complete: AtomicBool::new(false),
        }
    }

    /// The slots that there are now.
    pub(crate) fn all(&self) -> Vec<Arc<OpenSlot>> {
        self.slots
            .read()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// A slot by its number.
    pub(crate) fn get(&self, slot: usize) -> Option<Arc<OpenSlot>> {
        let slots = self.slots.read().unwrap_or_else(PoisonError::into_inner);
        slots.get(slot).cloned()
    }

    /// The slots of the description, with the listed members in place of arrays.
    pub(crate) fn named(&self) -> Result<Vec<NamedSlot>, OpenError> {
        let mut named = Vec::new();
        for open in self.all() {
            if let (Some(address), None) = (&open.address, &open.member) {
                named.push(NamedSlot {
                    path: open.path(),
                    of: open.slot,
                    address: address.clone(),
                    transports: open.transports.clone(),
                });
            }
            let listed = self
                .listed(open.described)
                .filter(|_| open.is_whole_array());
            for name in listed.unwrap_or_default() {
                named.push(NamedSlot {
                    path: format!("{}/{name}", open.slot.name),
                    of: open.slot,
                    address: self.address(open.slot.name, &name)?,
                    transports: chosen(
                        &self.transports,
                        &member::path(open.slot.name, &name),
                        open.slot,
                    ),
                });
            }
        }
        Ok(named)
    }

    /// The middlewares over which slots, and members that the worker may open, have connections.
    pub(crate) fn used(&self) -> Result<BTreeSet<&'static str>, OpenError> {
        let named = self.named()?;
        let named = named
            .iter()
            .flat_map(|slot| slot.transports.iter().copied());
        let mut arrays = self.description.slots.iter();
        let arrays = arrays
            .by_ref()
            .filter(|slot| slot.is_array && !self.lists().contains_key(slot.name));
        Ok(named.chain(arrays.map(|slot| slot.backend)).collect())
    }

    /// Whether a path may be that of a member which no network lists.
    pub(crate) fn may_have(&self, path: &str) -> bool {
        let array = path.split('/').next().unwrap_or_default();
        let mut arrays = self.description.slots.iter().filter(|slot| slot.is_array);
        path.len() > array.len()
            && arrays.any(|slot| slot.name == array && !self.lists().contains_key(array))
    }

    /// How many slots there are now.
    pub(crate) fn len(&self) -> usize {
        let slots = self.slots.read().unwrap_or_else(PoisonError::into_inner);
        slots.len()
    }

    /// How many slots there can be.
    pub(crate) fn capacity(description: &Description) -> usize {
        let arrays = description.slots.iter().filter(|slot| slot.is_array);
        description.slots.len() + arrays.count() * member::MOST
    }

    /// The members that the network lists.
    pub(crate) fn listed(&self, array: usize) -> Option<Vec<String>> {
        let array = self.description.slots.get(array)?;
        self.lists().get(array.name).cloned()
    }

    /// Lists the members of an array, for tests.
    pub(crate) fn list(&self, array: &str, members: &[&str]) {
        let members = members.iter().map(|name| (*name).to_owned()).collect();
        let mut listed = self.listed.write().unwrap_or_else(PoisonError::into_inner);
        listed.insert(array.to_owned(), members);
    }

    fn lists(&self) -> RwLockReadGuard<'_, Listed> {
        self.listed.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// The address of a member.
    pub(crate) fn address(&self, array: &str, name: &str) -> Result<Address, OpenError> {
        match self.bindings.get(&member::path(array, name)) {
            Some(address) => Ok(address.clone()),
            None => parse(format!("{}/{name}", self.array_address(array))),
        }
    }

    /// Prefix of the default addresses of the members of an array.
    pub(crate) fn array_address(&self, array: &str) -> String {
        format!("{}/{array}", self.own)
    }

    /// Adds a member. Only the thread of the worker adds any.
    pub(crate) fn add(&self, array: usize, name: &str) -> Result<Member, MemberError> {
        let slot = &self.description.slots[array];
        let own = || (slot.name.to_owned(), name.to_owned());
        if self.is_complete.load(Ordering::Relaxed) {
            let (array, name) = own();
            return Err(MemberError::TooLate { array, name });
        }
        if let Err(reason) = member::check(name) {
            let (array, name) = own();
            let name = rc_diagnostics::foreign::clean(&name);
            return Err(MemberError::BadName {
                array,
                name,
                reason,
            });
        }
        let address = self.address(slot.name, name)?;
        let mut slots = self.slots.write().unwrap_or_else(PoisonError::into_inner);
        let members = slots.iter().filter(|open| open.described == array);
        let members: Vec<&Member> = members.filter_map(|open| open.member.as_ref()).collect();
        let same = members.iter().find(|m| m.name().eq_ignore_ascii_case(name));
        if let Some(same) = same {
            let (array, name) = own();
            let first = same.name().to_owned();
            return Err(MemberError::Taken { array, name, first });
        }
        if members.len() >= member::MOST {
            let (array, name) = own();
            return Err(MemberError::TooMany { array, name });
        }
        let member = Member::new(members.len(), slots.len(), name);
        let path = member::path(slot.name, name);
        slots.push(Arc::new(OpenSlot {
            described: array,
            slot,
            transports: chosen(&self.transports, &path, slot),
            name: Cow::Owned(path),
            member: Some(member.clone()),
            address: Some(address),
        }));
        Ok(member)
    }

    /// Removes the member that was added last: it could not be opened.
    pub(crate) fn remove_last(&self) {
        let mut slots = self.slots.write().unwrap_or_else(PoisonError::into_inner);
        if slots.len() > self.description.slots.len() {
            slots.pop();
        }
    }

    /// Ends the opening of members, and compares them with those that the network lists and binds.
    pub(crate) fn complete(&self) -> Result<(), StartError> {
        self.is_complete.store(true, Ordering::Relaxed);
        let all = self.all();
        let mut wrong = Vec::new();
        for (number, array) in self.description.slots.iter().enumerate() {
            if !array.is_array {
                continue;
            }
            let opened = all.iter().filter(|open| open.described == number);
            let opened = opened.filter_map(|open| Some(open.member.as_ref()?.name()));
            let opened: Vec<&str> = opened.collect();
            match self.lists().get(array.name) {
                Some(listed) => wrong.extend(difference(array.name, &opened, listed)),
                None => wrong.extend(self.unopened(array.name, &opened)),
            }
        }
        if wrong.is_empty() {
            return Ok(());
        }
        let name = self.description.name;
        let lines = wrong.iter().map(|line| format!("{name}: error: {line}\n"));
        Err(StartError::Configuration(lines.collect()))
    }

    /// Error text for bound members of an array that the worker has not opened.
    fn unopened(&self, array: &str, opened: &[&str]) -> Option<String> {
        let bound = self.bindings.keys().filter_map(|slot| member::split(slot));
        let bound = bound.filter(|(of, member)| *of == array && !opened.contains(member));
        let bound: Vec<&str> = bound.map(|(_, member)| member).collect();
        let listed = names(&bound);
        (!bound.is_empty()).then(|| {
            format!(
                "{listed} of the array `{array}` has an address, but the worker does not open it; it opens {}",
                names(opened)
            )
        })
    }
}

/// The middlewares that the network chooses for a slot, else that of its description.
fn chosen(transports: &Transports, name: &str, slot: &Slot) -> Vec<&'static str> {
    let chosen = transports.get(name).filter(|chosen| !chosen.is_empty());
    chosen.cloned().unwrap_or_else(|| vec![slot.backend])
}

/// Difference between the open members and those that the network lists.
fn difference(array: &str, opened: &[&str], listed: &[String]) -> Option<String> {
    let listed: BTreeSet<&str> = listed.iter().map(String::as_str).collect();
    let missing = listed.iter().filter(|name| !opened.contains(name));
    let missing: Vec<&str> = missing.copied().collect();
    let unlisted = opened.iter().filter(|name| !listed.contains(*name));
    let unlisted: Vec<&str> = unlisted.copied().collect();
    if missing.is_empty() && unlisted.is_empty() {
        return None;
    }
    let mut line = format!("the members of `{array}` are not those of the network");
    if !missing.is_empty() {
        let _ = write!(
            line,
            "; it lists {}, which the worker does not open",
            names(&missing)
        );
    }
    if !unlisted.is_empty() {
        let _ = write!(
            line,
            "; the worker opens {}, which it does not list",
            names(&unlisted)
        );
    }
    let quoted: Vec<String> = opened.iter().map(|name| format!("\"{name}\"")).collect();
    if quoted.is_empty() {
        let _ = write!(line, "; remove `{array}` from `slots` in the .ddsl");
    } else {
        let _ = write!(
            line,
            "; the .ddsl needs `slots {{ {array} {}; }}`",
            quoted.join(", ")
        );
    }
    Some(line)
}

/// Names for a message, at most eight.
fn names(all: &[&str]) -> String {
    const SHOWN: usize = 8;
    let mut shown: Vec<String> = all
        .iter()
        .take(SHOWN)
        .map(|name| format!("`{name}`"))
        .collect();
    if all.is_empty() {
        shown.push("none".to_owned());
    } else if all.len() > SHOWN {
        shown.push(format!("{} more", all.len() - SHOWN));
    }
    shown.join(", ")
}

fn parse(text: String) -> Result<Address, OpenError> {
    Address::parse(&text).map_err(|reason| OpenError::Backend {
        address: text,
        reason,
    })
}
