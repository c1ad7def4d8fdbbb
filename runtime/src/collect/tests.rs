use super::*;
use rc_middleware::Encoding;
use rc_middleware::freshness::Made;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

fn sample(at: u64, length: usize) -> Collected {
    Collected {
        at,
        limit: None,
        refuses: false,
        freshness: Freshness {
            age: Duration::ZERO,
            made: Made::Computed,
            is_fresh: true,
        },
        sample: StoredSample::Bytes(Encoding::Cdr, vec![0; length]),
    }
}

fn collector(within: u64, depths: &[usize]) -> Collector {
    let mut collector = Collector::new(Duration::from_nanos(within), depths.len());
    for (topic, depth) in depths.iter().enumerate() {
        collector.set_depth(topic, *depth);
    }
    collector
}

/// The times of what matches, in the order of the topics.
fn run(within: u64, depths: &[usize], arrivals: &[(usize, u64)]) -> Vec<Vec<u64>> {
    let mut collector = collector(within, depths);
    let matches = arrivals.iter();
    let matches = matches.filter_map(|(topic, at)| collector.add(*topic, sample(*at, 1)));
    matches
        .map(|all| all.iter().map(|sample| sample.at).collect())
        .collect()
}

#[test]
fn a_sample_is_matched_with_the_nearest_one_and_used_once() {
    let arrivals = [(0, 10), (0, 18), (1, 20), (1, 22), (0, 21)];
    assert_eq!(run(5, &[9, 9], &arrivals), [[18, 20], [21, 22]]);
}

#[test]
fn what_is_just_near_enough_matches() {
    assert_eq!(run(5, &[9, 9], &[(0, 10), (1, 15)]), [[10, 15]]);
    assert!(run(4, &[9, 9], &[(0, 10), (1, 15)]).is_empty());
    assert_eq!(run(0, &[9, 9], &[(0, 10), (1, 11), (1, 10)]), [[10, 10]]);
}

#[test]
fn the_first_and_the_last_of_all_are_near_enough() {
    // 8 and 14 are each near 11, and not near each other.
    let arrivals = [(0, 8), (1, 14), (2, 11), (1, 12)];
    assert_eq!(run(4, &[9, 9, 9], &arrivals), [[8, 12, 11]]);
    // The nearest one of the second topic leaves nothing to the third, so a further one is taken.
    let arrivals = [(1, 98), (1, 103), (2, 107), (0, 100)];
    assert_eq!(run(8, &[9, 9, 9], &arrivals), [[100, 103, 107]]);
}

#[test]
fn the_oldest_samples_leave_full_queues() {
    let arrivals = [(0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (1, 3)];
    assert_eq!(run(0, &[2, 9], &arrivals), [[2, 2], [3, 3]]);
    let mut collector = collector(0, &[9, 9]);
    collector.most_bytes = 100;
    for at in 0..5 {
        collector.add(0, sample(at, 40));
    }
    assert_eq!(
        (collector.bytes, collector.dropped.iter().sum::<u64>()),
        (80, 3)
    );
    assert!(collector.add(1, sample(3, 10)).is_some());
    assert_eq!(collector.bytes, 40);
    // One that is larger than the bound does not stay.
    collector.add(1, sample(9, 101));
    assert_eq!(
        (collector.bytes, collector.dropped.iter().sum::<u64>()),
        (0, 5)
    );
}

#[test]
fn a_sample_of_the_same_time_replaces_the_earlier_one() {
    let mut collector = collector(0, &[9, 9]);
    collector.add(0, sample(7, 1));
    collector.add(0, sample(7, 2));
    let found = collector.add(1, sample(7, 3)).expect("a match");
    assert_eq!(
        found.iter().map(|s| s.sample.size()).collect::<Vec<_>>(),
        [2, 3]
    );
    assert_eq!(
        (collector.bytes, collector.dropped.iter().sum::<u64>()),
        (0, 1)
    );
}

#[test]
fn a_clock_that_is_set_back_leaves_no_samples_of_the_future() {
    const SECOND: u64 = 1_000_000_000;
    let mut collector = collector(10, &[2, 2]);
    for at in [9 * SECOND, 9 * SECOND + 50] {
        assert!(collector.add(0, sample(at, 1)).is_none());
    }
    // The queue is full. One that comes out of order leaves as the oldest one.
    assert!(collector.add(0, sample(8 * SECOND + 1, 1)).is_none());
    assert!(collector.add(1, sample(8 * SECOND + 1, 1)).is_none());
    assert!(collector.add(0, sample(3 * SECOND, 1)).is_none());
    assert!(collector.add(1, sample(3 * SECOND + 10, 1)).is_some());
    assert_eq!(collector.bytes, 0);
    collector.add(0, sample(7, 1));
    collector.clear();
    assert_eq!(collector.bytes, 0);
    assert!(collector.add(1, sample(7, 1)).is_none());
}

#[test]
fn samples_that_become_too_old_are_not_collected_if_their_slot_refuses_them() {
    for (refuses, now, matches) in [(true, 30, true), (true, 31, false), (false, 31, true)] {
        let mut collector = collector(90, &[9, 9]);
        let waits = Collected {
            limit: Some(Duration::from_nanos(20)),
            refuses,
            ..sample(10, 1)
        };
        collector.add(0, waits);
        collector.expire(now);
        let found = collector.add(1, sample(now, 1));
        assert_eq!(found.is_some(), matches, "{refuses} {now}");
    }
}

/// All combinations in the order of an odometer, as `message_filters` tries them.
fn by_force(queues: &[Vec<u64>], topic: usize, at: u64, within: u64) -> Option<Vec<u64>> {
    let candidates: Vec<Vec<u64>> = queues
        .iter()
        .enumerate()
        .map(|(other, queue)| {
            if other == topic {
                return vec![at];
            }
            let mut near = queue.clone();
            near.retain(|sample| sample.abs_diff(at) <= within);
            near.sort_by_key(|sample| (sample.abs_diff(at), *sample));
            near
        })
        .collect();
    let mut all = vec![Vec::new()];
    for candidates in &candidates {
        all = all
            .iter()
            .flat_map(|begin: &Vec<u64>| {
                candidates.iter().map(move |one| {
                    let mut next = begin.clone();
                    next.push(*one);
                    next
                })
            })
            .collect();
    }
    all.into_iter().find(|choice| {
        let (first, last) = (choice.iter().min(), choice.iter().max());
        first
            .zip(last)
            .is_some_and(|(first, last)| last - first <= within)
    })
}

#[test]
fn random_sequences_match_as_all_combinations_do() {
    let mut random = fastrand::Rng::with_seed(42);
    for _ in 0..2_000 {
        let (topics, within) = (random.usize(2..=4), random.u64(0..30));
        let mut collector = collector(within, &vec![5; topics]);
        let mut queues = vec![Vec::new(); topics];
        for step in 0..40 {
            let (topic, at) = (random.usize(0..topics), 4 * step + random.u64(0..40));
            let queue: &mut Vec<u64> = &mut queues[topic];
            queue.retain(|other| *other != at);
            queue.push(at);
            queue.sort_unstable();
            if queue.len() > 5 {
                queue.remove(0);
            }
            let expected = by_force(&queues, topic, at, within).filter(|all| {
                let mut all = all.iter().zip(&queues);
                all.all(|(at, queue)| queue.contains(at))
            });
            for (at, queue) in expected.iter().flatten().zip(&mut queues) {
                queue.retain(|other| other != at);
            }
            let found = collector.add(topic, sample(at, 1));
            let found = found.map(|all| all.iter().map(|s| s.at).collect::<Vec<_>>());
            assert_eq!(found, expected);
        }
    }
}

/// Beside the package `python3-message-filters` of Debian.
#[test]
fn random_sequences_match_as_those_of_message_filters() {
    let test = "rc-runtime: random_sequences_match_as_those_of_message_filters";
    // Debian's interpreter, because it finds Debian's packages.
    let usual = Path::new("/usr/bin/python3");
    let python = |place: Option<&Path>| {
        let mut command = Command::new(if usual.exists() {
            usual
        } else {
            Path::new("python3")
        });
        if let Some(place) = place {
            command.env("PYTHONPATH", place.join("usr/lib/python3/dist-packages"));
        }
        command
    };
    let works = |place: Option<&Path>| {
        let look = "import importlib.util as u, sys; sys.exit(not u.find_spec('message_filters'))";
        let status = python(place).args(["-c", look]).status();
        status.is_ok_and(|status| status.success())
    };
    let place = match rc_test_support::debian::provided("python3-message-filters", &works) {
        Ok(place) => place,
        Err(reason) => return rc_test_support::python::skipped(test, &reason),
    };
    let mut random = fastrand::Rng::with_seed(7);
    let (mut sequences, mut expected) = (String::new(), Vec::new());
    for number in 0..10_000 {
        // Times that are never equally far apart; for the exact policy, few ones.
        let is_exact = number % 4 == 0;
        let (topics, depth) = (random.usize(2..=4), random.usize(1..=10));
        let within = if is_exact {
            0
        } else {
            random.u64(0..60_000_000)
        };
        let arrivals: Vec<(usize, u64)> = (0..40)
            .map(|step| {
                let late = if is_exact {
                    random.u64(0..8)
                } else {
                    random.u64(0..40_000_000)
                };
                let begin = if is_exact { step / 3 } else { step * 4_000_000 };
                (random.usize(0..topics), begin + late)
            })
            .collect();
        let policy = if is_exact { "exact" } else { "approximate" };
        let line = (policy, within, depth, topics, &arrivals);
        sequences += &format!("{}\n", serde_json::to_string(&line).expect("JSON"));
        expected.push(run(within, &vec![depth; topics], &arrivals));
    }
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/src/collect/message_filters.py"
    );
    let mut child = python(place.as_deref())
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python");
    let mut input = child.stdin.take().expect("its input");
    let writing = std::thread::spawn(move || input.write_all(sequences.as_bytes()));
    let output = child.wait_with_output().expect("its output");
    writing.join().expect("no panic").expect("its input");
    assert!(output.status.success());
    let lines = String::from_utf8(output.stdout).expect("a text");
    let mut matches = 0;
    for (line, expected) in lines.lines().zip(&expected) {
        let found: Vec<Vec<u64>> = serde_json::from_str(line).expect("JSON");
        assert_eq!(found, *expected);
        matches += found.len();
    }
    assert_eq!(lines.lines().count(), expected.len());
    assert!(matches > 10_000, "{matches}");
}
