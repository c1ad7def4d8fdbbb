//! Rows that were worked out by hand: what comes, how old it is then, and what the worker gets.

use super::*;
use rc_management::component::FreshnessStatus;
use rc_middleware::Writer;

/// One step of a row. Times are in milliseconds.
enum Step {
    /// A sample with this number comes at a time, and was made at another one: whether it is handled.
    Comes(i32, u64, u64, bool),
    /// The worker asks at a time: it gets a number, its age, what it is made of, and whether it is
    /// fresh.
    Gets(u64, i32, u64, Made, bool),
    /// The worker asks at a time, and the sample is so old.
    Refused(u64, u64),
    /// The worker asks, and there is none.
    None(u64),
}

use Made::{Cached, Computed};
use Step::{Comes, Gets, Refused};

const MS: u64 = 1_000_000;

struct Bench(Inputs, Limits, FreshCounts);

impl Bench {
    fn new(stale: Stale, fresh: u64) -> Self {
        let limits = Limits {
            topic: (3, 1),
            fresh: (fresh > 0).then(|| Duration::from_millis(fresh)),
            stale,
        };
        Self(Inputs::default(), limits, FreshCounts::default())
    }

    fn run(&mut self, row: usize, step: &Step) {
        let ask = |inputs: &mut Inputs, at: u64| {
            inputs.newest((3, 1), at * MS, |reader| {
                <i32 as rc_middleware::Cdr>::decode(reader)
            })
        };
        match *step {
            Comes(number, at, made, is_handled) => {
                let mut writer = Writer::default();
                writer.put(&number);
                let body = writer.into_bytes();
                let times = (made * MS, at * MS);
                let arrival = self
                    .0
                    .arrive(self.1, times, Encoding::Cdr, &Body::Borrowed(&body));
                assert_eq!(arrival.is_handled, is_handled, "row {row}");
                let age = Duration::from_millis(at.saturating_sub(made));
                assert_eq!(arrival.freshness.age, age, "row {row}");
                if let Some(counts) = arrival.new {
                    self.2 = counts;
                }
            }
            Gets(at, number, age, made, is_fresh) => {
                let freshness = Freshness {
                    age: Duration::from_millis(age),
                    made,
                    is_fresh,
                };
                let found = ask(&mut self.0, at);
                assert_eq!(found, Ok(Fresh::new(number, freshness)), "row {row}");
            }
            Refused(at, age) => {
                let age = Duration::from_millis(age);
                let found = ask(&mut self.0, at);
                assert_eq!(found, Err(CallError::Stale { age }), "row {row}");
            }
            Step::None(at) => {
                assert_eq!(ask(&mut self.0, at), Err(CallError::NoValue), "row {row}");
            }
        }
    }
}

/// Runs rows after each other over one slot.
fn run(stale: Stale, fresh: u64, rows: &[Step]) -> (usize, FreshCounts) {
    let mut bench = Bench::new(stale, fresh);
    for (row, step) in rows.iter().enumerate() {
        bench.run(row, step);
    }
    (rows.len(), bench.2)
}

#[test]
fn sixty_rows_by_hand() {
    let inform = [
        Step::None(0),
        Comes(1, 10, 10, true),
        Gets(10, 1, 0, Computed, true),
        Gets(10, 1, 0, Cached, true),
        Gets(60, 1, 50, Cached, true),
        Gets(110, 1, 100, Cached, true),
        Gets(111, 1, 101, Cached, false),
        Comes(2, 120, 115, true),
        Gets(120, 2, 5, Computed, true),
        Comes(3, 121, 121, true),
        Comes(4, 122, 122, true),
        Gets(122, 4, 0, Computed, true),
        // It was on its way for long.
        Comes(5, 400, 200, true),
        Gets(400, 5, 200, Computed, false),
        Gets(500, 5, 300, Cached, false),
        // Just fresh when it comes.
        Comes(6, 600, 500, true),
        Gets(600, 6, 100, Computed, true),
        Gets(601, 6, 101, Cached, false),
        // The clock of its sender is ahead.
        Comes(7, 700, 710, true),
        Gets(705, 7, 0, Computed, true),
        Gets(810, 7, 100, Cached, true),
        Gets(811, 7, 101, Cached, false),
        // The clock is set back: what was before would be fresh until 810.
        Step::None(650),
    ];
    let refuse = [
        Step::None(0),
        // The first one is too old.
        Comes(1, 210, 100, false),
        Refused(210, 110),
        Comes(2, 220, 215, true),
        Gets(220, 2, 5, Computed, true),
        Gets(315, 2, 100, Cached, true),
        Refused(316, 101),
        Refused(400, 185),
        Comes(3, 410, 310, true),
        Gets(410, 3, 100, Computed, true),
        Refused(411, 101),
        // An older one takes its place, and is refused.
        Comes(4, 420, 419, true),
        Comes(5, 430, 300, false),
        Refused(430, 130),
        Comes(6, 431, 431, true),
        Gets(432, 6, 1, Computed, true),
        Gets(433, 6, 2, Cached, true),
    ];
    let last = [
        Step::None(0),
        // Nothing fresh came yet: it is better than none.
        Comes(1, 210, 100, false),
        Gets(210, 1, 110, Computed, false),
        Comes(2, 220, 210, true),
        Gets(220, 2, 10, Computed, true),
        // It does not take the place of the last fresh one.
        Comes(3, 230, 100, false),
        Gets(230, 2, 20, Cached, true),
        // That one becomes old, and stays.
        Gets(311, 2, 101, Cached, false),
        Comes(4, 320, 219, false),
        Gets(320, 2, 110, Cached, false),
        Comes(5, 330, 230, true),
        Gets(330, 5, 100, Computed, true),
        Gets(900, 5, 670, Cached, false),
        Comes(6, 901, 901, true),
        Gets(901, 6, 0, Computed, true),
    ];
    // Without `fresh`, what is collected has no limit.
    let unlimited = [
        Comes(1, 10, 10, true),
        Gets(10, 1, 0, Computed, true),
        Gets(9_000_000, 1, 8_999_990, Cached, true),
        Comes(2, 9_000_001, 5, true),
        Gets(9_000_001, 2, 8_999_996, Computed, true),
    ];
    let rows = run(Stale::Inform, 100, &inform).0
        + run(Stale::Refuse, 100, &refuse).0
        + run(Stale::Last, 100, &last).0
        + run(Stale::Inform, 0, &unlimited).0;
    assert_eq!(rows, 60);
}

#[test]
fn the_status_has_the_four_metrics() {
    let rows = [
        Comes(1, 10, 10, true),
        Gets(20, 1, 10, Computed, true),
        Gets(120, 1, 110, Cached, false),
        Comes(2, 130, 130, true),
        Comes(3, 140, 140, true),
    ];
    let (_, counts) = run(Stale::Inform, 100, &rows);
    let status = counts.status(165 * MS);
    assert_eq!(
        status,
        FreshnessStatus {
            fresh_ms: Some(100.0),
            currency_ms: Some(25.0),
            obsolescence: 2,
            rate: Some(0.5),
            timeliness: Some(0.75),
            uses: 2,
            cached: 1,
            refused: 0,
            unmatched: 0,
        }
    );
    assert_eq!(counts.status(900 * MS).timeliness, Some(0.0));
    let none = FreshCounts::new(None).status(7);
    assert_eq!(
        (none.currency_ms, none.rate, none.timeliness),
        (None, None, None)
    );
}

#[test]
fn a_value_of_two_is_as_old_as_the_older_one() {
    let made = [
        (Computed, Computed, Computed),
        (Computed, Cached, Made::PartlyCached),
        (Cached, Computed, Made::PartlyCached),
        (Cached, Cached, Cached),
        (Made::PartlyCached, Computed, Made::PartlyCached),
        (Made::PartlyCached, Cached, Made::PartlyCached),
    ];
    for (one, other, expected) in made {
        let of = |made, age, is_fresh| Freshness {
            age: Duration::from_millis(age),
            made,
            is_fresh,
        };
        let both = Fresh::new(1, of(one, 5, true)).with(Fresh::new(2, of(other, 9, false)));
        assert_eq!(both, Fresh::new((1, 2), of(expected, 9, false)));
    }
}

#[test]
fn samples_without_a_match_are_counted_at_their_slot() {
    let collects = [Collect {
        name: "both",
        topics: &[(3, 0), (4, 0)],
        within: Duration::from_millis(1),
    }];
    let mut inputs = Inputs::default();
    let mut come = |place: usize, at: u64| {
        let topic = collects[0].topics[place];
        let limits = Limits {
            topic,
            fresh: None,
            stale: Stale::Inform,
        };
        let body = Body::Borrowed(&[]);
        let arrival = inputs.arrive(limits, (at * MS, at * MS), Encoding::Cdr, &body);
        let sample = Collected {
            at: at * MS,
            limit: None,
            refuses: false,
            freshness: arrival.freshness,
            sample: StoredSample::Bytes(Encoding::Cdr, Vec::new()),
        };
        let matched = inputs.collect(&collects, (0, place), 2, (sample, at * MS));
        (arrival.new, matched.is_some())
    };
    let scans = come(0, 10).0.expect("the counts of a slot");
    let poses = come(1, 20).0.expect("the counts of another slot");
    assert!(come(0, 20).1);
    // Two of the first topic wait, and the third one takes the place of the oldest one.
    for at in [30, 40, 50] {
        assert!(!come(0, at).1);
    }
    let unmatched = [scans, poses].map(|counts| counts.status(0).unmatched);
    assert_eq!(unmatched, [2, 0]);
}
