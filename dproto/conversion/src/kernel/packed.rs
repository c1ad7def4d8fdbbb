//! A few neighbours of one type that change places and are scaled, as the numbers of a pose.

use super::norm::Norm;
use super::scaled::{Scale, is_finite_single, single_below};
use alloc::vec::Vec;
use core::ops::{Div, Mul};

/// A number in a message, as it is computed.
pub(super) trait Number: Copy + Mul<Output = Self> + Div<Output = Self> {
    /// Its bytes in the message.
    const SIZE: usize;
    fn read(item: &[u8]) -> Self;
    fn write(self, item: &mut [u8]);
    fn is_at_most(self, limit: Self) -> bool;
    fn wide(self) -> f64;
    fn of(constant: f64) -> Self;
    /// Whether a result is finite in the message.
    fn is_finite(result: f64) -> bool;
    /// The greatest number that is not above this one.
    fn below(limit: f64) -> Self;
}

/// A `float32` that is computed as a `float64`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wide(f64);

/// From `HALF` to `2 * HALF` numbers of a group. They are read and written as the first `HALF` and
/// the last `HALF`, which may overlap: so both have a fixed size, and stay in registers.
#[derive(Clone, Debug)]
pub(super) struct Packed<T, const HALF: usize> {
    /// The bytes of the first one and of the last `HALF` in the element.
    at: (usize, usize),
    /// The numbers of both halves: of which one each result is made.
    from: [[u8; HALF]; 2],
    numerators: [[T; HALF]; 2],
    denominators: [[T; HALF]; 2],
    /// The greatest amount of each number.
    limits: [[T; HALF]; 2],
    /// The conditions.
    norms: Vec<Norm>,
}

impl<T: Number, const HALF: usize> Packed<T, HALF> {
    /// The results of as many numbers: of which one each is made, and how.
    pub(super) fn new(at: usize, outputs: &[(usize, Scale)], mut norms: Vec<Norm>) -> Self {
        let back = outputs.len().saturating_sub(HALF);
        norms
            .iter_mut()
            .for_each(|norm| norm.placed(|number| place(number, HALF, back)));
        let all = placed(outputs, HALF, T::is_finite);
        let one = |half: usize, at: usize| all.get(half * HALF + at).copied().unwrap_or_default();
        let each =
            |of: fn(&Place) -> T| [0, 1].map(|half| core::array::from_fn(|at| of(&one(half, at))));
        Self {
            at: (at, at + back * T::SIZE),
            from: [0, 1].map(|half| core::array::from_fn(|at| one(half, at).from)),
            numerators: each(|place| T::of(place.scale.0)),
            denominators: each(|place| T::of(place.scale.1)),
            limits: each(|place| T::below(place.limit)),
            norms,
        }
    }

    // In one piece of code for single groups and for many.
    #[inline(never)]
    pub(super) fn run(&self, element: &mut [u8]) -> bool {
        let (first, last) = self.at;
        let size = HALF * T::SIZE;
        let (Some(begin), Some(end)) = (
            element.get(first..first + size),
            element.get(last..last + size),
        ) else {
            return false;
        };
        let mut values = [[T::of(0.0); HALF]; 2];
        for (values, half) in values.iter_mut().zip([begin, end]) {
            for (value, item) in values.iter_mut().zip(half.chunks_exact(T::SIZE)) {
                *value = T::read(item);
            }
        }
        let mut holds = true;
        let all = values.as_flattened();
        for (value, limit) in all.iter().zip(self.limits.as_flattened()) {
            holds &= value.is_at_most(*limit);
        }
        let value = |at: usize| all[at % (2 * HALF)];
        for norm in &self.norms {
            holds &= norm.holds(|at| value(at).wide());
        }
        if !holds {
            return false;
        }
        for half in 0..2 {
            let at = if half == 0 { first } else { last };
            let Some(bytes) = element.get_mut(at..at + size) else {
                return false;
            };
            let scales = self.numerators[half].iter().zip(&self.denominators[half]);
            let items = bytes.chunks_exact_mut(T::SIZE);
            for ((from, item), (numerator, denominator)) in
                self.from[half].iter().zip(items).zip(scales)
            {
                (value(usize::from(*from)) * *numerator / *denominator).write(item);
            }
        }
        true
    }
}

/// A number in one of both halves.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    from: u8,
    scale: Scale,
    limit: f64,
}

/// Where a number is in both halves, of which the second one begins at number `back`.
fn place(number: usize, half: usize, back: usize) -> usize {
    if number < half {
        number
    } else {
        half + number - back
    }
}

/// The numbers of both halves.
fn placed(outputs: &[(usize, Scale)], half: usize, is_finite: fn(f64) -> bool) -> Vec<Place> {
    let back = outputs.len().saturating_sub(half);
    let numbers = (0..half).chain(back..outputs.len());
    let places = numbers.map(|number| {
        let (from, scale) = outputs.get(number).copied().unwrap_or_default();
        let results = outputs.iter().filter(|(from, _)| *from == number);
        let limits = results.map(|(_, scale)| scale.limit(is_finite));
        #[expect(clippy::cast_possible_truncation, reason = "below 8")]
        Place {
            from: place(from, half, back) as u8,
            scale,
            limit: limits.fold(Scale::default().limit(is_finite), f64::min),
        }
    });
    places.collect()
}

impl Number for f32 {
    const SIZE: usize = 4;

    #[inline]
    fn read(item: &[u8]) -> Self {
        item.try_into().map_or(Self::NAN, Self::from_le_bytes)
    }

    #[inline]
    fn write(self, item: &mut [u8]) {
        item.copy_from_slice(&self.to_le_bytes());
    }

    #[inline]
    fn is_at_most(self, limit: Self) -> bool {
        self.abs() <= limit
    }

    #[inline]
    fn wide(self) -> f64 {
        f64::from(self)
    }

    #[expect(clippy::cast_possible_truncation, reason = "a `float32`")]
    fn of(constant: f64) -> Self {
        constant as Self
    }

    fn is_finite(result: f64) -> bool {
        is_finite_single(result)
    }

    fn below(limit: f64) -> Self {
        single_below(limit)
    }
}

impl Number for Wide {
    const SIZE: usize = 4;

    #[inline]
    fn read(item: &[u8]) -> Self {
        Self(f32::read(item).wide())
    }

    #[inline]
    fn write(self, item: &mut [u8]) {
        #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
        (self.0 as f32).write(item);
    }

    #[inline]
    fn is_at_most(self, limit: Self) -> bool {
        self.0.abs() <= limit.0
    }

    #[inline]
    fn wide(self) -> f64 {
        self.0
    }

    fn of(constant: f64) -> Self {
        Self(constant)
    }

    fn is_finite(result: f64) -> bool {
        is_finite_single(result)
    }

    fn below(limit: f64) -> Self {
        Self(limit)
    }
}

impl Mul for Wide {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl Div for Wide {
    type Output = Self;

    #[inline]
    fn div(self, other: Self) -> Self {
        Self(self.0 / other.0)
    }
}

impl Number for f64 {
    const SIZE: usize = 8;

    #[inline]
    fn read(item: &[u8]) -> Self {
        item.try_into().map_or(Self::NAN, Self::from_le_bytes)
    }

    #[inline]
    fn write(self, item: &mut [u8]) {
        item.copy_from_slice(&self.to_le_bytes());
    }

    #[inline]
    fn is_at_most(self, limit: Self) -> bool {
        self.abs() <= limit
    }

    #[inline]
    fn wide(self) -> f64 {
        self
    }

    fn of(constant: f64) -> Self {
        constant
    }

    fn is_finite(result: f64) -> bool {
        Self::is_finite(result)
    }

    fn below(limit: f64) -> Self {
        limit
    }
}
