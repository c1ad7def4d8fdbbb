//! The fakes of a slot array: one for each member.

use super::{Fake, TestBed};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// The fake peers of the members of a slot array, by their names. Its clones are the same peers.
pub struct FakeArray<F> {
    bed: TestBed,
    fakes: Rc<Fakes<F>>,
}

struct Fakes<F> {
    /// The number of the array.
    slot: usize,
    members: RefCell<BTreeMap<String, F>>,
    /// Functions that prepare each new member.
    prepare: RefCell<Vec<fn(&F)>>,
}

impl<F: Fake> Fakes<F> {
    fn member(&self, bed: &TestBed, name: &str) -> F {
        let known = self.members.borrow().get(name).cloned();
        known.unwrap_or_else(|| {
            let new = F::new(bed, self.slot, Some(name));
            for prepare in self.prepare.borrow().iter() {
                prepare(&new);
            }
            self.members
                .borrow_mut()
                .insert(name.to_owned(), new.clone());
            new
        })
    }
}

impl<F> Clone for FakeArray<F> {
    fn clone(&self) -> Self {
        Self {
            bed: self.bed.clone(),
            fakes: Rc::clone(&self.fakes),
        }
    }
}

impl<F: Fake> Fake for FakeArray<F> {
    /// The peers of the members of the array `slot`, which are made as soon as the worker opens
    /// them. A member is not an array.
    fn new(bed: &TestBed, slot: usize, _member: Option<&str>) -> Self {
        let fakes = Rc::new(Fakes {
            slot,
            members: RefCell::default(),
            prepare: RefCell::default(),
        });
        let made = Rc::clone(&fakes);
        bed.prepare_members(slot, move |bed, name| drop(made.member(bed, name)));
        Self {
            bed: bed.clone(),
            fakes,
        }
    }

    fn answer_defaults(&self) {
        Self::answer_defaults(self);
    }
}

impl<F: Fake> FakeArray<F> {
    /// Answers every query to a member that has no answer yet with default values.
    pub fn answer_defaults(&self) {
        self.each(F::answer_defaults);
    }

    /// The peer of a member. A test may prepare it before the worker opens the member.
    pub fn member(&self, name: &str) -> F {
        self.fakes.member(&self.bed, name)
    }

    /// Does this with the peer of each member, now and when the worker opens it.
    pub fn each(&self, prepare: fn(&F)) {
        self.fakes.prepare.borrow_mut().push(prepare);
        self.all().iter().for_each(prepare);
    }

    /// The peers of all members that the worker has opened, or that the test has asked for.
    pub fn all(&self) -> Vec<F> {
        self.fakes.members.borrow().values().cloned().collect()
    }
}
