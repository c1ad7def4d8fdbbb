//! Random numbers that are equal in each run.

use std::f64::consts::TAU;

/// Weyl constant of `SplitMix64` (Steele, Lea, Flood: Fast Splittable Pseudorandom Number
/// Generators, 2014).
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// Numbers by `SplitMix64`, and normal numbers from them by the method of Box and Muller.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
    /// The second number of a pair.
    spare: Option<f64>,
}

impl Random {
    /// The numbers for one purpose: a seed, the name of a sensor, the number of its frame. Equal
    /// arguments give equal numbers.
    pub fn new(seed: u64, name: &str, frame: u64) -> Self {
        // FNV-1a.
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for byte in name.bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        let mut mixed = Self {
            state: seed,
            spare: None,
        };
        mixed.state = mixed.next_u64() ^ hash;
        mixed.state = mixed.next_u64() ^ frame.wrapping_mul(GAMMA);
        mixed
    }

    /// Numbers for another purpose, which do not depend on how many of these are taken later.
    #[must_use]
    pub fn branch(&self) -> Self {
        let mut other = Self {
            state: self.state ^ GAMMA.rotate_left(32),
            spare: None,
        };
        other.state = other.next_u64();
        other
    }

    fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GAMMA);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 (excluded) to 1.
    pub fn unit(&mut self) -> f64 {
        ((self.next_u64() >> 11) + 1) as f64 / (1_u64 << 53) as f64
    }

    /// A normal number with mean 0 and standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let (u, v) = (self.unit(), self.unit());
        let radius = (-2.0 * u.ln()).sqrt();
        let (sin, cos) = (TAU * v).sin_cos();
        self.spare = Some(radius * sin);
        radius * cos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_numbers_are_those_of_the_reference_implementation() {
        let mut random = Random {
            state: 1_234_567,
            spare: None,
        };
        let first = [(); 3].map(|()| random.next_u64());
        let expected = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
        ];
        assert_eq!(first, expected);
    }

    #[test]
    fn names_frames_and_seeds_differ_and_repeat() {
        let first = |seed, name, frame| Random::new(seed, name, frame).normal().to_bits();
        assert_eq!(first(1, "a", 2), first(1, "a", 2));
        assert_ne!(first(1, "a", 2), first(2, "a", 2));
        assert_ne!(first(1, "a", 2), first(1, "b", 2));
        assert_ne!(first(1, "a", 2), first(1, "a", 3));
    }
}
