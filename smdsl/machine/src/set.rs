//! A set of states: one bit each, in document order.

/// A set of numbers below a bound that is given once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Set(Box<[u64]>);

impl Set {
    /// An empty set for numbers below `bound`.
    pub fn new(bound: usize) -> Self {
        Self(vec![0; bound.div_ceil(64)].into_boxed_slice())
    }

    /// Adds a number.
    pub fn insert(&mut self, number: u16) {
        self.0[usize::from(number / 64)] |= 1 << (number % 64);
    }

    /// Removes a number.
    pub fn remove(&mut self, number: u16) {
        self.0[usize::from(number / 64)] &= !(1 << (number % 64));
    }

    /// Whether a number is in the set.
    pub fn contains(&self, number: u16) -> bool {
        self.0[usize::from(number / 64)] & (1 << (number % 64)) != 0
    }

    /// Whether no number is in the set.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|word| *word == 0)
    }

    /// Removes all numbers.
    pub fn clear(&mut self) {
        self.0.fill(0);
    }

    /// The smallest number that is not below `from`.
    pub fn next(&self, from: u16) -> Option<u16> {
        let mut at = usize::from(from / 64);
        let mut word = self.0.get(at)? & (u64::MAX << (from % 64));
        while word == 0 {
            at += 1;
            word = *self.0.get(at)?;
        }
        Some((at * 64) as u16 + word.trailing_zeros() as u16)
    }

    /// The largest number below `below`.
    pub fn previous(&self, below: u16) -> Option<u16> {
        let last = below.checked_sub(1)?;
        let mut at = usize::from(last / 64).min(self.0.len().checked_sub(1)?);
        let mask = if at == usize::from(last / 64) {
            u64::MAX >> (63 - last % 64)
        } else {
            u64::MAX
        };
        let mut word = self.0[at] & mask;
        while word == 0 {
            at = at.checked_sub(1)?;
            word = self.0[at];
        }
        Some((at * 64) as u16 + 63 - word.leading_zeros() as u16)
    }

    /// The numbers, in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = u16> + '_ {
        let mut next = 0;
        std::iter::from_fn(move || {
            let found = self.next(next)?;
            next = found + 1;
            Some(found)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_walked_both_ways() {
        let mut set = Set::new(200);
        for number in [0, 5, 63, 64, 130, 199] {
            set.insert(number);
        }
        set.remove(5);
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 63, 64, 130, 199]);
        let mut back = Vec::new();
        let mut below = 200;
        while let Some(found) = set.previous(below) {
            back.push(found);
            below = found;
        }
        assert_eq!(back, [199, 130, 64, 63, 0]);
        assert_eq!(set.previous(u16::MAX), Some(199));
        assert!(!set.contains(5) && set.contains(64));
        set.clear();
        assert!(set.is_empty());
        assert_eq!((set.next(0), set.previous(200)), (None, None));
    }
}
