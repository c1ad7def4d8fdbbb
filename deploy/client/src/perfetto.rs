//! The messages of chains as trace events, which <https://ui.perfetto.dev> and Chrome show.
//!
//! The format is Google's "Trace Event Format": complete events (`X`) for what components do, flow
//! events (`s`, `f`) for messages between them, and nestable asynchronous events (`b`, `e`) for the
//! way of each message through its chain. Times are microseconds.

use crate::chains::ChainsReport;
use serde_json::{Value as Json, json};

/// The process that holds the chains.
const CHAINS: usize = 1;
/// The process that holds the components; each is a thread of it.
const COMPONENTS: usize = 2;

/// The trace events of a report with messages.
///
/// Each component is a track with its work. Arrows are messages. Each chain is a track with its
/// messages from begin to end, and in them the way, the wait for `compute()` and the work at each
/// component.
pub fn trace_events(report: &ChainsReport) -> Json {
    let mut events = vec![
        name(
            "process_name",
            CHAINS,
            0,
            &format!("chains of {}", report.network),
        ),
        name(
            "process_name",
            COMPONENTS,
            0,
            &format!("components of {}", report.network),
        ),
    ];
    let mut components: Vec<&str> = Vec::new();
    let mut messages = 0_usize;
    for (number, chain) in report.chains.iter().enumerate() {
        events.push(name("thread_name", CHAINS, number, &chain.name));
        for trace in &chain.traces {
            messages += 1;
            let span = |phase: &str, text: &str, at: f64| {
                json!({
                    "ph": phase, "cat": chain.name, "id": messages, "name": text, "ts": at,
                    "pid": CHAINS, "tid": number,
                })
            };
            let mut at = trace.began_us as f64;
            let mut whole = span("b", &chain.name, at);
            whole["args"] = json!({ "total_ms": trace.total_ms(), "late": trace.late });
            events.push(whole);
            for (step, (hop, parts)) in chain.hops.iter().zip(&trace.hops).enumerate() {
                let component = &hop.component;
                let known = components.iter().position(|known| known == component);
                let thread = known.unwrap_or_else(|| {
                    components.push(component);
                    components.len() - 1
                });
                let [way, period, work] = parts.map(|ms| ms * 1e3);
                let arrow = |phase: &str, thread: usize, at: f64| {
                    json!({
                        "ph": phase, "bp": "e", "cat": "message", "id": format!("{messages}.{step}"),
                        "name": hop.receives, "ts": at, "pid": COMPONENTS, "tid": thread,
                    })
                };
                if let Some(before) = step.checked_sub(1).and_then(|at| chain.hops.get(at)) {
                    let from = components
                        .iter()
                        .position(|known| *known == before.component);
                    events.push(arrow("s", from.unwrap_or(thread), at));
                    events.push(arrow("f", thread, at + way + period));
                }
                let parts = [
                    (format!("to {component}"), way),
                    (format!("until compute of {component}"), period),
                    (format!("{component} works"), work),
                ];
                for (text, length) in parts {
                    if length > 0.0 {
                        events.push(span("b", &text, at));
                        events.push(span("e", &text, at + length));
                    }
                    at += length;
                }
                events.push(json!({
                    "ph": "X", "cat": "work", "name": hop.receives, "ts": at - work, "dur": work,
                    "pid": COMPONENTS, "tid": thread, "args": { "chain": chain.name, "late": trace.late },
                }));
            }
            events.push(span("e", &chain.name, at));
        }
    }
    for (thread, component) in components.iter().enumerate() {
        events.push(name("thread_name", COMPONENTS, thread, component));
    }
    json!({ "displayTimeUnit": "ms", "traceEvents": events })
}

/// The name of a process or a thread.
fn name(what: &str, process: usize, thread: usize, text: &str) -> Json {
    json!({ "ph": "M", "name": what, "pid": process, "tid": thread, "args": { "name": text } })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_management::chains::{ChainStatus, HopStatus, Trace};

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
        let events = trace_events(&report);
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
