//! Numbers of one type in another unit.

use crate::number::Stored;
use rc_quantity::{Conversion, Factor};
use rc_vocabulary::Primitive;

/// Converts numbers of 4 bytes. Fails with the offset of the first one that does not fit.
pub(super) fn singles(bytes: &mut [u8], factor: &Factor) -> Result<(), usize> {
    match factor.fraction() {
        Some((numerator, denominator)) => {
            singles_by(bytes, |value| value * numerator / denominator)
        }
        None => singles_by(bytes, |value| factor.apply(value)),
    }
}

#[inline]
fn singles_by(bytes: &mut [u8], convert: impl Fn(f64) -> f64) -> Result<(), usize> {
    let (items, _) = bytes.as_chunks_mut::<4>();
    let mut overflows = false;
    // One pass without branches, which the compiler turns into vector instructions.
    for item in items.iter_mut() {
        let value = f32::from_le_bytes(*item);
        #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
        let converted = convert(f64::from(value)) as f32;
        overflows |= converted.is_infinite() & value.is_finite();
        *item = converted.to_le_bytes();
    }
    if !overflows {
        return Ok(());
    }
    let infinite = |item: &[u8; 4]| f32::from_le_bytes(*item).is_infinite();
    Err(items.iter().position(infinite).unwrap_or(0) * 4)
}

/// Converts numbers of 8 bytes. Fails as [`singles`].
pub(super) fn doubles(bytes: &mut [u8], factor: &Factor) -> Result<(), usize> {
    match factor.fraction() {
        Some((numerator, denominator)) => {
            doubles_by(bytes, |value| value * numerator / denominator)
        }
        None => doubles_by(bytes, |value| factor.apply(value)),
    }
}

#[inline]
fn doubles_by(bytes: &mut [u8], convert: impl Fn(f64) -> f64) -> Result<(), usize> {
    let (items, _) = bytes.as_chunks_mut::<8>();
    let mut overflows = false;
    for item in items.iter_mut() {
        let value = f64::from_le_bytes(*item);
        let converted = convert(value);
        overflows |= converted.is_infinite() & value.is_finite();
        *item = converted.to_le_bytes();
    }
    if !overflows {
        return Ok(());
    }
    let infinite = |item: &[u8; 8]| f64::from_le_bytes(*item).is_infinite();
    Err(items.iter().position(infinite).unwrap_or(0) * 8)
}

/// Converts integers. Fails with the offset of the first one that does not fit.
pub(super) fn integers(
    bytes: &mut [u8],
    number: Primitive,
    conversion: &Conversion,
) -> Result<(), usize> {
    let size = number.size();
    let (least, most) = number.whole_limits().unwrap_or_default();
    let is_signed = least < 0;
    for (index, item) in bytes.chunks_exact_mut(size).enumerate() {
        let mut wide = [0; 16];
        wide[..size].copy_from_slice(item);
        if is_signed && item[size - 1] >= 0x80 {
            wide[size..].fill(0xff);
        }
        let converted = conversion.apply_integer(i128::from_le_bytes(wide));
        let converted = converted.filter(|value| (least..=most).contains(value));
        let bytes = converted.ok_or(index * size)?.to_le_bytes();
        item.copy_from_slice(&bytes[..size]);
    }
    Ok(())
}
