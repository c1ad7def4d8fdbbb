//! Three neighbours of 4 bytes that change places and are scaled, as the coordinates of points.

use super::scaled::{Scale, is_finite_single, single_below};

/// The elements of a block, which is converted as a whole. It stays in the nearest cache.
const BLOCK: usize = 128;

#[derive(Clone, Copy, Debug)]
pub(super) struct Triple {
    /// The offset of the first number.
    at: usize,
    from: [usize; 3],
    /// The factor and divisor of each result.
    scales: [Scale; 3],
    /// These scales, if a `float32` computed with them has the bits of a rounded `float64`.
    singles: Option<Singles>,
    /// The greatest amount from which all results are finite.
    limit: f32,
}

/// The common divisor, or factor, of all three results.
#[derive(Clone, Copy, Debug)]
enum Singles {
    Over([f32; 3]),
    Times([f32; 3]),
}

/// A number in a message.
type Word = [u8; 4];

impl Triple {
    /// The results of three numbers: of which one each is made, and how.
    pub(super) fn new(at: usize, outputs: &[(usize, Scale)]) -> Option<Self> {
        let [(x, of_x), (y, of_y), (z, of_z)] = outputs else {
            return None;
        };
        let scales = [*of_x, *of_y, *of_z];
        let limits = scales.map(|scale| single_below(scale.limit(is_finite_single)));
        Some(Self {
            at,
            from: [*x, *y, *z],
            scales,
            singles: singles(scales),
            limit: limits.into_iter().fold(f32::MAX, f32::min),
        })
    }

    /// Converts elements of `size` bytes that fill `bytes`, up to the first block with a number that
    /// is not finite before or after. Returns how many are converted.
    pub(super) fn run_all(&self, bytes: &mut [u8], size: usize) -> usize {
        let Some(singles) = self.singles.filter(|_| self.at == 0) else {
            return self.apart(bytes, size);
        };
        match self.from {
            [0, 1, 2] => self.sized::<0, 1, 2>(singles, bytes, size),
            [0, 2, 1] => self.sized::<0, 2, 1>(singles, bytes, size),
            [1, 0, 2] => self.sized::<1, 0, 2>(singles, bytes, size),
            [1, 2, 0] => self.sized::<1, 2, 0>(singles, bytes, size),
            [2, 0, 1] => self.sized::<2, 0, 1>(singles, bytes, size),
            [2, 1, 0] => self.sized::<2, 1, 0>(singles, bytes, size),
            // A number that has two results.
            _ => self.apart(bytes, size),
        }
    }

    #[inline]
    fn sized<const A: usize, const B: usize, const C: usize>(
        &self,
        singles: Singles,
        bytes: &mut [u8],
        size: usize,
    ) -> usize {
        match (singles, size) {
            (Singles::Over([x, y, z]), 12) => {
                self.packed::<3>(bytes, |of| [of[A] / x, of[B] / y, of[C] / z])
            }
            (Singles::Over([x, y, z]), 16) => {
                self.packed::<4>(bytes, |of| [of[A] / x, of[B] / y, of[C] / z])
            }
            (Singles::Times([x, y, z]), 12) => {
                self.packed::<3>(bytes, |of| [of[A] * x, of[B] * y, of[C] * z])
            }
            (Singles::Times([x, y, z]), 16) => {
                self.packed::<4>(bytes, |of| [of[A] * x, of[B] * y, of[C] * z])
            }
            _ => self.apart(bytes, size),
        }
    }

    /// Elements of so many words, of which the first three are the numbers. All places are constants:
    /// so the compiler makes vector instructions.
    #[inline]
    fn packed<const WORDS: usize>(
        &self,
        bytes: &mut [u8],
        scaled: impl Fn([f32; 3]) -> [f32; 3],
    ) -> usize {
        let (elements, _) = bytes.as_chunks_mut::<4>().0.as_chunks_mut::<WORDS>();
        let mut done = 0;
        for block in elements.chunks_mut(BLOCK) {
            let holds = if WORDS == 3 {
                self.holds(block.as_flattened())
            } else {
                let each = block.iter();
                each.fold(true, |holds, words| holds & self.holds(&words[..3]))
            };
            if !holds {
                break;
            }
            for words in block.iter_mut() {
                let mut all = *words;
                let numbers = [all[0], all[1], all[2]].map(f32::from_le_bytes);
                [all[0], all[1], all[2]] = scaled(numbers).map(f32::to_le_bytes);
                *words = all;
            }
            done += block.len();
        }
        done
    }

    /// Elements of any size.
    fn apart(&self, bytes: &mut [u8], size: usize) -> usize {
        let size = size.max(1);
        let mut done = 0;
        for block in bytes.chunks_mut(BLOCK * size) {
            let holds = block.chunks_exact(size).fold(true, |holds, element| {
                holds & self.holds(element[self.at..][..12].as_chunks().0)
            });
            if !holds {
                break;
            }
            for element in block.chunks_exact_mut(size) {
                let (words, _) = element[self.at..].as_chunks_mut();
                if let Some(words) = words.first_chunk_mut::<3>() {
                    let numbers = words.map(|word| f64::from(f32::from_le_bytes(word)));
                    for ((word, from), by) in words.iter_mut().zip(self.from).zip(self.scales) {
                        #[expect(
                            clippy::cast_possible_truncation,
                            reason = "rounded to the nearest"
                        )]
                        let result = (numbers[from % 3] * by.0 / by.1) as f32;
                        *word = result.to_le_bytes();
                    }
                }
            }
            done += block.len() / size;
        }
        done
    }

    /// Whether all numbers are finite, and all results.
    #[inline]
    fn holds(&self, numbers: &[Word]) -> bool {
        let mut holds = true;
        for number in numbers {
            holds &= f32::from_le_bytes(*number).abs() <= self.limit;
        }
        holds
    }
}

/// The scales as `float32`, if the results have the same bits.
fn singles(scales: [Scale; 3]) -> Option<Singles> {
    #[expect(clippy::cast_possible_truncation, reason = "a `float32`")]
    let single = |of: fn(Scale) -> f64| scales.map(|scale| of(scale) as f32);
    if !scales.iter().all(|scale| scale.is_single()) {
        None
    } else if scales.iter().all(|scale| scale.0.abs() == 1.0) {
        Some(Singles::Over(single(|scale| scale.0 * scale.1)))
    } else if scales.iter().all(|scale| scale.1 == 1.0) {
        Some(Singles::Times(single(|scale| scale.0)))
    } else {
        None
    }
}
