//! The conversion of the values of a sender into those of a receiver: the items of a plan.

use crate::converted::Converted;
use crate::end::End;
use crate::meaning::{Chosen, Meaning, Meanings, NotConverted, chosen, has_prefix, prototype};
use crate::moves::{MoveError, Moves};
use rc_conversion::Item;
use rc_idsl::Library;
use rc_idsl::model::{Member, Primitive, Type, TypeDeclKind, TypeId};
use rc_quantity::{Conversion as Factor, Unit};
use std::collections::HashSet;
use std::rc::Rc;

/// Why no plan can be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum NoPlan {
    /// The types have too many values, or are too deep.
    TooLarge,
    /// This type has a prototype with numbers at places that no plan has.
    Place(String),
    /// The frame or the time of values of this type is not where a plan can find it.
    Move(String, MoveError),
}

/// The conversion between the units of two members. `None` if their numbers are equal.
pub(crate) fn between(from: Option<&str>, to: Option<&str>) -> Option<Factor> {
    let (from, to) = (Unit::parse(from?).ok()?, Unit::parse(to?).ok()?);
    let factor = from.conversion_to(&to)?;
    (!factor.is_identity()).then_some(factor)
}

/// Sender and receiver.
#[derive(Clone, Copy)]
pub(crate) struct Pair<'a> {
    pub(crate) from: End<'a>,
    pub(crate) to: End<'a>,
    pub(crate) meanings: &'a Meanings,
    /// Whether something knows where frames are.
    pub(crate) moves: bool,
}

/// The prototypes that the sender and the receiver choose for a type.
pub(crate) type ChosenPair<'a> = (Chosen<'a>, Chosen<'a>);

/// The members that are found, and how many values the plan may still have.
pub(crate) struct Members<'o> {
    pub(crate) out: &'o mut Vec<Converted>,
    pub(crate) left: &'o mut usize,
    /// Marks of the structure that is converted as a whole.
    pub(crate) marks: Option<Marks>,
    pub(crate) moves: Moves,
}

/// The numbers of a structure that its formula converts, in the order of the message.
pub(crate) struct Marks {
    meaning: Known,
    found: Vec<String>,
    /// The path of the members that come next, with a dot.
    pub(crate) prefix: String,
}

/// The meanings of a structure at both ends.
#[derive(Clone)]
pub(crate) struct Known(Rc<Result<Meaning, NotConverted>>);

impl Known {
    pub(crate) fn get(&self) -> Option<&Meaning> {
        self.0.as_ref().as_ref().ok()
    }
}

impl Marks {
    pub(crate) fn new(meaning: Known) -> Self {
        Self {
            meaning,
            found: Vec::new(),
            prefix: String::new(),
        }
    }

    /// Whether the value at the prefix, or a part of it, belongs to the formula.
    pub(crate) fn has(&self) -> bool {
        self.meaning.get().is_some_and(|meaning| {
            let members = &meaning.members;
            members.contains(self.prefix.trim_end_matches('.')) || has_prefix(members, &self.prefix)
        })
    }

    /// Takes the number at the prefix, or the numbers of an array there.
    pub(crate) fn take(&mut self, array: Option<u32>) {
        let path = self.prefix.trim_end_matches('.');
        match array {
            None => self.found.push(path.to_owned()),
            Some(count) => {
                let all = (0..count).map(|at| format!("{path}.{at}"));
                self.found.extend(all);
            }
        }
    }

    /// The values with their formula, which takes the change of frames with this number. `None` if
    /// not all numbers were found.
    pub(crate) fn group(self, items: Vec<Item>, change: u32) -> Option<Item> {
        let meaning = self.meaning.get()?;
        let found: HashSet<&String> = self.found.iter().collect();
        let formula = meaning.formula(&self.found, change);
        let mut wanted = meaning.members.iter();
        wanted
            .all(|path| found.contains(path))
            .then_some(Item::Group { items, formula })
    }
}

impl<'a> Pair<'a> {
    /// The conversion of a structure. `None` if its members are converted by themselves.
    pub(crate) fn meaning(
        &self,
        from: TypeId,
        to: TypeId,
        chosen: ChosenPair<'a>,
    ) -> Option<Known> {
        let own = prototype(self.from, from, chosen.0).ok().flatten()?;
        let their = prototype(self.to, to, chosen.1).ok().flatten()?;
        let known = Known(
            self.meanings
                .of((self.from, own), (self.to, their), self.moves),
        );
        known.get().is_some().then_some(known)
    }

    /// The prototype that the only parameter chooses for its type.
    pub(crate) fn chosen_in(&self, from: &[Member], to: &[Member]) -> ChosenPair<'a> {
        let one = |end, members: &[Member]| chosen(end, None, members.first()?);
        (one(self.from, from), one(self.to, to))
    }

    pub(crate) fn members(
        &self,
        path: &str,
        whole: (Option<TypeId>, Option<TypeId>),
        from: &[Member],
        to: &[Member],
        found: &mut Members<'_>,
    ) -> Result<Vec<Item>, NoPlan> {
        let mut items = Vec::new();
        let start = found.marks.as_ref().map_or(0, |marks| marks.prefix.len());
        let place = found.moves.place();
        for (one, other) in from.iter().zip(to) {
            found.moves.enter(place, &one.name.text);
            let units = (one.unit.as_deref(), other.unit.as_deref());
            let factor = between(units.0, units.1).zip(units.0.zip(units.1));
            let path = format!("{path}.{}", one.name.text);
            if let Some(marks) = &mut found.marks {
                marks.prefix.truncate(start);
                marks.prefix.push_str(&one.name.text);
                marks.prefix.push('.');
            }
            let chosen = (
                chosen(self.from, whole.0, one),
                chosen(self.to, whole.1, other),
            );
            let values = if one.optional {
                let marks = found.marks.take();
                found.moves.repeat();
                let values = self.values(&one.ty, &other.ty, factor, &path, chosen, found)?;
                found.moves.repeated();
                found.marks = marks;
                vec![Item::Sequence(values)]
            } else {
                self.values(&one.ty, &other.ty, factor, &path, chosen, found)?
            };
            items.extend(values);
        }
        found.moves.leave(place);
        if let Some(marks) = &mut found.marks {
            marks.prefix.truncate(start);
        }
        Ok(items)
    }

    pub(crate) fn declared(
        &self,
        from: TypeId,
        to: TypeId,
        chosen: ChosenPair<'a>,
        found: &mut Members<'_>,
    ) -> Result<Vec<Item>, NoPlan> {
        let (
            TypeDeclKind::Struct(one) | TypeDeclKind::Exception(one),
            TypeDeclKind::Struct(other) | TypeDeclKind::Exception(other),
        ) = (
            &self.from.library.ty(from).kind,
            &self.to.library.ty(to).kind,
        )
        else {
            return Ok(vec![Item::Numbers(1, Primitive::I32, None)]);
        };
        let path = self.from.library.type_path(from);
        let whole = (Some(from), Some(to));
        // A part of a value belongs to the value.
        if found.marks.as_ref().is_some_and(Marks::has) {
            return self.members(&path, whole, one, other, found);
        }
        let outer = found.marks.take();
        let meaning = self.meaning(from, to, chosen);
        let no_move = |reason| NoPlan::Move(path.clone(), reason);
        let open = found.moves.count();
        let change = self.changes((from, to), (one, other), meaning.as_ref(), &mut found.moves);
        let change = change.map_err(no_move)?;
        found.marks = meaning.clone().map(Marks::new);
        let mut items = self.members(&path, whole, one, other, found)?;
        found.moves.close(open).map_err(no_move)?;
        let marks = std::mem::replace(&mut found.marks, outer);
        let (Some(marks), Some(meaning)) = (marks, meaning.as_ref().and_then(Known::get)) else {
            return Ok(items);
        };
        if meaning.is_identity {
            items.iter_mut().for_each(unmark);
            return Ok(items);
        }
        let converted = Converted::Meaning {
            path: path.clone(),
            what: meaning.what.clone(),
        };
        if !found.out.contains(&converted) {
            found.out.push(converted);
        }
        Ok(vec![marks.group(items, change).ok_or(NoPlan::Place(path))?])
    }

    /// Opens the changes of frames of a structure, and of the sequences in it whose frame or time it
    /// has. Returns the number of its own one.
    pub(crate) fn changes(
        &self,
        (from, to): (TypeId, TypeId),
        (one, other): (&[Member], &[Member]),
        own: Option<&Known>,
        moves: &mut Moves,
    ) -> Result<u32, MoveError> {
        if !self.moves {
            return Ok(0);
        }
        let library = self.from.library;
        for (one, other) in one.iter().zip(other) {
            let chosen = (
                chosen(self.from, Some(from), one),
                chosen(self.to, Some(to), other),
            );
            let (Some(one), Some(other)) = (
                element(library, &one.ty),
                element(self.to.library, &other.ty),
            ) else {
                continue;
            };
            let known = self.meaning(one, other, chosen);
            let meaning = known.as_ref().and_then(Known::get);
            if let Some((meaning, change)) = meaning.and_then(|of| Some((of, of.change.as_ref()?)))
                && change.of_sequence
            {
                moves.open((library, from), (meaning, change))?;
            }
        }
        let Some(meaning) = own.and_then(Known::get) else {
            return Ok(0);
        };
        match &meaning.change {
            None => Ok(0),
            Some(change) if change.of_sequence => moves.known(meaning).ok_or(MoveError::Hidden),
            Some(change) => moves.open((library, from), (meaning, change)),
        }
    }

    /// The values of a type. `factor` converts its own numbers, which `path` names: elements of
    /// sequences and arrays, and the values of a dictionary.
    pub(crate) fn values(
        &self,
        from: &Type,
        to: &Type,
        factor: Option<(Factor, (&str, &str))>,
        path: &str,
        chosen: ChosenPair<'a>,
        found: &mut Members<'_>,
    ) -> Result<Vec<Item>, NoPlan> {
        *found.left = found.left.checked_sub(1).ok_or(NoPlan::TooLarge)?;
        let (from, to) = (
            self.from.library.resolved(from),
            self.to.library.resolved(to),
        );
        let kept = found.moves.take(from);
        if let Some(item) = kept.clone().filter(|_| factor.is_none()) {
            return Ok(vec![item]);
        }
        if let Some(marks) = found.marks.as_mut().filter(|marks| marks.has())
            && let Some((array, number)) = numbers(self.from.library, from)
        {
            // An array may have 2^32 numbers: they are counted before any of them is named.
            let further = array.unwrap_or(1).saturating_sub(1);
            let left = usize::try_from(further).ok();
            let left = left.and_then(|further| found.left.checked_sub(further));
            *found.left = left.ok_or(NoPlan::TooLarge)?;
            marks.take(array);
            return Ok(vec![Item::Marked(array.unwrap_or(1), number)]);
        }
        Ok(match (from, to) {
            (Type::Primitive(number), _) => {
                let own = number.number().unwrap_or(Primitive::U8);
                let Some((factor, (unit, wanted))) = factor.filter(|_| number.number().is_some())
                else {
                    return Ok(vec![Item::Numbers(1, own, None)]);
                };
                let converted = Converted::Unit {
                    path: path.to_owned(),
                    from: unit.to_owned(),
                    to: wanted.to_owned(),
                    factor,
                    number: *number,
                };
                // A structure that occurs twice is listed once.
                if !found.out.contains(&converted) {
                    found.out.push(converted);
                }
                // A change of frames reads the time before it is converted.
                vec![match kept {
                    Some(_) => Item::KeptNumber(own, Some(factor)),
                    None => Item::Numbers(1, own, Some(factor)),
                }]
            }
            (Type::Named(one), Type::Named(other)) => self.declared(*one, *other, chosen, found)?,
            (from, to) => {
                // Their number is known only at run time, so none of them belong to the formula
                // around them.
                let marks = found.marks.take();
                found.moves.repeat();
                let items = self.several(from, to, (factor, path), chosen, found)?;
                found.moves.repeated();
                found.marks = marks;
                items
            }
        })
    }

    fn several(
        &self,
        from: &Type,
        to: &Type,
        (factor, path): (Option<(Factor, (&str, &str))>, &str),
        chosen: ChosenPair<'a>,
        found: &mut Members<'_>,
    ) -> Result<Vec<Item>, NoPlan> {
        Ok(match (from, to) {
            (Type::Sequence { element: one, .. }, Type::Sequence { element: other, .. }) => {
                vec![Item::Sequence(
                    self.values(one, other, factor, path, chosen, found)?,
                )]
            }
            (
                Type::Array {
                    element: one,
                    length: count,
                },
                Type::Array { element: other, .. },
            ) => {
                let items = self.values(one, other, factor, path, chosen, found)?;
                vec![Item::Array(*count, items)]
            }
            (
                Type::Dictionary { key, value },
                Type::Dictionary {
                    key: other_key,
                    value: other_value,
                },
            ) => {
                let mut items = self.values(key, other_key, None, path, (None, None), found)?;
                items.extend(self.values(value, other_value, factor, path, chosen, found)?);
                vec![Item::Sequence(items)]
            }
            // Texts. Pairs of different forms were reported before.
            (
                Type::Text { .. }
                | Type::Primitive(_)
                | Type::Sequence { .. }
                | Type::Array { .. }
                | Type::Dictionary { .. }
                | Type::Named(_),
                _,
            ) => vec![Item::Text],
        })
    }
}

/// The type of the elements of a sequence or an array of structures.
fn element(library: &Library, ty: &Type) -> Option<TypeId> {
    match library.resolved(ty) {
        Type::Sequence { element, .. } | Type::Array { element, .. } => {
            match library.resolved(element) {
                Type::Named(id) => Some(*id),
                Type::Primitive(_)
                | Type::Text { .. }
                | Type::Sequence { .. }
                | Type::Array { .. }
                | Type::Dictionary { .. } => None,
            }
        }
        Type::Primitive(_) | Type::Text { .. } | Type::Dictionary { .. } | Type::Named(_) => None,
    }
}

/// A number, or an array of so many numbers.
pub(crate) fn numbers(library: &Library, ty: &Type) -> Option<(Option<u32>, Primitive)> {
    match ty {
        Type::Primitive(number) => Some((None, number.number()?)),
        Type::Array {
            element,
            length: count,
        } => match library.resolved(element) {
            Type::Primitive(number) => Some((Some(*count), number.number()?)),
            Type::Text { .. }
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. }
            | Type::Named(_) => None,
        },
        Type::Text { .. } | Type::Sequence { .. } | Type::Dictionary { .. } | Type::Named(_) => {
            None
        }
    }
}

/// Numbers that stay as they are, because both ends mean the same.
pub(crate) fn unmark(item: &mut Item) {
    if let Item::Marked(count, number) = item {
        *item = Item::Numbers(*count, *number, None);
    }
}
