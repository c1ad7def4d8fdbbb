//! Formulas over many elements of one layout: each operation runs over a block of elements before
//! the next one begins, so that the compiler turns it into vector instructions.

use crate::formula::{Formula, Operand, Operation};
use crate::number::Stored;
use alloc::vec::Vec;
use rc_quantity::rotation::LOCKED;
use rc_vocabulary::Primitive;

/// The elements of a block. Its values stay in the nearest cache.
const WIDTH: usize = 64;

/// One number of each element of a block.
type Lane = [f64; WIDTH];

/// The numbers of an element that a formula takes and gives.
#[derive(Clone, Debug, Default)]
pub(crate) struct Marks(pub(crate) Vec<(usize, Primitive)>);

/// The values of a block, kept from block to block: constants, inputs, then those of the steps.
#[derive(Default)]
pub(crate) struct Lanes {
    values: Vec<Lane>,
    /// Where the first input is.
    inputs: usize,
    /// Where the operands of each step are. One that an operation does not have is the first value.
    places: Vec<[usize; 4]>,
    /// Whether an element of any block was at a gimbal lock.
    pub(crate) is_locked: bool,
}

impl Lanes {
    /// Converts elements of `size` bytes that fill `bytes`, up to the first block with a number that
    /// the formula refuses or that its type cannot hold. That block stays as it is. Returns how many
    /// elements are converted.
    pub(crate) fn run(
        &mut self,
        (formula, transforms): (&Formula, &[f64]),
        marks: &Marks,
        bytes: &mut [u8],
        size: usize,
    ) -> usize {
        if size == 0 || marks.0.len() != formula.outputs.len() {
            return 0;
        }
        self.prepare(formula, transforms, marks.0.len());
        let mut done = 0;
        for block in bytes.chunks_mut(WIDTH * size) {
            let length = block.len() / size;
            let is_whole = self.load(marks, block, size)
                && self.compute(formula, marks.0.len(), length)
                && self.store((formula, transforms), marks, block, size);
            if !is_whole {
                break;
            }
            self.note_locks((formula, transforms), marks.0.len(), length);
            done += length;
        }
        done
    }

    /// Notes whether an element of a block is at a gimbal lock.
    fn note_locks(
        &mut self,
        (formula, transforms): (&Formula, &[f64]),
        inputs: usize,
        length: usize,
    ) {
        for lock in &formula.locks {
            let place = match lock {
                Operand::Input(at) => Some(self.inputs + *at as usize),
                Operand::Step(at) => Some(self.inputs + inputs + *at as usize),
                Operand::Constant(_) | Operand::Transform(_) => None,
            };
            self.is_locked |= match place {
                Some(place) => self.values.get(place).is_some_and(|lane| {
                    let mut values = lane.iter().take(length);
                    values.any(|value| *value < LOCKED)
                }),
                None => constant(lock, transforms).is_some_and(|value| value < LOCKED),
            };
        }
    }

    /// Lays out the values of a formula. Constants are as wide as the rest, in place of a branch for
    /// each element.
    fn prepare(&mut self, formula: &Formula, transforms: &[f64], inputs: usize) {
        let operands = || formula.steps.iter().flat_map(|step| &step.operands);
        let constants = operands().filter_map(|operand| constant(operand, transforms));
        self.values.clear();
        self.values.push([0.0; WIDTH]);
        self.values.extend(constants.map(|value| [value; WIDTH]));
        self.inputs = self.values.len();
        let all = self.inputs + inputs + formula.steps.len();
        self.values.resize(all, [0.0; WIDTH]);
        self.places.clear();
        let mut next = 1;
        for step in &formula.steps {
            let mut places = [0; 4];
            for (place, operand) in places.iter_mut().zip(&step.operands) {
                *place = match operand {
                    Operand::Input(at) => self.inputs + *at as usize,
                    Operand::Step(at) => self.inputs + inputs + *at as usize,
                    Operand::Constant(_) | Operand::Transform(_) => {
                        next += 1;
                        next - 1
                    }
                };
            }
            self.places.push(places);
        }
    }

    /// Reads the inputs of a block. `false` if a number is not finite: single steps know what
    /// becomes of these.
    fn load(&mut self, marks: &Marks, block: &[u8], size: usize) -> bool {
        let mut is_finite = true;
        let lanes = self.values.iter_mut().skip(self.inputs);
        for (lane, (at, number)) in lanes.zip(&marks.0) {
            let elements = block.chunks_exact(size);
            match number {
                Primitive::F32 => {
                    for (value, element) in lane.iter_mut().zip(elements) {
                        let bits = element
                            .get(*at..at + 4)
                            .and_then(|item| item.try_into().ok());
                        *value = f64::from(f32::from_le_bytes(bits.unwrap_or([0xff; 4])));
                        is_finite &= value.is_finite();
                    }
                }
                number => {
                    for (value, element) in lane.iter_mut().zip(elements) {
                        *value = number.read(element, *at);
                        is_finite &= value.is_finite();
                    }
                }
            }
        }
        is_finite
    }

    /// Computes all steps. `false` if a number is not in its range.
    fn compute(&mut self, formula: &Formula, inputs: usize, length: usize) -> bool {
        let first = self.inputs + inputs;
        for (at, (step, places)) in formula.steps.iter().zip(&self.places).enumerate() {
            let Some((known, rest)) = self.values.split_at_mut_checked(first + at) else {
                return false;
            };
            let places = places.map(|place| known.get(place));
            let ([Some(a), Some(b), Some(c), Some(d)], Some(out)) = (places, rest.first_mut())
            else {
                return false;
            };
            match step.operation {
                Operation::Negate => each(out, a, b, |a, _| -a),
                Operation::Add => each(out, a, b, |a, b| a + b),
                Operation::Subtract => each(out, a, b, |a, b| a - b),
                Operation::Multiply => each(out, a, b, |a, b| a * b),
                Operation::Divide => each(out, a, b, |a, b| a / b),
                #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
                Operation::Single => each(out, a, b, |a, _| f64::from(a as f32)),
                other => {
                    for at in 0..length.min(WIDTH) {
                        match other.apply([a[at], b[at], c[at], d[at]]) {
                            Some(value) => out[at] = value,
                            None => return false,
                        }
                    }
                }
            }
        }
        true
    }

    /// Writes the outputs of a block, if all of them fit.
    fn store(
        &self,
        (formula, transforms): (&Formula, &[f64]),
        marks: &Marks,
        block: &mut [u8],
        size: usize,
    ) -> bool {
        let steps = self.inputs + marks.0.len();
        let lane = |output: &Operand| match output {
            Operand::Input(at) => self.values.get(self.inputs + *at as usize).copied(),
            Operand::Step(at) => self.values.get(steps + *at as usize).copied(),
            Operand::Constant(_) | Operand::Transform(_) => {
                constant(output, transforms).map(|value| [value; WIDTH])
            }
        };
        let length = block.len() / size;
        let outputs = || {
            let all = (0_u32..).zip(formula.outputs.iter().zip(&marks.0));
            // A number that is its own output keeps its bits.
            all.filter(|(own, (output, _))| **output != Operand::Input(*own))
                .map(|(_, pair)| pair)
        };
        for (output, (_, number)) in outputs() {
            let Some(lane) = lane(output) else {
                return false;
            };
            if !lane.iter().take(length).all(|value| number.stores(*value)) {
                return false;
            }
        }
        for (output, (at, number)) in outputs() {
            let Some(lane) = lane(output) else {
                return false;
            };
            let elements = block.chunks_exact_mut(size);
            match number {
                Primitive::F32 => {
                    for (value, element) in lane.iter().zip(elements) {
                        if let Some(item) = element.get_mut(*at..at + 4) {
                            #[expect(
                                clippy::cast_possible_truncation,
                                reason = "rounded to the nearest"
                            )]
                            item.copy_from_slice(&(*value as f32).to_le_bytes());
                        }
                    }
                }
                number => {
                    for (value, element) in lane.iter().zip(elements) {
                        number.write(element, *at, *value);
                    }
                }
            }
        }
        true
    }
}

/// The operand that all elements share.
fn constant(operand: &Operand, transforms: &[f64]) -> Option<f64> {
    match operand {
        Operand::Constant(bits) => Some(f64::from_bits(*bits)),
        Operand::Transform(at) => Some(transforms.get(*at as usize).copied().unwrap_or(f64::NAN)),
        Operand::Input(_) | Operand::Step(_) => None,
    }
}

#[inline]
fn each(out: &mut Lane, a: &Lane, b: &Lane, of: impl Fn(f64, f64) -> f64) {
    for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out = of(*a, *b);
    }
}
