//! Formulas that only move and scale numbers, as those of other units and axes, without the steps of
//! an interpreter.

use crate::formula::{Formula, Operand, Operation, Step};
use alloc::vec::Vec;
use rc_vocabulary::Primitive;

/// The most numbers of a group that a kernel takes. They stand on the stack.
const MOST: usize = 16;

/// A formula in which each number is one number of the group times a factor.
#[derive(Clone, Debug)]
pub(crate) struct Kernel {
    /// The numbers that it reads, with their offsets.
    inputs: Vec<(usize, Float)>,
    /// What becomes of numbers.
    outputs: Vec<Output>,
    /// What must hold.
    norms: Vec<Norm>,
    /// Three neighbours of 4 bytes without conditions.
    triple: Option<Triple>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Float {
    Single,
    Double,
}

#[derive(Clone, Copy, Debug)]
struct Output {
    at: usize,
    number: Float,
    from: usize,
    scale: Scale,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    /// The number, or its opposite.
    Sign(f64),
    /// Times the first number, over the second one.
    Fraction(f64, f64),
}

/// The length of a vector of these inputs must be in a range.
#[derive(Clone, Debug)]
struct Norm {
    of: Vec<usize>,
    least: f64,
    most: f64,
}

#[derive(Clone, Copy, Debug)]
struct Triple {
    at: usize,
    from: [usize; 3],
    /// What all are multiplied with, and divided by.
    scale: (f64, f64),
    sign: [f32; 3],
}

impl Scale {
    #[inline]
    fn apply(self, value: f64) -> f64 {
        match self {
            Self::Sign(sign) => value * sign,
            Self::Fraction(numerator, denominator) => value * numerator / denominator,
        }
    }

    fn fraction(self) -> (f64, f64) {
        match self {
            Self::Sign(sign) => (sign, 1.0),
            Self::Fraction(numerator, denominator) => (numerator, denominator),
        }
    }
}

impl Kernel {
    /// The kernel of a formula over numbers at these offsets. `None` if it does more than move and
    /// scale floating-point numbers.
    pub(crate) fn new(formula: &Formula, marks: &[(usize, Primitive)]) -> Option<Self> {
        if marks.len() > MOST || marks.len() != formula.outputs.len() {
            return None;
        }
        let float = |number: Primitive| match number {
            Primitive::F32 => Some(Float::Single),
            Primitive::F64 => Some(Float::Double),
            _ => None,
        };
        let inputs = marks
            .iter()
            .map(|(at, number)| Some((*at, float(*number)?)));
        let inputs = inputs.collect::<Option<Vec<_>>>()?;
        let mut outputs = Vec::new();
        for (own, ((at, number), output)) in (0_u32..).zip(inputs.iter().zip(&formula.outputs)) {
            if *output == Operand::Input(own) {
                // It keeps its bits.
                continue;
            }
            let (from, scale, is_single) = scaled(formula, *output)?;
            if is_single && *number == Float::Double {
                return None;
            }
            outputs.push(Output {
                at: *at,
                number: *number,
                from,
                scale,
            });
        }
        let required = formula.steps.iter();
        let required = required.filter(|step| step.operation == Operation::Require);
        let norms = required.map(|step| norm(formula, step));
        let norms = norms.collect::<Option<Vec<_>>>()?;
        let triple = triple(&inputs, &outputs).filter(|_| norms.is_empty());
        Some(Self {
            inputs,
            outputs,
            norms,
            triple,
        })
    }

    /// Converts one element, unless a number is refused or not finite: then it stays as it is, and
    /// the result is `false`.
    #[inline]
    pub(crate) fn run(&self, element: &mut [u8]) -> bool {
        let mut values = [0.0; MOST];
        let mut is_finite = true;
        for (value, (at, number)) in values.iter_mut().zip(&self.inputs) {
            *value = read(element, *at, *number);
            is_finite &= value.is_finite();
        }
        for norm in &self.norms {
            let mut sum = 0.0;
            for (number, at) in norm.of.iter().enumerate() {
                let value = values.get(*at).copied().unwrap_or(f64::NAN);
                let square = value * value;
                sum = if number == 0 { square } else { sum + square };
            }
            is_finite &= (norm.least..=norm.most).contains(&libm::sqrt(sum));
        }
        let mut results = [0.0; MOST];
        for (result, output) in results.iter_mut().zip(&self.outputs) {
            let value = values.get(output.from).copied().unwrap_or(f64::NAN);
            *result = output.scale.apply(value);
            is_finite &= match output.number {
                #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
                Float::Single => (*result as f32).is_finite(),
                Float::Double => result.is_finite(),
            };
        }
        if is_finite {
            for (result, output) in results.iter().zip(&self.outputs) {
                write(element, output.at, output.number, *result);
            }
        }
        is_finite
    }

    /// Converts elements of `size` bytes that fill `bytes`, up to the first one that is refused, or
    /// the first block with one. Returns how many elements are converted.
    pub(crate) fn run_all(&self, bytes: &mut [u8], size: usize) -> usize {
        if let Some(triple) = &self.triple {
            return match size {
                12 if triple.at == 0 => triple.run_all::<12>(bytes),
                16 if triple.at <= 4 => triple.run_all::<16>(bytes),
                _ => self.each(bytes, size),
            };
        }
        self.each(bytes, size)
    }

    fn each(&self, bytes: &mut [u8], size: usize) -> usize {
        let mut done = 0;
        for element in bytes.chunks_exact_mut(size.max(1)) {
            if !self.run(element) {
                break;
            }
            done += 1;
        }
        done
    }
}

/// The elements of a block, whose numbers stay in the nearest cache.
const BLOCK: usize = 128;

impl Triple {
    fn run_all<const SIZE: usize>(&self, bytes: &mut [u8]) -> usize {
        let (elements, _) = bytes.as_chunks_mut::<SIZE>();
        match self.from {
            [0, 1, 2] => self.blocks::<SIZE, 0, 1, 2>(elements),
            [0, 2, 1] => self.blocks::<SIZE, 0, 2, 1>(elements),
            [1, 0, 2] => self.blocks::<SIZE, 1, 0, 2>(elements),
            [1, 2, 0] => self.blocks::<SIZE, 1, 2, 0>(elements),
            [2, 0, 1] => self.blocks::<SIZE, 2, 0, 1>(elements),
            [2, 1, 0] => self.blocks::<SIZE, 2, 1, 0>(elements),
            _ => 0,
        }
    }

    fn blocks<const SIZE: usize, const A: usize, const B: usize, const C: usize>(
        &self,
        elements: &mut [[u8; SIZE]],
    ) -> usize {
        let (numerator, denominator) = self.scale;
        let mut values = [[0.0_f32; 3]; BLOCK];
        let mut done = 0;
        // Passes without branches, of which the compiler makes vector instructions.
        for block in elements.chunks_mut(BLOCK) {
            for (values, element) in values.iter_mut().zip(block.iter()) {
                *values = self.numbers(element);
            }
            let mut is_finite = true;
            for value in values.as_flattened_mut() {
                #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
                let scaled = (f64::from(*value) * numerator / denominator) as f32;
                is_finite &= scaled.is_finite();
                *value = scaled;
            }
            if !is_finite {
                break;
            }
            for (values, element) in values.iter().zip(block.iter_mut()) {
                let moved = [values[A], values[B], values[C]];
                let (items, _) = element[self.at..].as_chunks_mut::<4>();
                for (item, (value, sign)) in items.iter_mut().zip(moved.iter().zip(self.sign)) {
                    *item = (value * sign).to_le_bytes();
                }
            }
            done += block.len();
        }
        done
    }

    #[inline]
    fn numbers<const SIZE: usize>(&self, element: &[u8; SIZE]) -> [f32; 3] {
        let (items, _) = element[self.at..].as_chunks::<4>();
        let mut numbers = [f32::NAN; 3];
        for (number, item) in numbers.iter_mut().zip(items) {
            *number = f32::from_le_bytes(*item);
        }
        numbers
    }
}

/// The three numbers of a kernel, if they are neighbours of 4 bytes that change places.
fn triple(inputs: &[(usize, Float)], outputs: &[Output]) -> Option<Triple> {
    let &[(at, _), (second, _), (third, _)] = inputs else {
        return None;
    };
    let are_single = inputs.iter().all(|(_, number)| *number == Float::Single);
    if !are_single || (second, third) != (at + 4, at + 8) {
        return None;
    }
    let mut triple = Triple {
        at,
        from: [0, 1, 2],
        scale: (1.0, 1.0),
        sign: [1.0; 3],
    };
    for (number, output) in outputs.iter().enumerate() {
        let own = (output.at - at) / 4;
        let (numerator, denominator) = output.scale.fraction();
        let scale = (numerator.abs(), denominator);
        if number > 0 && scale != triple.scale {
            return None;
        }
        triple.scale = scale;
        *triple.from.get_mut(own)? = output.from;
        *triple.sign.get_mut(own)? = if numerator < 0.0 { -1.0 } else { 1.0 };
    }
    // A number that stays would be scaled, too.
    let scales_all = outputs.len() == 3 || triple.scale == (1.0, 1.0);
    scales_all.then_some(triple)
}

/// The number of the group that an operand is a multiple of, with the factor, and whether it is
/// rounded to a `float32`.
fn scaled(formula: &Formula, operand: Operand) -> Option<(usize, Scale, bool)> {
    let (mut operand, mut sign, mut is_single) = (operand, 1.0, false);
    let (mut numerator, mut denominator) = (None, None);
    // From the result to the number: the conversions of units multiply, then divide.
    loop {
        let step = match operand {
            Operand::Input(at) => {
                let scale = match (numerator, denominator) {
                    (None, None) => Scale::Sign(sign),
                    (numerator, denominator) => {
                        Scale::Fraction(sign * numerator.unwrap_or(1.0), denominator.unwrap_or(1.0))
                    }
                };
                return Some((at as usize, scale, is_single));
            }
            Operand::Step(at) => formula.steps.get(at as usize)?,
            Operand::Constant(_) | Operand::Transform(_) => return None,
        };
        let constant = |at: usize| match step.operands.get(at) {
            Some(Operand::Constant(bits)) => Some(f64::from_bits(*bits)),
            _ => None,
        };
        match step.operation {
            Operation::Negate => sign = -sign,
            // Rounded before the factor, it would be another number.
            Operation::Single if numerator.is_none() && denominator.is_none() => is_single = true,
            Operation::Divide if numerator.is_none() && denominator.is_none() => {
                denominator = Some(constant(1)?);
            }
            Operation::Multiply if numerator.is_none() => numerator = Some(constant(1)?),
            _ => return None,
        }
        operand = *step.operands.first()?;
    }
}

/// The length that a step requires: the root of a sum of squares.
fn norm(formula: &Formula, required: &Step) -> Option<Norm> {
    let step = |operand: &Operand| match operand {
        Operand::Step(at) => formula.steps.get(*at as usize),
        _ => None,
    };
    let [length, Operand::Constant(least), Operand::Constant(most)] = required.operands[..] else {
        return None;
    };
    let root = step(&length).filter(|step| step.operation == Operation::Root)?;
    let mut of = Vec::new();
    let mut rest = step(root.operands.first()?)?;
    let square = |of: &Step| match of.operands[..] {
        [Operand::Input(one), Operand::Input(other)]
            if one == other && of.operation == Operation::Multiply =>
        {
            Some(one as usize)
        }
        _ => None,
    };
    // The sum is from left to right, so its last term is the outermost one.
    while rest.operation == Operation::Add {
        of.push(square(step(rest.operands.get(1)?)?)?);
        rest = step(rest.operands.first()?)?;
    }
    of.push(square(rest)?);
    of.reverse();
    Some(Norm {
        of,
        least: f64::from_bits(least),
        most: f64::from_bits(most),
    })
}

#[inline]
fn read(element: &[u8], at: usize, number: Float) -> f64 {
    let rest = element.get(at..).unwrap_or_default();
    match number {
        Float::Single => rest
            .first_chunk()
            .map_or(f64::NAN, |item| f64::from(f32::from_le_bytes(*item))),
        Float::Double => rest
            .first_chunk()
            .map_or(f64::NAN, |item| f64::from_le_bytes(*item)),
    }
}

#[inline]
fn write(element: &mut [u8], at: usize, number: Float, value: f64) {
    let rest = element.get_mut(at..).unwrap_or_default();
    match number {
        Float::Single => {
            if let Some(item) = rest.first_chunk_mut() {
                #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
                let single = value as f32;
                *item = single.to_le_bytes();
            }
        }
        Float::Double => {
            if let Some(item) = rest.first_chunk_mut() {
                *item = value.to_le_bytes();
            }
        }
    }
}
