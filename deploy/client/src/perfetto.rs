//! The messages of chains as trace events, which <https://ui.perfetto.dev> and Chrome show.
//!
//! The format is Google's "Trace Event Format": complete events (`X`) for what components do, flow
//! events (`s`, `f`) for messages between them, and nestable asynchronous events (`b`, `e`) for the
//! way of each message through its chain. Times are microseconds.

use crate::chains::ChainsReport;
use rc_management::chains::{ChainStatus, Trace};
use serde_json::{Value as Json, json};
use std::collections::BTreeMap;
use std::io::{self, Write};

/// The process that holds the chains.
const CHAINS: usize = 1;
/// The process that holds the components; each is a thread of it.
const COMPONENTS: usize = 2;

/// Writes the trace events of a report with messages, one on each line.
///
/// Each component is a track with its work. Arrows are messages. Each chain is a track with its
/// messages from begin to end, and in them the way, the wait for `compute()` and the work at each
/// component.
///
/// # Errors
/// That of `out`.
pub fn write_trace_events(report: &ChainsReport, out: &mut dyn Write) -> io::Result<()> {
    let mut tracks: BTreeMap<&str, usize> = BTreeMap::new();
    for hop in report.chains.iter().flat_map(|chain| &chain.hops) {
        let next = tracks.len();
        tracks.entry(&hop.component).or_insert(next);
    }
    out.write_all(b"{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n")?;
    let processes = [(CHAINS, "chains"), (COMPONENTS, "components")];
    for (process, what) in processes {
        let text = format!("{what} of {}", report.network);
        let event = name("process_name", process, 0, &text);
        // All others follow a comma.
        if process == CHAINS {
            write!(out, "{event}")?;
        } else {
            put(out, &event)?;
        }
    }
    for (component, track) in &tracks {
        put(out, &name("thread_name", COMPONENTS, *track, component))?;
    }
    let mut messages = 0;
    for (number, chain) in report.chains.iter().enumerate() {
        put(out, &name("thread_name", CHAINS, number, &chain.name))?;
        for trace in &chain.traces {
            messages += 1;
            write_message(chain, trace, (number, messages), &tracks, out)?;
        }
    }
    out.write_all(b"\n]}\n")
}

fn put(out: &mut dyn Write, event: &Json) -> io::Result<()> {
    write!(out, ",\n{event}")
}

/// Writes the events of a message. `number` and `id` are those of its chain and its own.
fn write_message(
    chain: &ChainStatus,
    trace: &Trace,
    (number, id): (usize, u64),
    tracks: &BTreeMap<&str, usize>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let span = |phase: &str, text: &str, at: f64| {
        json!({
            "ph": phase, "cat": chain.name, "id": id, "name": text, "ts": at,
            "pid": CHAINS, "tid": number,
        })
    };
    let mut at = trace.began_us as f64;
    let mut whole = span("b", &chain.name, at);
    whole["args"] = json!({ "total_ms": trace.total_ms(), "late": trace.late });
    put(out, &whole)?;
    let mut before = None;
    for (step, (hop, parts)) in chain.hops.iter().zip(&trace.hops).enumerate() {
        let component = hop.component.as_str();
        let track = tracks.get(component).copied().unwrap_or_default();
        let [way, period, work] = parts.map(|ms| ms * 1e3);
        let arrow = |phase: &str, track: usize, at: f64| {
            json!({
                "ph": phase, "bp": "e", "cat": "message", "id": format!("{id}.{step}"),
                "name": hop.receives, "ts": at, "pid": COMPONENTS, "tid": track,
            })
        };
        if let Some(before) = before.replace(track) {
            put(out, &arrow("s", before, at))?;
            put(out, &arrow("f", track, at + way + period))?;
        }
        let parts = [
            (format!("to {component}"), way),
            (format!("until compute of {component}"), period),
            (format!("{component} works"), work),
        ];
        for (text, length) in parts {
            if length > 0.0 {
                put(out, &span("b", &text, at))?;
                put(out, &span("e", &text, at + length))?;
            }
            at += length;
        }
        let work = json!({
            "ph": "X", "cat": "work", "name": hop.receives, "ts": at - work, "dur": work,
            "pid": COMPONENTS, "tid": track, "args": { "chain": chain.name, "late": trace.late },
        });
        put(out, &work)?;
    }
    put(out, &span("e", &chain.name, at))
}

/// The name of a process or a thread.
fn name(what: &str, process: usize, thread: usize, text: &str) -> Json {
    json!({ "ph": "M", "name": what, "pid": process, "tid": thread, "args": { "name": text } })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_management::chains::HopStatus;

    #[test]
    fn each_part_begins_where_the_one_before_ends() {
        let hop = |component: &str| HopStatus {
            component: component.to_owned(),
            receives: "scan".to_owned(),
            ..HopStatus::default()
        };
        let report = ChainsReport {
            network: "robot".to_owned(),
            chains: vec![ChainStatus {
                name: "brake".to_owned(),
                hops: vec![hop("avoider"), hop("base")],
                traces: vec![Trace {
                    began_us: 1_000_000,
                    hops: vec![[1.0, 20.0, 3.0], [0.5, 0.0, 2.0]],
                    late: true,
                }],
                ..ChainStatus::default()
            }],
        };
        let mut text = Vec::new();
        write_trace_events(&report, &mut text).expect("memory");
        let events: Json = serde_json::from_slice(&text).expect("JSON");
        let events = events["traceEvents"].as_array().expect("events");
        let work = |component: usize| {
            let mut all = events.iter();
            let found = all.find(|e| e["ph"] == "X" && e["tid"] == component);
            let found = found.expect("work");
            (found["ts"].as_f64(), found["dur"].as_f64())
        };
        assert_eq!(work(0), (Some(1_021_000.0), Some(3000.0)));
        assert_eq!(work(1), (Some(1_024_500.0), Some(2000.0)));
        let count = |phase: &str| events.iter().filter(|e| e["ph"] == phase).count();
        // The whole message, three parts at the avoider, two at the base.
        assert_eq!((count("b"), count("e")), (6, 6));
        assert_eq!((count("s"), count("f"), count("M")), (1, 1, 5));
        let end = events.iter().rfind(|e| e["ph"] == "e").expect("an end");
        assert_eq!(end["ts"], 1_026_500.0);
        let arrow = events.iter().find(|e| e["ph"] == "s").expect("an arrow");
        assert_eq!(
            (&arrow["ts"], &arrow["tid"]),
            (&json!(1_024_000.0), &json!(0))
        );
    }
}
