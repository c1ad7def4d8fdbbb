//! What `cargo xtask soak` and its two components agree on.
//!
//! Both say `counts NAME=NUMBER …` once a second and, as their last word, when they end. A number
//! says all since the start; see [`Counts`].

use std::collections::BTreeMap;
use std::io;
use std::time::Duration;

/// Between two ticks.
pub const TICK: Duration = Duration::from_millis(1);
/// A question is asked after so many ticks.
pub const TICKS_A_QUERY: u64 = 5;
/// Images of a second.
pub const IMAGES_A_SECOND: u64 = 30;
/// Ticks of a second.
pub const TICKS_A_SECOND: u64 = 1000;
/// In the first ticks the sink stands still once, until every queue has run over: from then on all
/// memory that can ever be in use is in use. What is lost so is not counted, and nothing is asked.
pub const WARM_UP_TICKS: u64 = 3000;
/// The same of images.
pub const WARM_UP_IMAGES: u64 = WARM_UP_TICKS * IMAGES_A_SECOND / TICKS_A_SECOND;
/// The tick at which the sink stands still.
pub const STALL_AT: u64 = 1000;
/// For how long: longer than the queues of ticks (100) and of images (10) last.
pub const STALL: Duration = Duration::from_millis(700);

/// Smallest and largest data of an image.
const IMAGE: (u64, u64) = (950_000, 1_050_000);
/// The pattern repeats after so many bytes, a prime: images with other numbers have other bytes.
const PERIOD: u64 = 251;

/// Where this variable is set, the source sends no images.
pub const WITHOUT_IMAGES: &str = "RC_SOAK_WITHOUT_IMAGES";
/// Where this variable is set, ticks are twice as far apart, and questions asked after twice as
/// many of them.
pub const HALF: &str = "RC_SOAK_HALF";

/// Whether an image is sent at this tick.
pub fn is_image_due(tick: u64) -> bool {
    let sent = |ticks: u64| ticks * IMAGES_A_SECOND / TICKS_A_SECOND;
    sent(tick + 1) > sent(tick)
}

/// All data that an image can have.
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
    /// Reads a line; none if it says anything else.
    pub fn read(line: &str) -> Option<Self> {
        let words = line.strip_prefix("counts")?.split_whitespace();
        let pairs = words.map(|word| {
            let (name, number) = word.split_once('=')?;
            Some((name.to_owned(), number.parse().ok()?))
        });
        pairs.collect::<Option<_>>().map(Self)
    }

    /// One number; 0 where it was not told.
    pub fn get(&self, name: &str) -> u64 {
        self.0.get(name).copied().unwrap_or_default()
    }
}

/// Says numbers with their names.
pub fn tell(counts: &[(&str, u64)]) -> io::Result<()> {
    let words: Vec<String> = counts
        .iter()
        .map(|(name, number)| format!(" {name}={number}"))
        .collect();
    crate::say(&format!("counts{}\n", words.concat()))
}

/// What is known of a topic whose values are numbered.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sequence {
    /// Values that came.
    pub came: u64,
    /// Numbers after the warm-up that never came: a later one did.
    pub lost: u64,
    /// Values that came twice or in another order.
    pub disordered: u64,
    next: u64,
}

impl Sequence {
    /// The number that is to come next.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Notes that `number` came; gaps below `warm_up` are not counted.
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
