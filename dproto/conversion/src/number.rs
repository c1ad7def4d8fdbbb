//! Numbers in memory: little endian, and aligned to their size.

use rc_vocabulary::{Class, Primitive};

/// Reads and writes numbers at a byte of a memory image, as `f64`. A `bool` is 0 or 1.
pub(crate) trait Stored: Copy {
    /// The number at a byte, as the nearest `f64`. NaN after the end.
    fn read(self, bytes: &[u8], at: usize) -> f64;

    /// Writes a number at a byte: a whole one if the type is one of integers. `false` if it does not
    /// fit.
    fn write(self, bytes: &mut [u8], at: usize, value: f64) -> bool;

    /// Whether a number of this type is finite after it was written.
    fn stores(self, value: f64) -> bool;

    /// This many times the number at a byte, rounded to a whole number. `None` after the end, or if
    /// it is not finite.
    fn times(self, bytes: &[u8], at: usize, factor: u32) -> Option<i128>;

    /// The least and the greatest whole number; of a type of floating-point numbers, none.
    fn whole_limits(self) -> Option<(i128, i128)>;
}

impl Stored for Primitive {
    fn read(self, bytes: &[u8], at: usize) -> f64 {
        let size = self.size();
        let Some(item) = bytes.get(at..).and_then(|rest| rest.get(..size)) else {
            return f64::NAN;
        };
        let mut word = [0; 8];
        word[..size].copy_from_slice(item);
        let bits = u64::from_le_bytes(word);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_possible_wrap,
            clippy::cast_precision_loss,
            reason = "the low bytes are the number, and above 2^53 the nearest f64 is meant"
        )]
        match self.class() {
            Class::Bool | Class::Unsigned => bits as f64,
            Class::Signed => {
                let unused = 64 - 8 * size;
                ((bits << unused) as i64 >> unused) as f64
            }
            Class::Float if size == 4 => f64::from(f32::from_bits(bits as u32)),
            Class::Float => f64::from_bits(bits),
        }
    }

    fn times(self, bytes: &[u8], at: usize, factor: u32) -> Option<i128> {
        let size = self.size();
        let item = bytes.get(at..)?.get(..size)?;
        let mut word = [0; 8];
        word[..size].copy_from_slice(item);
        let bits = u64::from_le_bytes(word);
        let unused = 64 - 8 * size;
        #[expect(
            clippy::cast_possible_wrap,
            clippy::cast_possible_truncation,
            reason = "the low bytes are the number"
        )]
        let whole = match self.class() {
            Class::Bool | Class::Unsigned => i128::from(bits),
            Class::Signed => i128::from((bits << unused) as i64 >> unused),
            Class::Float => {
                let product = self.read(bytes, at) * f64::from(factor);
                return product.is_finite().then(|| libm::round(product) as i128);
            }
        };
        whole.checked_mul(i128::from(factor))
    }

    fn write(self, bytes: &mut [u8], at: usize, value: f64) -> bool {
        let size = self.size();
        let Some(item) = bytes.get_mut(at..).and_then(|rest| rest.get_mut(..size)) else {
            return false;
        };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "compared with the limits, or rounded"
        )]
        let word = match self.whole_limits() {
            None if size == 4 => u64::from((value as f32).to_bits()),
            None => value.to_bits(),
            Some((least, most)) => {
                let whole = value as i128;
                if value.is_nan() || !(least..=most).contains(&whole) {
                    return false;
                }
                let mut word = [0; 8];
                word.copy_from_slice(&whole.to_le_bytes()[..8]);
                u64::from_le_bytes(word)
            }
        };
        item.copy_from_slice(&word.to_le_bytes()[..size]);
        true
    }

    #[inline]
    fn stores(self, value: f64) -> bool {
        if self.is_float() {
            return self.holds(value);
        }
        self.write(&mut [0; 8], 0, value)
    }

    fn whole_limits(self) -> Option<(i128, i128)> {
        match self.class() {
            Class::Bool => Some((0, 1)),
            Class::Signed | Class::Unsigned | Class::Float => self.limits(),
        }
    }
}
