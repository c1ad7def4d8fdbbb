//! The protocol and the constants that `cargo xtask soak` shares with its two components.
//!
//! Both print `counts NAME=NUMBER …` once a second and at their end. Numbers count from the start;
//! see [`Counts`].

use std::collections::BTreeMap;
use std::io;
use std::time::Duration;

/// The period of ticks.
pub const TICK: Duration = Duration::from_millis(1);
/// The data of a tick: with its number and the length, a sample has 64 bytes.
pub const TICK_BYTES: usize = 48;
/// The number of ticks between two queries.
pub const TICKS_A_QUERY: u64 = 5;
/// Images a second.
pub const IMAGES_A_SECOND: u64 = 30;
/// Ticks a second.
pub const TICKS_A_SECOND: u64 = 1000;
/// The ticks of the warm-up. The sink blocks once until every queue has overflowed, so that all
/// memory is in use afterwards. Losses in the warm-up are not counted, and there are no queries.
pub const WARM_UP_TICKS: u64 = 3000;
/// The images of the warm-up.
pub const WARM_UP_IMAGES: u64 = WARM_UP_TICKS * IMAGES_A_SECOND / TICKS_A_SECOND;
/// The tick at which the sink blocks.
pub const STALL_AT: u64 = 1000;
/// The duration of blocking: longer than the queues of ticks (100) and of images (10) last.
pub const STALL: Duration = Duration::from_millis(700);

/// The smallest and the largest size of an image, in bytes.
const IMAGE: (u64, u64) = (950_000, 1_050_000);
/// The period of the pattern in bytes: a prime, so that images differ from each other.
const PERIOD: u64 = 251;

/// If this variable is set, the source sends no images.
pub const WITHOUT_IMAGES: &str = "RC_SOAK_WITHOUT_IMAGES";
/// If this variable is set, the period of ticks doubles, and so does the number of ticks between
/// two queries.
pub const HALF: &str = "RC_SOAK_HALF";

/// Whether an image is sent at this tick.
pub fn is_image_due(tick: u64) -> bool {
    let sent = |ticks: u64| ticks * IMAGES_A_SECOND / TICKS_A_SECOND;
    sent(tick + 1) > sent(tick)
}

/// The bytes of which each image is a part.
pub fn pattern() -> Vec<u8> {
    let length = IMAGE.1 + PERIOD;
    (0..length).map(|at| (at % PERIOD) as u8).collect()
}

/// The data of the image `number`, a part of `pattern`. Its length differs from image to image; the
/// first is the longest, so that the memory has grown to its size before the warm-up is over.
pub fn image(pattern: &[u8], number: u64) -> &[u8] {
    let start = number % PERIOD;
    let length = IMAGE.1 - number * 7919 % (IMAGE.1 - IMAGE.0);
    pattern
        .get(start as usize..(start + length) as usize)
        .unwrap_or_default()
}

/// Numbers with names, as one line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts(BTreeMap<String, u64>);

impl Counts {
    /// Parses a line; `None` if it is not a line of counts.
    pub fn read(line: &str) -> Option<Self> {
        let words = line.strip_prefix("counts")?.split_whitespace();
        let pairs = words.map(|word| {
            let (name, number) = word.split_once('=')?;
            Some((name.to_owned(), number.parse().ok()?))
        });
        pairs.collect::<Option<_>>().map(Self)
    }

    /// One number; 0 if it is missing.
    pub fn get(&self, name: &str) -> u64 {
        self.0.get(name).copied().unwrap_or_default()
    }
}

/// Prints numbers with their names.
pub fn print(counts: &[(&str, u64)]) -> io::Result<()> {
    let words: Vec<String> = counts
        .iter()
        .map(|(name, number)| format!(" {name}={number}"))
        .collect();
    crate::print_line(&format!("counts{}\n", words.concat()))
}

/// Counts losses of a topic with numbered values.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sequence {
    /// Received values.
    pub came: u64,
    /// Lost values after the warm-up.
    pub lost: u64,
    /// Values that were received twice, or out of order.
    pub disordered: u64,
    next: u64,
}

impl Sequence {
    /// The next expected number.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Records the value `number`. Gaps below `warm_up` are not counted.
    pub fn note(&mut self, number: u64, warm_up: u64) {
        self.came += 1;
        if number < self.next {
            self.disordered += 1;
            return;
        }
        self.lost += number.saturating_sub(self.next.max(warm_up));
        self.next = number + 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirty_images_a_second() {
        let due = (0..TICKS_A_SECOND * 10).filter(|tick| is_image_due(*tick));
        assert_eq!(due.count(), 300);
    }

    #[test]
    fn images_differ_from_their_neighbours() {
        let pattern = pattern();
        for number in [0, 250, 251, 12_345_678] {
            let data = image(&pattern, number);
            assert!(data.len() as u64 >= IMAGE.0, "{}", data.len());
            assert_ne!(data, image(&pattern, number + 1));
        }
    }

    #[test]
    fn gaps_are_counted_after_the_warm_up() {
        let mut ticks = Sequence::default();
        for number in [0, 1, 5, 12, 13, 13, 20] {
            ticks.note(number, 10);
        }
        assert_eq!((ticks.came, ticks.lost, ticks.disordered), (7, 8, 1));
    }

    #[test]
    fn counts_are_read() {
        let counts = Counts::read("counts ticks=5 lost=0").expect("counts");
        assert_eq!((counts.get("ticks"), counts.get("lost")), (5, 0));
        assert!(Counts::read("counts ticks=many").is_none());
    }
}
