//! The memory that a value may take.

use crate::error::ValueError;
use crate::value::Value;

/// How many times the length of its bytes a value may take in memory, besides [`ALLOWANCE`]. A
/// number in a structure takes one `Value`.
const FACTOR: usize = 64;
/// How many bytes every value may take.
const ALLOWANCE: usize = 16 << 20;

/// The bytes that a value may still take.
#[derive(Debug)]
pub(crate) struct Budget {
    left: usize,
    whole: usize,
}

impl Budget {
    /// For a value from this many bytes, of a message or of JSON.
    pub(crate) fn of(bytes: usize) -> Self {
        let whole = bytes.saturating_mul(FACTOR).saturating_add(ALLOWANCE);
        Self { left: whole, whole }
    }

    /// Accounts for memory before it is allocated.
    pub(crate) fn take(&mut self, count: usize, size: usize) -> Result<(), ValueError> {
        let taken = count.checked_mul(size);
        let Some(left) = taken.and_then(|taken| self.left.checked_sub(taken)) else {
            let most = self.whole >> 20;
            return Err(ValueError::new(format!(
                "the value takes more than {most} MiB of memory"
            )));
        };
        self.left = left;
        Ok(())
    }

    pub(crate) fn take_values(&mut self, count: usize) -> Result<(), ValueError> {
        self.take(count, size_of::<Value>())
    }
}
