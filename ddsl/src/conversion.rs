//! The conversion of a connection with `convert;`: its members, and the plan for the process of the
//! consumer.

pub use crate::converted::Converted;
use crate::end::End;
use crate::image::image_items;
use crate::meaning::Meanings;
use crate::moves::{MoveError, Moves};
use crate::pair::{Members, NoPlan, Pair};
use rc_conversion::{Frame, Item, Move, Part, Place, Plan};
use std::fmt;

/// The conversion of a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conversion {
    /// The members that are converted, in the order of the interface.
    pub members: Vec<Converted>,
    /// The plan that the consumer gets.
    pub plan: Plan,
    /// The slots of the consumer that know where frames are, with commas, if the plan needs them.
    pub tree: Option<String>,
}

impl fmt::Display for Conversion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, member) in self.members.iter().enumerate() {
            if at > 0 {
                f.write_str("; ")?;
            }
            write!(f, "{member}")?;
        }
        Ok(())
    }
}

impl Conversion {
    /// Whether something must know where frames are.
    pub fn needs_frames(&self) -> bool {
        self.plan.parts.iter().any(|part| !part.moves.is_empty())
    }
}

/// The most values in the plan of a connection.
const MOST: usize = 8192;

/// The plan of a connection whose types are equal and whose units convert.
pub(crate) fn plan(
    consumer: End<'_>,
    provider: End<'_>,
    meanings: &Meanings,
    moves: bool,
) -> Result<Conversion, NoPlan> {
    let mut out = Conversion {
        members: Vec::new(),
        plan: Plan::default(),
        tree: None,
    };
    let operations = |end: End<'_>| end.library.interface(end.interface).operations.len();
    for at in 0..operations(consumer).min(operations(provider)) {
        let mut parts = Vec::new();
        let mut left = MOST;
        let back = Pair {
            from: provider,
            to: consumer,
            meanings,
            moves,
        };
        // Requests travel to the provider, samples and replies to the consumer.
        let there = if consumer.subscribes {
            back
        } else {
            Pair {
                from: consumer,
                to: provider,
                meanings,
                moves,
            }
        };
        let ours = &consumer.library.interface(consumer.interface).operations[at];
        let theirs = &provider.library.interface(provider.interface).operations[at];
        let (sent, taken) = if consumer.subscribes {
            (theirs, ours)
        } else {
            (ours, theirs)
        };
        let path = ours.name.text.clone();
        let mut members = Members {
            out: &mut out.members,
            left: &mut left,
            marks: None,
            moves: Moves::default(),
        };
        let inputs = there.members(
            &path,
            (None, None),
            &sent.inputs,
            &taken.inputs,
            &mut members,
        )?;
        let own = std::mem::take(&mut members.moves);
        parts.push((Place::Input, own.into_moves(), inputs));
        if let (Some(one), Some(other)) = (
            sent.topic_in_place(there.from.library),
            taken.topic_in_place(there.to.library),
        ) {
            let chosen = there.chosen_in(&sent.inputs, &taken.inputs);
            let (moves, items) = image_items(&there, (one, other), chosen);
            let is_text = |change: &Move| matches!(change.from, Frame::Kept(_));
            if moves.iter().any(is_text) {
                let path = there.from.library.type_path(one);
                return Err(NoPlan::Move(path, MoveError::InPlace));
            }
            parts.push((Place::InputImage, moves, items));
        }
        if !consumer.subscribes {
            let mut outputs = back.members(
                &path,
                (None, None),
                &theirs.outputs,
                &ours.outputs,
                &mut members,
            )?;
            if let (Some(one), Some(other)) = (&theirs.result, &ours.result) {
                outputs.extend(back.values(one, other, None, "", (None, None), &mut members)?);
            }
            parts.push((Place::Output, Vec::new(), outputs));
            if let (Some(one), Some(other)) = (
                theirs.result_in_place(back.from.library),
                ours.result_in_place(back.to.library),
            ) {
                let chosen = back.chosen_in(&theirs.outputs, &ours.outputs);
                let (_, items) = image_items(&back, (one, other), chosen);
                parts.push((Place::OutputImage, Vec::new(), items));
            }
            for (number, (one, other)) in (0..).zip(theirs.throws.iter().zip(&ours.throws)) {
                let items = back.declared(*one, *other, (None, None), &mut members)?;
                parts.push((Place::Exception(number), Vec::new(), items));
            }
        }
        let operation = u32::try_from(at).unwrap_or(u32::MAX);
        out.plan
            .parts
            .extend(parts.into_iter().filter_map(|(place, moves, items)| {
                let items = merged(items);
                (!items.is_empty()).then_some(Part {
                    operation,
                    place,
                    moves,
                    items,
                })
            }));
    }
    let text = out.plan.to_string();
    let fits = out.plan.is_empty() || text.parse::<Plan>().is_ok();
    if fits { Ok(out) } else { Err(NoPlan::TooLarge) }
}

/// Joins adjacent numbers, and drops everything after the last number that is converted.
fn merged(items: Vec<Item>) -> Vec<Item> {
    let mut out = joined(items);
    while out.last().is_some_and(|last| !last.converts()) {
        out.pop();
    }
    out
}

fn joined(items: Vec<Item>) -> Vec<Item> {
    let mut out: Vec<Item> = Vec::new();
    for item in items {
        let item = match item {
            Item::Sequence(items) => Item::Sequence(joined(items)),
            Item::Array(count, items) => match joined(items).as_slice() {
                // An array of numbers is so many numbers.
                [Item::Numbers(1, number, conversion)] => {
                    Item::Numbers(count, *number, *conversion)
                }
                items => Item::Array(count, items.to_vec()),
            },
            Item::Bounded {
                bound,
                padding,
                stride,
                items,
            } => Item::Bounded {
                bound,
                padding,
                stride,
                items: joined(items),
            },
            Item::Group { items, formula } => Item::Group {
                items: joined(items),
                formula,
            },
            item @ (Item::Numbers(..)
            | Item::Marked(..)
            | Item::KeptNumber(..)
            | Item::KeptText
            | Item::Bytes(_)
            | Item::Text) => item,
        };
        if let (Some(Item::Marked(count, number)), Item::Marked(more, next)) =
            (out.last_mut(), &item)
            && number == next
            && let Some(sum) = count.checked_add(*more)
        {
            *count = sum;
            continue;
        }
        if let (
            Some(Item::Numbers(count, number, conversion)),
            Item::Numbers(more, next, following),
        ) = (out.last_mut(), &item)
            && (*number, *conversion) == (*next, *following)
            && let Some(sum) = count.checked_add(*more)
        {
            *count = sum;
            continue;
        }
        out.push(item);
    }
    out
}
