//! Report of a repeated run.

use super::entry::{Entry, Kind};
use crate::clock::Time;
use crate::description::Description;
use crate::slots::{OpenSlot, SlotTable};
use rc_management::component::Role;
use rc_middleware::{Reader, rpc};
use serde_json::{Value as Json, json};
use std::collections::VecDeque;
use std::sync::Arc;

/// The most bytes of a message in a report.
const SHOWN: usize = 64 * 1024;
/// The most bytes of a message that came before a difference.
const SHOWN_BEFORE: usize = 1024;

/// The state of the run, for a line of JSON.
pub(super) struct Report<'a> {
    pub(super) description: &'a Description,
    pub(super) slots: &'a SlotTable,
    pub(super) turn: u64,
    pub(super) turns: u64,
    pub(super) outputs: u64,
    pub(super) time: Time,
}

impl Report<'_> {
    fn json(&self) -> Json {
        json!({
            "turn": self.turn,
            "turns": self.turns,
            "compared": self.outputs,
            "time_s": self.time.as_secs_f64(),
        })
    }

    /// The recording is at its end.
    pub(super) fn end(&self, error: Option<String>) -> String {
        let mut json = self.json();
        json["equal"] = Json::from(error.is_none());
        if let Some(error) = error {
            json["error"] = Json::from(error);
        }
        line(&json)
    }

    /// The worker does something else than it did: `None` is the end of its turn.
    pub(super) fn difference(
        &self,
        found: Option<&Entry<'_>>,
        recorded: Option<&Entry<'_>>,
        before: &VecDeque<(u64, Entry<'static>)>,
    ) -> String {
        let mut json = self.json();
        let entry = |entry: Option<&Entry<'_>>| match entry {
            Some(entry) => self.entry(entry, SHOWN),
            None => json!({ "kind": "end of the turn" }),
        };
        let before = before.iter().map(|(turn, entry)| {
            let mut json = self.entry(entry, SHOWN_BEFORE);
            json["turn"] = Json::from(*turn);
            json
        });
        json["equal"] = Json::from(false);
        json["types"] = self
            .description
            .types
            .iter()
            .map(|t| Json::from(*t))
            .collect();
        json["difference"] = json!({
            "found": entry(found),
            "recorded": entry(recorded),
            "before": before.collect::<Vec<_>>(),
        });
        line(&json)
    }

    fn entry(&self, entry: &Entry<'_>, limit: usize) -> Json {
        let mut json = json!({ "kind": entry.kind.word() });
        if let Some(slot) = self.slot(entry) {
            json["slot"] = Json::from(&*slot.name);
            json["interface"] = Json::from(slot.type_name);
            let operation = match entry.kind {
                Kind::Send | Kind::Call | Kind::Request => {
                    let found = rpc::open_request(&mut Reader::new(&entry.data)).ok();
                    found.and_then(|(_, id)| slot.operations.iter().find(|o| o.id == id))
                }
                Kind::Publish | Kind::Sample => slot.operations.get(usize::from(entry.operation)),
                _ => None,
            };
            if let Some(operation) = operation {
                json["operation"] = Json::from(operation.name);
            }
        }
        if entry.value != 0 {
            json["value"] = Json::from(entry.value);
        }
        if !entry.text.is_empty() && entry.kind != Kind::Start {
            json["text"] = Json::from(&*entry.text);
        }
        if !entry.data.is_empty() {
            json["length"] = Json::from(entry.data.len());
            let shown = &entry.data[..entry.data.len().min(limit)];
            json["data"] = Json::from(hexadecimal(shown));
        }
        json
    }

    fn slot(&self, entry: &Entry<'_>) -> Option<Arc<OpenSlot>> {
        let slot = self.slots.get(usize::from(entry.slot))?;
        let fits = match entry.kind {
            Kind::Sample => slot.role == Role::SubscribesTo,
            Kind::Request | Kind::Reply => slot.role == Role::Implements,
            Kind::Publish => slot.role == Role::Publishes,
            Kind::Opened | Kind::Answer | Kind::Send | Kind::Call => slot.role == Role::Requires,
            Kind::Peers | Kind::Failed => true,
            _ => false,
        };
        fits.then_some(slot)
    }
}

fn line(json: &Json) -> String {
    format!("{json}\n")
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
