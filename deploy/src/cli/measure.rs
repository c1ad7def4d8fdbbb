//! `rcdeploy hz`, `bw` and `delay`: a line each second about a topic or about calls.

use super::messages::watch;
use super::output::{Failure, print_note};
use crate::cli::arguments::TopicArguments;
use rc_deploy_client::Format;
use rc_diagnostics::foreign::clean;
use rc_middleware::{Reader, now, rpc};
use rc_observe::{MessageKind, Observed, Offset, RemoteClock, SendingClock, Source};
use serde_json::json;
use std::cell::RefCell;
use std::io::{self, Write};
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

/// The present clock of the messages.
enum SenderClock {
    /// That of this machine.
    Here,
    /// Another one, which is not known yet.
    Unknown,
    /// Another one, and how far it is ahead.
    Elsewhere { host: String, offset: Offset },
}

impl SenderClock {
    /// Asks the machine of the senders.
    fn ask(
        network: &str,
        source: &Source,
        remote: &mut Option<RemoteClock>,
    ) -> Result<Self, Failure> {
        let (end, host, clock) = match source.sending_clock() {
            SendingClock::Here => return Ok(Self::Here),
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
            Some(mut known) => known.measure().map(|()| known),
            None => RemoteClock::new(network, &end.component),
        };
        Ok(match asked {
            Ok(known) => {
                let offset = known.offset(clock);
                *remote = Some(known);
                Self::Elsewhere {
                    host: host.to_owned(),
                    offset,
                }
            }
            // A component that restarts is asked again.
            Err(error) => {
                print_note(&error);
                Self::Unknown
            }
        })
    }

    /// A time of sending by the clock of this machine; 0 if it is unknown.
    fn here(&self, sent: u64) -> u64 {
        match self {
            Self::Elsewhere { offset, .. } if sent != 0 => {
                sent.saturating_add_signed(offset.ahead_ns.saturating_neg())
            }
            Self::Here => sent,
            Self::Elsewhere { .. } | Self::Unknown => 0,
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
    let sender = RefCell::new(None);
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
        let is_here = source.sending_clock() == SendingClock::Here;
        let sent = match (measure, &*sender.borrow()) {
            (Measure::Delay, Some(clock)) => SenderClock::here(clock, observed.header.sent),
            // Without the clock of another machine, the times of arrival count.
            _ if is_here => observed.header.sent,
            _ => 0,
        };
        // What a publisher keeps for late subscribers was sent before.
        if (1..start).contains(&sent) {
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
            _ => {}
        }
        Ok(true)
    };
    let mut begin = Instant::now();
    let mut lines = 0;
    let mut remote = None;
    let turn = |source: &Source| {
        if measure == Measure::Delay && sender.borrow().is_none() {
            let clock = SenderClock::ask(&watched.network, source, &mut remote)?;
            *sender.borrow_mut() = Some(clock);
        }
        let elapsed = begin.elapsed();
        if elapsed < Duration::from_secs(1) {
            return Ok(true);
        }
        begin = Instant::now();
        let window = window.take();
        lines += 1;
        // The estimate of a clock is made anew, also if the sender has moved.
        let clock = sender.take();
        let clock = clock.as_ref();
        let text = report(
            measure,
            watched.format,
            &window,
            elapsed.as_secs_f64(),
            clock,
        );
        let written = writeln!(io::stdout(), "{text}");
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
    let clock = clock.and_then(|clock| match clock {
        SenderClock::Elsewhere { host, offset } => {
            let ahead = offset.ahead_ns as f64 / 1e6;
            Some((host, ahead, ms(offset.uncertainty_ns)))
        }
        SenderClock::Here | SenderClock::Unknown => None,
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
        if let Some((host, ahead, error)) = clock {
            object["clock"] =
                json!({"host": host, "ahead_ms": round(ahead), "uncertainty_ms": round(error)});
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
            let error = clock.map(|(host, ahead, error)| {
                let host = clean(host);
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
