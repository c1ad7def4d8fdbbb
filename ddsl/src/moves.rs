//! The changes of frames of a message: which of its members say in which frame values are, and when
//! they were measured.

use crate::meaning::{Change, FrameOf, Meaning};
use rc_conversion::{Frame, Item, Move};
use rc_idsl::Library;
use rc_idsl::model::{Member, Primitive, Type, TypeDeclKind, TypeId};
use rc_quantity::Unit;
use std::ptr;

/// The nanoseconds of the units that a time may have.
const UNITS: [(&str, u32); 4] = [
    ("s", 1_000_000_000),
    ("ms", 1_000_000),
    ("us", 1000),
    ("ns", 1),
];

/// Why a message has no change of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MoveError {
    /// The values repeat, each with a frame of its own.
    Repeated,
    /// The time is neither a number with a unit nor seconds with nanoseconds.
    Time,
    /// The frame is not a string.
    Frame,
    /// The frame is a string of a message that travels in place.
    InPlace,
    /// The time or the frame is in a sequence, or optional.
    Hidden,
}

/// A member whose value a change needs.
struct NeededMember {
    /// Its path in the message.
    path: String,
    change: usize,
    part: Part,
}

enum Part {
    Frame,
    /// A number of the time, with its nanoseconds.
    Time(u32),
}

/// The changes of frames that were found in a message.
#[derive(Default)]
pub(crate) struct Moves {
    all: Vec<Move>,
    wanted: Vec<NeededMember>,
    /// The changes of the structures around the place, by what these mean.
    open: Vec<(*const Meaning, u32)>,
    /// The path of the place in the message, with a dot at its end.
    path: String,
    /// How many texts and numbers were found.
    texts: u32,
    numbers: u32,
    /// The sequences, arrays and optional members around the place.
    loops: usize,
}

impl Moves {
    /// Enters the member of a structure, whose path has this length.
    pub(crate) fn enter(&mut self, start: usize, member: &str) {
        self.leave(start);
        self.path.push_str(member);
        self.path.push('.');
    }

    /// The length of the path.
    pub(crate) fn place(&self) -> usize {
        self.path.len()
    }

    pub(crate) fn leave(&mut self, start: usize) {
        self.path.truncate(start);
    }

    /// Enters values that repeat.
    pub(crate) fn repeat(&mut self) {
        self.loops += 1;
    }

    pub(crate) fn repeated(&mut self) {
        self.loops -= 1;
    }

    /// Adds the change of values that are part of the structure at the place. Returns its number.
    pub(crate) fn open(
        &mut self,
        (library, whole): (&Library, TypeId),
        (meaning, change): (&Meaning, &Change),
    ) -> Result<u32, MoveError> {
        if self.loops > 0 {
            return Err(MoveError::Repeated);
        }
        let number = self.all.len();
        let mut wanted = |path: String, part| {
            self.wanted.push(NeededMember {
                path: format!("{}{path}", self.path),
                change: number,
                part,
            });
        };
        for (path, unit) in time_of(library, whole, &change.stamp).ok_or(MoveError::Time)? {
            wanted(path, Part::Time(unit));
        }
        let from = match &change.from {
            FrameOf::Named(name) => Frame::Named(name.clone()),
            FrameOf::Member(path) => {
                let member = member(library, whole, path).ok_or(MoveError::Frame)?;
                if !matches!(library.resolved(&member.ty), Type::Text { .. }) {
                    return Err(MoveError::Frame);
                }
                wanted(path.clone(), Part::Frame);
                // Its place is known when the text is found.
                Frame::Kept(u32::MAX)
            }
        };
        self.all.push(Move {
            from,
            to: change.to.clone(),
            stamp: Vec::new(),
        });
        let number = u32::try_from(number).unwrap_or(u32::MAX);
        self.open.push((ptr::from_ref(meaning), number));
        Ok(number)
    }

    /// The change of values that mean this, in a structure around the place.
    pub(crate) fn known(&self, meaning: &Meaning) -> Option<u32> {
        let mut open = self.open.iter().rev();
        let found = open.find(|(of, _)| ptr::eq(*of, meaning));
        found.map(|(_, number)| *number)
    }

    /// How many changes are open.
    pub(crate) fn count(&self) -> usize {
        self.open.len()
    }

    /// Closes the changes of a structure except this many of those around it. Everything that they
    /// need must have been found.
    pub(crate) fn close(&mut self, count: usize) -> Result<(), MoveError> {
        self.open.truncate(count);
        if self.open.is_empty() && !self.wanted.is_empty() {
            return Err(MoveError::Hidden);
        }
        Ok(())
    }

    /// The item of the value at the place, if a change needs it.
    pub(crate) fn take(&mut self, value: &Type) -> Option<Item> {
        let path = self.path.strip_suffix('.')?;
        if self.loops > 0 || !self.wanted.iter().any(|wanted| wanted.path == path) {
            return None;
        }
        let (item, at) = match value {
            Type::Text { .. } => (Item::KeptText, &mut self.texts),
            Type::Primitive(number) => {
                (Item::KeptNumber(number.number()?, None), &mut self.numbers)
            }
            Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. }
            | Type::Named(_) => return None,
        };
        let own = *at;
        *at += 1;
        let all = &mut self.all;
        self.wanted.retain(|wanted| {
            let is_here = wanted.path == path;
            if let Some(change) = all.get_mut(wanted.change).filter(|_| is_here) {
                match wanted.part {
                    Part::Frame => change.from = Frame::Kept(own),
                    Part::Time(unit) => change.stamp.push((own, unit)),
                }
            }
            !is_here
        });
        Some(item)
    }

    /// The changes of the message.
    pub(crate) fn into_moves(self) -> Vec<Move> {
        self.all
    }
}

/// The member of a structure with this path.
fn member<'l>(library: &'l Library, whole: TypeId, path: &str) -> Option<&'l Member> {
    let (first, rest) = path
        .split_once('.')
        .map_or((path, None), |(first, rest)| (first, Some(rest)));
    let members = members(library, whole)?;
    let found = members.iter().find(|member| member.name.text == first)?;
    match (rest, library.resolved(&found.ty)) {
        (None, _) => Some(found),
        (Some(rest), Type::Named(inner)) => member(library, *inner, rest),
        _ => None,
    }
}

fn members(library: &Library, of: TypeId) -> Option<&[Member]> {
    match &library.ty(of).kind {
        TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => Some(members),
        TypeDeclKind::Enum(_) | TypeDeclKind::Alias(_) => None,
    }
}

/// The numbers of a time with their paths, each with its nanoseconds: one with a unit, or seconds and
/// nanoseconds.
fn time_of(library: &Library, whole: TypeId, path: &str) -> Option<Vec<(String, u32)>> {
    let found = member(library, whole, path)?;
    // A float32 has no room for the time of a clock.
    let is_number = |of: &Member| match library.resolved(&of.ty) {
        Type::Primitive(number) => number
            .number()
            .is_some_and(|own| !matches!(own, Primitive::Bool | Primitive::F32)),
        Type::Text { .. }
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. }
        | Type::Named(_) => false,
    };
    let has_unit = |of: &Member, text: &str| {
        let own = of.unit.as_deref().map(Unit::parse);
        own.is_none_or(|own| own.is_ok_and(|own| Unit::parse(text).is_ok_and(|of| of == own)))
    };
    if is_number(found) {
        let unit = Unit::parse(found.unit.as_deref()?).ok()?;
        let mut units = UNITS.iter();
        let known = units.find(|(text, _)| Unit::parse(text).is_ok_and(|of| of == unit))?;
        return Some(vec![(path.to_owned(), known.1)]);
    }
    let Type::Named(inner) = library.resolved(&found.ty) else {
        return None;
    };
    let [seconds, rest] = members(library, *inner)? else {
        return None;
    };
    let starts = |of: &Member, words: &[&str]| {
        let name = of.name.text.to_ascii_lowercase();
        is_number(of) && words.iter().any(|word| name.starts_with(word))
    };
    let is_time = starts(seconds, &["sec"])
        && has_unit(seconds, "s")
        && starts(rest, &["nanosec", "nsec"])
        && has_unit(rest, "ns");
    is_time.then(|| {
        [(seconds, UNITS[0].1), (rest, 1)]
            .map(|(of, unit)| (format!("{path}.{}", of.name.text), unit))
            .to_vec()
    })
}
