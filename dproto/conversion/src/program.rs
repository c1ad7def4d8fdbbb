//! The flat program that converts the numbers of a message where they are.

mod layout;
mod numbers;
mod run;
mod steps;

use crate::fault::Fault;
use crate::item::Item;
use crate::moves::{Frame, Move, Needed, Transform};
use crate::number::Stored;
use crate::scratch::Scratch;
use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use steps::{Step, add};

/// Converts the numbers of a message. The bytes keep their places.
#[derive(Clone, Debug)]
pub struct Program {
    steps: Vec<Step>,
    /// The transforms that it takes.
    moves: Vec<Move>,
    /// Finds the values that these need, and converts nothing.
    looks: Option<Box<Program>>,
}

/// What a program did to a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunResult {
    /// The byte after the values.
    pub end: usize,
    /// Whether three turns that it wrote are at a gimbal lock: then the first one is 0.
    pub is_locked: bool,
}

impl Program {
    /// The program that converts these values.
    #[must_use]
    pub fn new(items: &[Item]) -> Self {
        let mut steps = Vec::new();
        add(&mut steps, items);
        Self {
            steps,
            moves: Vec::new(),
            looks: None,
        }
    }

    /// Adds the changes of frames to the program, whose formulas take transforms. `items` are those
    /// of the program.
    #[must_use]
    pub fn with_moves(mut self, moves: &[Move], items: &[Item]) -> Self {
        if !moves.is_empty() {
            let mut seen = Vec::new();
            looked_at(&mut seen, items);
            while seen
                .last()
                .is_some_and(|last| !matches!(last, Item::KeptNumber(..) | Item::KeptText))
            {
                seen.pop();
            }
            self.looks = Some(Box::new(Self::new(&seen)));
            self.moves = moves.to_vec();
        }
        self
    }

    /// Whether a message needs transforms: then [`Self::needed`] says which ones.
    #[must_use]
    pub fn takes_transforms(&self) -> bool {
        !self.moves.is_empty()
    }

    /// The transforms that a message needs, whose values begin at byte `at`. The bytes stay as they
    /// are.
    ///
    /// # Errors
    /// The message is too short, lacks the name of a frame, or has an invalid time.
    pub fn needed(&self, bytes: &mut [u8], at: usize) -> Result<Vec<Needed<'_>>, Fault> {
        let mut scratch = Scratch::default();
        if let Some(looks) = &self.looks {
            looks.steps(0..looks.steps.len(), bytes, at, &mut scratch)?;
        }
        let mut out = Vec::with_capacity(self.moves.len());
        for one in &self.moves {
            let from = match &one.from {
                Frame::Named(name) => name.clone(),
                Frame::Kept(at) => text(bytes, scratch.texts.get(*at as usize))?,
            };
            let mut time = 0_i128;
            for (number, unit) in &one.stamp {
                let place = scratch.numbers.get(*number as usize).copied();
                let (at, number) = place.ok_or(Fault::Value(at))?;
                let part = number.times(bytes, at, *unit).ok_or(Fault::Value(at))?;
                time = time.saturating_add(part);
            }
            let time = i64::try_from(time).map_err(|_| Fault::Value(at))?;
            let to = one.to.as_str();
            out.push(Needed { from, to, time });
        }
        Ok(out)
    }

    /// Converts a message as [`Self::run`] does, with the transforms that [`Self::needed`] asks for.
    ///
    /// # Errors
    /// As [`Self::run`]. An error also if a transform is missing.
    pub fn run_with(
        &self,
        bytes: &mut [u8],
        at: usize,
        transforms: &[Transform],
    ) -> Result<RunResult, Fault> {
        if transforms.len() != self.moves.len() {
            return Err(Fault::Value(at));
        }
        let (step, end) = self.begin(bytes, at)?;
        if step == self.steps.len() {
            return Ok(RunResult {
                end,
                is_locked: false,
            });
        }
        let mut scratch = Scratch::default();
        scratch.transforms.extend(transforms.iter().flatten());
        let end = self.steps(step..self.steps.len(), bytes, end, &mut scratch)?;
        Ok(RunResult {
            end,
            is_locked: scratch.is_locked || scratch.lanes.is_locked,
        })
    }

    /// Converts a message, whose values begin at byte `at`. Alignment counts from the start of
    /// `bytes`. NaN and infinite numbers stay as they are. Returns where the values end.
    ///
    /// # Errors
    /// The message is too short, or holds a number that its type cannot hold in the other unit.
    pub fn run(&self, bytes: &mut [u8], at: usize) -> Result<usize, Fault> {
        self.run_with(bytes, at, &[]).map(|ran| ran.end)
    }
}

/// Appends the values of a message as they are, without the groups around them.
fn looked_at(out: &mut Vec<Item>, items: &[Item]) {
    let below = |items: &[Item]| {
        let mut out = Vec::new();
        looked_at(&mut out, items);
        out
    };
    for item in items {
        out.push(match item {
            Item::Numbers(count, number, _) | Item::Marked(count, number) => {
                Item::Numbers(*count, *number, None)
            }
            Item::KeptNumber(number, _) => Item::KeptNumber(*number, None),
            Item::Group { items, .. } => {
                looked_at(out, items);
                continue;
            }
            Item::Sequence(items) => Item::Sequence(below(items)),
            Item::Array(count, items) => Item::Array(*count, below(items)),
            Item::Bounded {
                bound,
                padding,
                stride,
                items,
            } => Item::Bounded {
                bound: *bound,
                padding: *padding,
                stride: *stride,
                items: below(items),
            },
            other => other.clone(),
        });
    }
}

/// A text of a message, without the zero at its end.
fn text(bytes: &[u8], place: Option<&(usize, usize)>) -> Result<String, Fault> {
    let (at, length) = *place.ok_or(Fault::Value(0))?;
    let text = at.checked_add(length).and_then(|end| bytes.get(at..end));
    let text = text.map(|text| text.strip_suffix(&[0]).unwrap_or(text));
    let text = text.and_then(|text| core::str::from_utf8(text).ok());
    text.map(String::from).ok_or(Fault::Value(at))
}
