//! Random numbers that are equal on every machine.

use planar_map::libm;
use std::f64::consts::TAU;

/// Weyl constant of `SplitMix64` (Steele, Lea, Flood: Fast Splittable Pseudorandom Number
/// Generators, 2014).
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// `SplitMix64`, and normal numbers from it by the method of Box and Muller.
pub(crate) struct Noise {
    state: u64,
}

impl Noise {
    /// The noise of one step of a run; equal arguments give equal numbers.
    pub(crate) fn of_step(seed: i64, step: u64) -> Self {
        let mut mixed = Self {
            state: seed.cast_unsigned(),
        };
        let state = mixed.next_u64() ^ step.wrapping_mul(GAMMA);
        Self { state }
    }

    fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GAMMA);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 (excluded) to 1.
    fn unit(&mut self) -> f64 {
        ((self.next_u64() >> 11) + 1) as f64 / (1_u64 << 53) as f64
    }

    /// A normal number with mean 0 and standard deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        let (u, v) = (self.unit(), self.unit());
        (-2.0 * libm::log(u)).sqrt() * libm::cos(TAU * v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_numbers_are_those_of_the_reference_implementation() {
        let mut noise = Noise { state: 1_234_567 };
        let first = [(); 3].map(|()| noise.next_u64());
        assert_eq!(
            first,
            [
                6_457_827_717_110_365_317,
                3_203_168_211_198_807_973,
                9_817_491_932_198_370_423
            ]
        );
    }

    #[test]
    fn normal_numbers_have_the_mean_and_deviation_they_should() {
        let mut noise = Noise::of_step(1, 0);
        let count = 20_000;
        let numbers: Vec<f64> = (0..count).map(|_| noise.normal()).collect();
        let mean = numbers.iter().sum::<f64>() / f64::from(count);
        let variance = numbers.iter().map(|n| (n - mean).powi(2)).sum::<f64>() / f64::from(count);
        assert!(
            mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05,
            "{mean} {variance}"
        );
    }

    #[test]
    fn steps_and_seeds_differ_and_repeat() {
        let first = |seed, step| Noise::of_step(seed, step).normal().to_bits();
        assert_eq!(first(7, 3), first(7, 3));
        assert_ne!(first(7, 3), first(7, 4));
        assert_ne!(first(7, 3), first(8, 3));
    }
}
