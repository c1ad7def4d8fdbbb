//! The requirements of a soak, and whether a run met them.

use crate::figure::mark;
use crate::pair::quantile;
use bench_protocol::soak::Counts;
use serde_json::Value;
use std::time::{Duration, Instant};

/// How much more memory the last quarter may have than the second one, in MB, and how much it may
/// differ within the end.
const FLAT: f64 = 1.0;
/// The end is that long, or the second half of a run that is not twice as long.
const END: Duration = Duration::from_mins(5);
/// The end is divided into so many parts to see whether it is flat: a single measurement may hit a
/// moment of more use.
const PARTS: usize = 5;
/// The processor time of the last quarter may be this multiple of the second quarter's, because the
/// machine is noisy.
const STEADY: f64 = 2.0;
/// The source may skip this part of the ticks on a busy machine.
const LEFT_OUT: f64 = 0.1;

/// The measurements of one moment.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub(super) at: Instant,
    /// PSS of the source and of the sink without the pages of files, and the shared memory of the
    /// network, in MB.
    pub(super) memory: [f64; 3],
    /// Open descriptors of source and sink.
    pub(super) descriptors: usize,
    /// Processor time of the source and of the sink.
    pub(super) processor: [Duration; 2],
}

/// The errors in the status of a component.
pub(super) fn complaint(name: &str, status: &Value) -> Option<String> {
    let errors = |work: &Value| work.get("errors").and_then(Value::as_u64).unwrap_or(1);
    let slots = status.get("slots").and_then(Value::as_array);
    let slots = slots.into_iter().flatten();
    let count =
        errors(&status["compute"]) + slots.map(|slot| errors(&slot["handlers"])).sum::<u64>();
    let last = &status["last_error"];
    let bad = count > 0 || !last.is_null() || status["state"] != "running";
    bad.then(|| {
        let state = &status["state"];
        format!("{name}: state {state}, {count} errors, the last one {last}")
    })
}

/// Lost or damaged messages.
pub(super) fn lost(sent: &Counts, came: &Counts) -> Vec<String> {
    let mut complaints = Vec::new();
    let mut forbid = |what: &str, count: u64| {
        if count > 0 {
            complaints.push(format!("{what}: {count}"));
        }
    };
    let tail = |all: &str, next: &str| sent.get(all).abs_diff(came.get(next));
    forbid("ticks lost", came.get("ticks_lost"));
    forbid("images lost", came.get("images_lost"));
    forbid("last ticks lost", tail("ticks", "ticks_next"));
    forbid("last images lost", tail("images", "images_next"));
    forbid("values twice or out of order", came.get("disordered"));
    forbid("images with other bytes", came.get("spoilt"));
    forbid("wrong answers", sent.get("wrong"));
    forbid("failed questions", sent.get("failed"));
    forbid(
        "questions without answer",
        sent.get("asked") - sent.get("answered").min(sent.get("asked")),
    );
    let (ticks, skipped) = (sent.get("ticks") as f64, sent.get("skipped") as f64);
    if skipped > LEFT_OUT * (ticks + skipped) {
        complaints.push(format!(
            "the machine is too busy: {skipped} ticks were not sent"
        ));
    }
    complaints
}

/// The second and the last quarter.
fn quarters(samples: &[Sample]) -> Option<[&[Sample]; 2]> {
    let quarter = samples.len() / 4;
    (quarter > 0).then(|| {
        [
            &samples[quarter..2 * quarter],
            &samples[samples.len() - quarter..],
        ]
    })
}

/// The parts of the end.
fn end(samples: &[Sample]) -> impl Iterator<Item = &[Sample]> {
    let last = samples.last().map(|sample| sample.at);
    let late = |sample: &Sample| last.is_some_and(|last| last.duration_since(sample.at) <= END);
    let start = samples.partition_point(|sample| !late(sample));
    let end = &samples[start.max(samples.len() / 2)..];
    end.chunks(end.len().div_ceil(PARTS).max(1))
}

/// The spread of the memory within the end, in MB.
fn spread(samples: &[Sample], at: usize) -> f64 {
    let parts: Vec<f64> = end(samples)
        .map(|part| median(part, |s| s.memory[at]))
        .collect();
    let most = parts.iter().copied().fold(f64::MIN, f64::max);
    most - parts.iter().copied().fold(f64::MAX, f64::min)
}

fn median(samples: &[Sample], of: impl Fn(&Sample) -> f64) -> f64 {
    quantile(&mut samples.iter().map(of).collect::<Vec<_>>(), 0.5)
}

const MEMORY: [&str; 3] = [
    "PSS of soak_source",
    "PSS of soak_sink",
    "shared memory of the network",
];

/// Growth from the second quarter to the last.
pub(super) fn grown(samples: &[Sample]) -> Vec<String> {
    let Some([second, last]) = quarters(samples) else {
        return vec!["it was too short to say whether the memory is flat".to_owned()];
    };
    let mut complaints = Vec::new();
    for (at, what) in MEMORY.iter().enumerate() {
        let (before, after) = (
            median(second, |s| s.memory[at]),
            median(last, |s| s.memory[at]),
        );
        if after > before + FLAT {
            complaints.push(format!("{what} grew from {before:.2} to {after:.2} MB"));
        }
        let spread = spread(samples, at);
        if spread > FLAT {
            complaints.push(format!("{what} varies by {spread:.2} MB at the end"));
        }
    }
    let descriptors = |samples| median(samples, |s| s.descriptors as f64);
    // One comes and goes: that which announces new files of iceoryx2, while none is made.
    if descriptors(last) > descriptors(second) + 1.0 {
        complaints.push(format!(
            "descriptors grew from {} to {}",
            descriptors(second),
            descriptors(last)
        ));
    }
    let (before, after) = (shares(second), shares(last));
    for (name, (before, after)) in ["soak_source", "soak_sink"]
        .iter()
        .zip(before.iter().zip(after))
    {
        if after > before * STEADY {
            complaints.push(format!(
                "processor time of {name} grew from {before:.1} to {after:.1} %"
            ));
        }
    }
    complaints
}

/// Processor time of the source and of the sink between the first sample and the last, in per cent
/// of a core.
pub(super) fn shares(samples: &[Sample]) -> [f64; 2] {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return [0.0; 2];
    };
    let elapsed = (last.at - first.at).as_secs_f64();
    [0, 1].map(|at| {
        let used = last.processor[at].saturating_sub(first.processor[at]);
        if elapsed > 0.0 {
            100.0 * used.as_secs_f64() / elapsed
        } else {
            0.0
        }
    })
}

/// A row of a table.
pub(super) fn row(sent: &Counts, came: &Counts, samples: &[Sample], met: bool) -> String {
    let took = match samples {
        [first, .., last] => (last.at - first.at).as_secs_f64(),
        _ => 0.0,
    };
    let memory: Vec<String> = [0, 1, 2]
        .iter()
        .map(|at| {
            let of = |samples| median(samples, |s: &Sample| s.memory[*at]);
            quarters(samples).map_or_else(
                || "unknown".to_owned(),
                |[second, last]| {
                    let (second, last) = (of(second), of(last));
                    format!(
                        "{second:.2} → {last:.2} (± {:.2})",
                        spread(samples, *at) / 2.0
                    )
                },
            )
        })
        .collect();
    let processor = shares(samples);
    format!(
        "| soak, {took:.0} s | nothing lost, memory flat | {} ticks (lost {}), {} images (lost {}), {} of {} questions answered; MB in the second → last quarter: source {}, sink {}, shared memory {}; processor {:.1} + {:.1} % of a core | {} |",
        came.get("ticks"),
        came.get("ticks_lost"),
        came.get("images"),
        came.get("images_lost"),
        sent.get("answered"),
        sent.get("asked"),
        memory[0],
        memory[1],
        memory[2],
        processor[0],
        processor[1],
        mark(met),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of a second each; `memory` is the memory of the source in each of them.
    fn samples(memory: impl Fn(u32) -> f64) -> Vec<Sample> {
        let begin = Instant::now();
        let second = |at: u32| Duration::from_secs(at.into());
        (0..40)
            .map(|at| Sample {
                at: begin + second(at),
                memory: [memory(at), 5.0, 5.0],
                descriptors: 30,
                processor: [second(at) / 10, second(at) / 20],
            })
            .collect()
    }

    #[test]
    fn growth_of_memory_is_detected_and_noise_is_not() {
        let noise = samples(|at| 20.0 + 0.4 * f64::from(at % 3));
        assert_eq!(grown(&noise), [""; 0]);
        let warming = samples(|at| if at < 10 { 10.0 } else { 20.0 });
        assert_eq!(grown(&warming), [""; 0]);
        let leaking = samples(|at| 20.0 + 0.1 * f64::from(at));
        assert_eq!(
            grown(&leaking),
            [
                "PSS of soak_source grew from 21.50 to 23.50 MB",
                "PSS of soak_source varies by 1.60 MB at the end"
            ]
        );
        assert_eq!(grown(&leaking[..3]).len(), 1);
    }

    #[test]
    fn growth_of_cpu_time_and_descriptors_is_detected() {
        let mut growing = samples(|_| 20.0);
        for (at, sample) in growing.iter_mut().enumerate() {
            sample.descriptors += at;
            sample.processor[1] *= at as u32;
        }
        let found = grown(&growing);
        assert!(found[0].starts_with("descriptors grew from "), "{found:?}");
        assert!(
            found[1].starts_with("processor time of soak_sink grew from "),
            "{found:?}"
        );
    }

    #[test]
    fn missing_messages_are_detected() {
        let read = |line: &str| Counts::read(line).expect("counts");
        let sent = read("counts ticks=100 images=3 asked=20 answered=20");
        let came = read("counts ticks_next=100 images_next=3");
        assert_eq!(lost(&sent, &came), [""; 0]);
        let came = read("counts ticks_next=98 images_next=3 ticks_lost=1 spoilt=2");
        let found = [
            "ticks lost: 1",
            "last ticks lost: 2",
            "images with other bytes: 2",
        ];
        assert_eq!(lost(&sent, &came), found);
        let sent = read("counts ticks=98 images=3 asked=20 answered=18 wrong=1 skipped=50");
        let found = lost(&sent, &came);
        assert!(found.contains(&"wrong answers: 1".to_owned()), "{found:?}");
        assert!(found.contains(&"questions without answer: 2".to_owned()));
        assert!(
            found
                .iter()
                .any(|f| f.starts_with("the machine is too busy"))
        );
    }

    #[test]
    fn errors_in_a_status_are_detected() {
        let status = |text: &str| serde_json::from_str::<Value>(text).expect("JSON");
        let good = r#"{"state":"running","compute":{"errors":0},"slots":[{"handlers":{"errors":0}}],"last_error":null}"#;
        assert_eq!(complaint("it", &status(good)), None);
        for (from, to) in [
            ("null", r#""no""#),
            (r#"errors":0}}"#, r#"errors":1}}"#),
            ("running", "emergency"),
        ] {
            assert!(complaint("it", &status(&good.replace(from, to))).is_some());
        }
    }
}
