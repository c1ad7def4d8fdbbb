//! Stamps: times in messages that programs outside of a network copy from what they receive to what
//! they send. Messages are encoded as in DDS and ROS 2 (XCDR1, little endian).

use serde::{Deserialize, Serialize};

/// Where the stamp of a message is in its bytes.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Stamp {
    /// What is before it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub before: Vec<Skip>,
    /// Its form.
    pub of: StampOf,
}

/// Numbers of one size in the bytes of a message; a text has numbers of 1 byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Skip {
    /// The bytes of a number: 1, 2, 4 or 8.
    pub size: u8,
    /// How many there are, if it is not counted.
    pub count: u32,
    /// Whether their number stands before them.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub counted: bool,
}

/// The form of a stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StampOf {
    /// A number of 64 bits.
    Nanoseconds,
    /// Seconds and nanoseconds, of 32 bits each.
    Seconds,
}

impl Stamp {
    /// The stamp of a message, in nanoseconds. `None` if the message is too short.
    pub fn read(&self, body: &[u8]) -> Option<u64> {
        let mut at = 0;
        for skip in &self.before {
            let mut count = u64::from(skip.count);
            if skip.counted {
                count = word(body, &mut at, 4)?;
            }
            let size = u64::from(skip.size.max(1));
            if count > 0 {
                at = u64::next_multiple_of(at, size).checked_add(size.checked_mul(count)?)?;
            }
        }
        match self.of {
            StampOf::Nanoseconds => word(body, &mut at, 8),
            StampOf::Seconds => {
                let (seconds, rest) = (word(body, &mut at, 4)?, word(body, &mut at, 4)?);
                Some(seconds * 1_000_000_000 + rest)
            }
        }
    }
}

/// The number of `size` bytes, at most 8, at the next place for one.
fn word(body: &[u8], at: &mut u64, size: u64) -> Option<u64> {
    let begin = at.checked_next_multiple_of(size)?;
    let end = begin.checked_add(size)?;
    let range = usize::try_from(begin).ok()?..usize::try_from(end).ok()?;
    let bytes = body.get(range)?.iter().rev();
    *at = end;
    Some(bytes.fold(0, |number, byte| (number << 8) | u64::from(*byte)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_is_found_behind_texts_and_sequences() {
        let skip = |size, counted| Skip {
            size,
            count: 1,
            counted,
        };
        // A text "ab", a bool, two doubles in a sequence, then seconds and nanoseconds.
        let mut body = vec![3, 0, 0, 0, b'a', b'b', 0, 1, 2, 0, 0, 0, 0, 0, 0, 0];
        body.truncate(12);
        body.extend([0; 4]);
        body.extend([7; 16]);
        body.extend([5, 0, 0, 0, 9, 0, 0, 0]);
        let stamp = Stamp {
            before: vec![skip(1, true), skip(1, false), skip(8, true)],
            of: StampOf::Seconds,
        };
        assert_eq!(stamp.read(&body), Some(5_000_000_009));
        for length in 0..body.len() {
            assert_eq!(stamp.read(&body[..length]), None, "{length}");
        }
        let nanoseconds = Stamp {
            before: vec![skip(4, false)],
            of: StampOf::Nanoseconds,
        };
        let body = [1, 0, 0, 0, 9, 9, 9, 9, 2, 1, 0, 0, 0, 0, 0, 0];
        assert_eq!(nanoseconds.read(&body), Some(258));
        // A length that no message has.
        let body = [0xff; 32];
        let far = Stamp {
            before: vec![skip(8, true), skip(8, true)],
            ..nanoseconds
        };
        assert_eq!(far.read(&body), None);
    }
}
