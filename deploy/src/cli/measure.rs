//! `rcdeploy hz`, `bw` and `delay`: a line each second about a topic or about calls.

use super::messages::watch;
use super::output::{Failure, print_note};
use crate::cli::arguments::TopicArguments;
use rc_deploy_client::Format;
use rc_diagnostics::foreign::clean;
use rc_middleware::{Reader, now, rpc};
use rc_observe::{Estimate, MessageKind, Observed, RemoteClock, SendingClock, Source};
use serde_json::json;
use std::cell::RefCell;
use std::io::Write;
use std::time::{Duration, Instant};

/// Measured quantity of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    Rate,
    Bandwidth,
    Delay,
}

/// The samples of one second.
#[derive(Default)]
struct Window {
    count: u64,
    bytes: u64,
    lost: u64,
    /// Between two samples, or from sending to receiving, in milliseconds.
    times: Vec<f64>,
}

/// The clock by which the messages are stamped.
#[derive(Debug, PartialEq, Eq)]
enum SenderClock {
    /// The clock of this machine.
    Here,
    /// The clock of another machine.
    Elsewhere { host: String, estimate: Estimate },
}

impl SenderClock {
    /// The present clock. `remote` asks the machine of the senders, and lives as long as they
    /// stay there.
    fn look(
        network: &str,
        source: &Source,
        remote: &mut Option<RemoteClock>,
    ) -> Result<Self, Failure> {
        let (end, host, clock) = match source.sending_clock() {
            SendingClock::Here | SendingClock::Unknown => return Ok(Self::Here),
            SendingClock::Several([one, other]) => {
                let here = "this machine".to_owned();
                let [first, second] = [one, other].map(|end| end.host.as_ref().unwrap_or(&here));
                return Err(Failure(
                    1,
                    format!(
                        "{one} runs on {first} and {other} on {second}: their messages cannot be told apart, and the clocks differ"
                    ),
                ));
            }
            SendingClock::Elsewhere { end, host, clock } => (end, host, clock),
        };
        let known = remote.take();
        let asked = match known.filter(|known| known.component() == end.component) {
            Some(known) => known,
            None => RemoteClock::start(network, &end.component)?,
        };
        let estimate = remote.insert(asked).estimate(clock);
        if let Estimate::Refused(why) = estimate {
            let help = "build the component again: an older version does not report its clocks";
            return Err(Failure(1, format!("{why}; {help}")));
        }
        Ok(Self::Elsewhere {
            host: host.to_owned(),
            estimate,
        })
    }

    /// A time of sending by the clock of this machine; 0 if it is unknown.
    fn here(&self, sent: u64) -> u64 {
        match self {
            Self::Here => sent,
            Self::Elsewhere {
                estimate: Estimate::Known(offset),
                ..
            } if sent != 0 => sent.saturating_add_signed(offset.ahead_ns.saturating_neg()),
            Self::Elsewhere { .. } => 0,
        }
    }

    /// Whether the first reply of the other machine has not come.
    fn is_pending(&self) -> bool {
        matches!(self, Self::Elsewhere { estimate, .. } if *estimate == Estimate::Pending)
    }

    /// Why there are no delays.
    fn failure(&self) -> Option<&str> {
        match self {
            Self::Elsewhere {
                estimate: Estimate::Failed(why),
                ..
            } => Some(why),
            Self::Here | Self::Elsewhere { .. } => None,
        }
    }
}

/// `rcdeploy hz`, `bw` and `delay`: a line each second.
pub(super) fn measure(
    watched: &TopicArguments,
    measure: Measure,
    seconds: Option<u64>,
) -> Result<u8, Failure> {
    let window = RefCell::new(Window::default());
    let sender: RefCell<Option<SenderClock>> = RefCell::new(None);
    let mut last: Option<u64> = None;
    let start = now();
    let take = |source: &Source, observed: &Observed<'_>| {
        if let Source::Calls(operation) = source {
            let mut reader = Reader::new(observed.body);
            let id = rpc::open_request(&mut reader).map(|(_, id)| id);
            if observed.kind != MessageKind::Request || id != Ok(operation.operation.id) {
                return Ok(true);
            }
        }
        let stamp = observed.header.sent;
        let sending = source.sending_clock();
        let sent = match (measure, &*sender.borrow()) {
            (Measure::Delay, Some(clock)) if !clock.is_pending() => clock.here(stamp),
            (Measure::Delay, _) => return Ok(true),
            // Without the clock of another machine, the times of arrival count.
            _ if sending == SendingClock::Here => stamp,
            _ => 0,
        };
        // Samples that a publisher keeps for late subscribers were sent before. The clock of an
        // unknown machine does not show that.
        if sending != SendingClock::Unknown && (1..start).contains(&sent) {
            return Ok(true);
        }
        let mut window = window.borrow_mut();
        window.count += 1;
        window.bytes += observed.body.len() as u64;
        window.lost += observed.lost;
        let now = now();
        let at = if sent == 0 { now } else { sent };
        match measure {
            Measure::Delay if sent != 0 => window.times.push(ms(now) - ms(sent)),
            Measure::Rate => {
                let before = last.replace(at);
                window
                    .times
                    .extend(before.map(|before| ms(at) - ms(before)));
            }
            Measure::Bandwidth | Measure::Delay => {}
        }
        Ok(true)
    };
    let mut begin = Instant::now();
    let mut lines = 0;
    let (mut remote, mut noted) = (None, String::new());
    let turn = |source: &Source| {
        if measure == Measure::Delay {
            let clock = SenderClock::look(&watched.network, source, &mut remote)?;
            let note = if source.sending_clock() == SendingClock::Unknown {
                "no sender describes itself: the delay is right if it runs on this machine"
            } else {
                clock.failure().unwrap_or_default()
            };
            if noted != note {
                note.clone_into(&mut noted);
                if !note.is_empty() {
                    print_note(&note);
                }
            }
            let is_pending = clock.is_pending();
            *sender.borrow_mut() = Some(clock);
            if is_pending {
                begin = Instant::now();
                return Ok(true);
            }
        }
        let elapsed = begin.elapsed();
        if elapsed < Duration::from_secs(1) {
            return Ok(true);
        }
        begin = Instant::now();
        let window = window.take();
        lines += 1;
        let text = report(
            measure,
            watched.format,
            &window,
            elapsed.as_secs_f64(),
            sender.borrow().as_ref(),
        );
        let written = writeln!(rc_diagnostics::print::output(), "{text}");
        Ok(written.is_ok() && seconds.is_none_or(|seconds| lines < seconds))
    };
    watch(watched, false, take, turn)
}

fn ms(ns: u64) -> f64 {
    ns as f64 / 1e6
}

fn report(
    measure: Measure,
    format: Format,
    window: &Window,
    seconds: f64,
    clock: Option<&SenderClock>,
) -> String {
    // The host, and how far its clock is ahead, with the greatest error.
    let clock = clock.and_then(|clock| match clock {
        SenderClock::Here => None,
        SenderClock::Elsewhere {
            host,
            estimate: Estimate::Known(offset),
        } => {
            let ahead = offset.ahead_ns as f64 / 1e6;
            Some((host, Some((ahead, ms(offset.uncertainty_ns)))))
        }
        SenderClock::Elsewhere { host, .. } => Some((host, None)),
    });
    let round = |value: f64| (value * 1e3).round() / 1e3;
    let rate = round(window.count as f64 / seconds);
    let mut times = window.times.clone();
    times.sort_by(f64::total_cmp);
    let at = |part: f64| {
        let last = times.len().saturating_sub(1);
        times.get((last as f64 * part).round() as usize).copied()
    };
    let (min, median, p99, max) = (at(0.0), at(0.5), at(0.99), at(1.0));
    let lost = window.lost;
    if format == Format::Json {
        let mut object = json!({"rate_hz": rate, "lost": lost});
        let mut times = |name: &str| {
            object[name] = json!({"min": min.map(round), "p50": median.map(round), "p99": p99.map(round), "max": max.map(round)});
        };
        match measure {
            Measure::Rate => times("period_ms"),
            Measure::Delay => times("delay_ms"),
            Measure::Bandwidth => {
                object["bytes_per_s"] = json!((window.bytes as f64 / seconds).round());
                let mean = window.bytes.checked_div(window.count);
                object["mean_bytes"] = json!(mean);
            }
        }
        if let Some((host, offset)) = clock {
            let ahead = offset.map(|(ahead, _)| round(ahead));
            let error = offset.map(|(_, error)| round(error));
            object["clock"] = json!({"host": host, "ahead_ms": ahead, "uncertainty_ms": error});
        }
        return object.to_string();
    }
    let lost = if lost > 0 {
        format!("  {lost} lost")
    } else {
        String::new()
    };
    let times = |what: &str| match (min, median, p99, max) {
        (Some(min), Some(median), Some(p99), Some(max)) => {
            format!("  {what} min {min:.3}, p50 {median:.3}, p99 {p99:.3}, max {max:.3} ms")
        }
        _ => String::new(),
    };
    match measure {
        Measure::Rate => format!("{rate:.1} Hz{}{lost}", times("period")),
        Measure::Delay => {
            let error = clock.map(|(host, offset)| {
                let host = clean(host);
                let Some((ahead, error)) = offset else {
                    return format!("  delay unknown (so is the clock of {host})");
                };
                let side = if ahead < 0.0 { "behind" } else { "ahead" };
                let ahead = ahead.abs();
                format!("  ± {error:.3} ms (the clock of {host} is {ahead:.3} ms {side})")
            });
            let error = error.unwrap_or_default();
            format!("{rate:.1} Hz{}{error}{lost}", times("delay"))
        }
        Measure::Bandwidth => {
            let mean = window.bytes.checked_div(window.count).unwrap_or(0);
            let kib = window.bytes as f64 / seconds / 1024.0;
            format!("{kib:.1} KiB/s  {rate:.1} Hz  mean {mean} B{lost}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_observe::Offset;

    const SECOND: i64 = 1_000_000_000;

    fn of(estimate: Estimate) -> SenderClock {
        SenderClock::Elsewhere {
            host: "robot".into(),
            estimate,
        }
    }

    fn known(ahead_ns: i64) -> SenderClock {
        of(Estimate::Known(Offset {
            ahead_ns,
            uncertainty_ns: 200_000,
        }))
    }

    #[test]
    fn a_time_of_sending_is_converted_to_the_clock_of_this_machine() {
        let sent = 5000 * SECOND as u64;
        assert_eq!(SenderClock::here(&SenderClock::Here, sent), sent);
        assert_eq!(known(5 * SECOND).here(sent), 4995 * SECOND as u64);
        assert_eq!(known(-1000 * SECOND).here(sent), 6000 * SECOND as u64);
        // 0 means unknown, and a clock of a stranger may be anything.
        assert_eq!(known(5 * SECOND).here(0), 0);
        assert_eq!(known(i64::MIN).here(sent), sent + i64::MAX as u64);
        assert_eq!(of(Estimate::Failed("it hangs".into())).here(sent), 0);
    }

    #[test]
    fn a_line_names_the_clock_and_its_error() {
        let window = Window {
            count: 20,
            times: vec![0.5, 0.25],
            ..Window::default()
        };
        let line = |format, clock| report(Measure::Delay, format, &window, 1.0, Some(&clock));
        let text = line(Format::Human, known(-5 * SECOND));
        assert!(text.starts_with("20.0 Hz  delay min 0.250, "), "{text}");
        let says = "± 0.200 ms (the clock of robot is 5000.000 ms behind)";
        assert!(text.ends_with(says), "{text}");
        let json: serde_json::Value =
            serde_json::from_str(&line(Format::Json, known(5 * SECOND))).expect("JSON");
        assert_eq!(
            json["clock"],
            json!({"host": "robot", "ahead_ms": 5000.0, "uncertainty_ms": 0.2})
        );
    }

    #[test]
    fn a_line_without_a_clock_says_so() {
        let window = Window {
            count: 20,
            ..Window::default()
        };
        let clock = of(Estimate::Failed("it hangs".into()));
        let line = |format| report(Measure::Delay, format, &window, 1.0, Some(&clock));
        let text = line(Format::Human);
        assert_eq!(text, "20.0 Hz  delay unknown (so is the clock of robot)");
        let json: serde_json::Value = serde_json::from_str(&line(Format::Json)).expect("JSON");
        let unknown = json!({"host": "robot", "ahead_ms": null, "uncertainty_ms": null});
        assert_eq!(json["clock"], unknown);
        assert_eq!(json["delay_ms"]["min"], serde_json::Value::Null);
    }
}
