//! The times of a chain as its components note them, beside those of `rcdeploy chains`.
//!
//! Each component writes down when its call or its handler began and ended, by the clock that all
//! processes of this computer share. The first component calls, and all handlers run within its
//! call. So a message takes at most as long as the call, and at least from the beginning of the
//! first handler to the end of the last one.

use super::{chain, events};
use rc_test_site::site::Site;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The first component, the second one, and the last one.
const NOTED: [&str; 3] = ["a", "b", "f"];
/// A chain is broken after a second without a message; the supervisor looks four times a second.
const PAUSE_MS: f64 = 700.0;
/// The supervisor reports again that a chain is late after five seconds in time. In milliseconds.
const CALM_MS: f64 = 7000.0;
/// How far the clock of the exported times may be off, and their precision. In milliseconds.
const CLOCK_MS: f64 = 2.0;
const PRECISION_MS: f64 = 0.02;

/// The file to which a component writes its times.
pub(super) fn file(site: &Site, component: &str) -> Option<PathBuf> {
    NOTED
        .contains(&component)
        .then(|| site.path(&format!("witness_{component}")))
}

/// A call or a handler, in milliseconds since 1970.
#[derive(Clone, Copy, Debug)]
struct Span {
    begun: f64,
    ended: f64,
    is_failed: bool,
}

/// A message as `rcdeploy chains` measured it, in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Message {
    began: f64,
    took: f64,
    is_late: bool,
}

/// What was measured so far, and what the components noted.
pub(super) struct Witness<'s> {
    site: &'s Site,
    within: f64,
    calls: Vec<Span>,
    /// Messages, by the numbers of their calls.
    messages: BTreeMap<usize, Message>,
    /// The greatest stated error.
    error: f64,
    /// The reports until the last look.
    events: Vec<(String, String)>,
}

impl<'s> Witness<'s> {
    /// `within`: that of the chain, in milliseconds.
    pub(super) fn new(site: &'s Site, within: u64) -> Self {
        Self {
            site,
            within: within as f64,
            calls: Vec::new(),
            messages: BTreeMap::new(),
            error: 0.0,
            events: Vec::new(),
        }
    }

    /// Takes the messages that were measured since the last look, and the calls that led to them.
    /// Look at least once in 4096 messages.
    pub(super) fn look(&mut self) {
        // The messages of reports that come later may be measured after this look.
        self.events = events(self.site);
        self.calls = self.noted("a");
        let last = self.calls.last().expect("a call").begun;
        let mut measured = Vec::new();
        Site::until("the last call to be measured", || {
            measured = self.measured();
            let newest = measured.last();
            newest.is_some_and(|message| message.began + CLOCK_MS >= last)
        });
        let stated = chain(self.site)["uncertainty_ms"].as_f64();
        self.error = self.error.max(stated.expect("an error"));
        // It goes on to call.
        self.calls = self.noted("a");
        for message in measured {
            let begun = |call: &Span| call.begun <= message.began + CLOCK_MS;
            let Some(number) = self.calls.partition_point(begun).checked_sub(1) else {
                panic!("{message:?} began before the first call");
            };
            let known = self.messages.insert(number, message);
            // Looks overlap.
            let is_same = known.is_none_or(|known| {
                (known.took - message.took).abs() < PRECISION_MS && known.is_late == message.is_late
            });
            assert!(
                is_same,
                "two messages of call {number}: {known:?}, {message:?}"
            );
        }
    }

    /// The calls or handlers that a component has noted.
    fn noted(&self, component: &str) -> Vec<Span> {
        let path = file(self.site, component).expect("a component that notes its times");
        let text = std::fs::read_to_string(path).expect("the times");
        let span = |line: &str| {
            let mut words = line.split(' ');
            let mut time = || Some(words.next()?.parse::<u64>().ok()? as f64 / 1e6);
            Some(Span {
                begun: time()?,
                ended: time()?,
                is_failed: words.next().is_some(),
            })
        };
        let spans = text.lines().map(|line| span(line).expect("two times"));
        spans.collect()
    }

    /// The last messages, from `rcdeploy chains`.
    fn measured(&self) -> Vec<Message> {
        let path = self.site.path("chains.json");
        let file = path.display().to_string();
        let words = ["chains", &self.site.network, "--perfetto", &file];
        let shown = self.site.rcdeploy(&words, false);
        assert_eq!(shown.code, 0, "{shown:?}");
        let text = std::fs::read(path).expect("the messages");
        let document: Value = serde_json::from_slice(&text).expect("JSON");
        let events = document["traceEvents"].as_array().expect("events");
        let messages = events.iter().filter_map(|event| {
            let args = event.get("args")?;
            Some(Message {
                began: event["ts"].as_f64()? / 1e3,
                took: args.get("total_ms")?.as_f64()?,
                is_late: args["late"].as_bool()?,
            })
        });
        messages.collect()
    }

    /// Compares each message with its call, and each report with its messages. Prints the counts.
    pub(super) fn judge(&self) {
        let (handlers, last) = (self.noted("b"), self.noted("f"));
        let within = |spans: &[Span], call: &Span| {
            let from = spans.partition_point(|span| span.begun < call.begun);
            let to = spans.partition_point(|span| span.begun < call.ended);
            spans[from..to].to_vec()
        };
        let limit = self.error + PRECISION_MS;
        let (mut wrong, mut alarms, mut missed) = (Vec::new(), Vec::new(), Vec::new());
        let (mut witnessed, mut unfollowed) = (0, 0);
        let mut apart: Vec<f64> = Vec::new();
        let ends = (
            self.messages.first_key_value(),
            self.messages.last_key_value(),
        );
        let (Some((first, _)), Some((until, _))) = ends else {
            panic!("no message was measured");
        };
        for number in *first..=*until {
            let call = &self.calls[number];
            let longest = if call.is_failed {
                f64::INFINITY
            } else {
                call.ended - call.begun
            };
            // Behind a call that failed, its message may still be on its way.
            let follows = number.checked_sub(1).map(|before| self.calls[before]);
            let is_alone = !call.is_failed && follows.is_some_and(|before| !before.is_failed);
            let shortest = match (&within(&handlers, call)[..], &within(&last, call)[..]) {
                ([first], [last]) if is_alone => last.ended - first.begun,
                (first, last) if is_alone => {
                    panic!("the handlers of call {number}, {call:?}: {first:?}, {last:?}")
                }
                _ => 0.0,
            };
            let is_late = shortest > self.within + limit;
            witnessed += usize::from(longest > self.within);
            let Some(message) = self.messages.get(&number) else {
                unfollowed += 1;
                continue;
            };
            if message.took > longest + limit || message.took < shortest - limit {
                wrong.push((number, shortest, longest, *message));
            }
            if is_alone {
                apart.push(longest - message.took);
            }
            if message.is_late && longest <= self.within {
                alarms.push((number, longest, *message));
            } else if !message.is_late && is_late {
                missed.push((number, shortest, *message));
            }
        }
        apart.sort_by(f64::total_cmp);
        println!(
            "{} messages of {} calls, {unfollowed} not followed; {witnessed} of them late by their calls, {} measured late; \
             {} false alarms, {} missed; calls are longer by {:.3} ms at p50, {:.3} ms at worst; stated error {:.3} ms",
            self.messages.len(),
            until - first + 1,
            self.late().len(),
            alarms.len(),
            missed.len(),
            apart.get(apart.len() / 2).unwrap_or(&0.0),
            apart.last().unwrap_or(&0.0),
            self.error,
        );
        assert!(wrong.is_empty(), "shortest, longest, measured: {wrong:?}");
        assert!(alarms.is_empty(), "false alarms: {alarms:?}");
        assert!(missed.is_empty(), "late without a report: {missed:?}");
        // On a busy computer, a component may not answer the supervisor for a second.
        assert!(
            unfollowed <= self.messages.len() / 100,
            "{unfollowed} of {}",
            self.messages.len()
        );
        self.events_are_true(&last);
    }

    fn late(&self) -> Vec<Message> {
        let late = self.messages.values().filter(|message| message.is_late);
        late.copied().collect()
    }

    /// Each report is that of a late message, and there is one for late messages that follow each
    /// other.
    fn events_are_true(&self, last: &[Span]) {
        let late = self.late();
        let times: Vec<f64> = late.iter().map(|late| late.began + late.took).collect();
        let apart = times.windows(2).filter(|two| two[1] - two[0] > CALM_MS);
        let groups = usize::from(!late.is_empty()) + apart.count();
        let reports = || {
            let events = events(self.site).into_iter();
            events.filter(|(code, _)| code == "chain-late").count()
        };
        Site::until("late messages to be reported", || reports() >= groups);
        let pause = last.windows(2).map(|two| two[1].ended - two[0].ended);
        let pause = pause.fold(0.0, f64::max);
        for (code, text) in &self.events {
            println!("{text}");
            let is_true = match code.as_str() {
                "chain-late" => late.iter().any(|message| says(text, message.took)),
                "chain-broken" => pause > PAUSE_MS,
                code => code == "chain-in-time",
            };
            assert!(is_true, "{text}: {late:?}, the longest pause is {pause} ms");
        }
    }
}

/// Whether the text of a report names this time.
fn says(text: &str, took: f64) -> bool {
    let named = text.split(" took ").nth(1).and_then(|rest| {
        let number = rest.split(' ').next()?;
        number.parse::<f64>().ok()
    });
    // It has a decimal below 100 ms.
    let precision = if took < 100.0 { 0.06 } else { 0.6 };
    named.is_some_and(|named| (named - took).abs() < precision)
}
