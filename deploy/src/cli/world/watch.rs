//! `rcdeploy world watch`: what changes in a world.

use super::elements::{document, json_of, kind, shown, text, word};
use super::follow::{Follower, Turn};
use crate::cli::output::{Failure, print_json, print_line};
use graph_language::Schema;
use rc_deploy_client::Format;
use rc_diagnostics::foreign::clean;
use rc_world::News;
use rc_world::property_graph::{Change, Element, Snapshot};
use serde_json::json;
use std::collections::BTreeSet;

/// Which changes are printed.
pub(super) struct Wanted {
    /// Types, or names of elements; empty for all.
    pub(super) words: Vec<String>,
    pub(super) count: Option<u64>,
    pub(super) format: Format,
}

/// Refuses a word that is neither a type nor an element.
fn check(schema: &Schema, world: &Snapshot, words: &[String]) -> Result<(), Failure> {
    for wanted in words {
        let is_type = schema.open || schema.attributes(wanted).is_some();
        if is_type || super::elements::named(world, wanted).is_ok() {
            continue;
        }
        let types: BTreeSet<&str> = schema.types().collect();
        let hint = match rc_diagnostics::nearest(wanted, types.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("the types are {}", Vec::from_iter(types).join(", ")),
        };
        let message = format!(
            "`{}` is neither a type nor an element; {hint}",
            clean(wanted)
        );
        return Err(Failure(2, message));
    }
    Ok(())
}

pub(super) fn watch(network: &str, wanted: &Wanted) -> Result<u8, Failure> {
    let Some(mut follower) = Follower::begin(network)? else {
        return Ok(0);
    };
    let now = follower.listener.world.snapshot();
    check(now.schema(), &now, &wanted.words)?;
    let mut reader = follower.listener.world.reader();
    let mut left = wanted.count.unwrap_or(u64::MAX);
    while left > 0 {
        match follower.turn()? {
            Turn::Same => {}
            Turn::Restarted => reader = follower.listener.world.reader(),
            Turn::Interrupted => break,
        }
        if let Some(news) = follower.listener.world.news(&mut reader) {
            print(&news, wanted, &mut left)?;
        }
    }
    Ok(0)
}

fn print(news: &News, wanted: &Wanted, left: &mut u64) -> Result<(), Failure> {
    for change in &news.changes {
        let (of, element) = match change {
            Change::NodeRemoved(node, _) => (&news.before, Element::Node(*node)),
            Change::EdgeRemoved(edge, _) => (&news.before, Element::Edge(*edge)),
            Change::NodeAdded(node) => (&news.after, Element::Node(*node)),
            Change::EdgeAdded(edge) => (&news.after, Element::Edge(*edge)),
            Change::Attribute(element, _) => (&news.after, *element),
        };
        let (kind, name) = (kind(of, element), word(of, element));
        let is_meant = |word: &String| of.schema().is_a(kind, word) || *word == name;
        if !wanted.words.is_empty() && !wanted.words.iter().any(is_meant) {
            continue;
        }
        if *left == 0 {
            return Ok(());
        }
        *left -= 1;
        let time_s = news.after.time().as_nanos() as f64 / 1e9;
        match (change, wanted.format) {
            (Change::Attribute(_, symbol), format) => {
                let attribute = news.after.text(*symbol);
                let before = news.before.get(element, attribute);
                let after = news.after.get(element, attribute);
                match format {
                    Format::Human => {
                        let shown = |value| match value {
                            Some(value) => shown(value),
                            None => "no value".to_owned(),
                        };
                        let (before, after) = (shown(before), shown(after));
                        print_line(format_args!(
                            "{time_s:.3}  {} {name}.{} = {after}, was {before}",
                            clean(kind),
                            clean(attribute)
                        ));
                    }
                    Format::Json => print_json(&json!({
                        "time_s": time_s, "change": "changed", "element": name, "type": kind,
                        "attribute": attribute,
                        "before": before.map(json_of), "after": after.map(json_of),
                    }))?,
                }
            }
            (change, format) => {
                let is_new = matches!(change, Change::NodeAdded(_) | Change::EdgeAdded(_));
                let verb = if is_new { "added" } else { "removed" };
                match format {
                    Format::Human if is_new => {
                        let text = text(of, element);
                        print_line(format_args!("{time_s:.3}  added {}", text.trim_end()));
                    }
                    Format::Human => {
                        print_line(format_args!("{time_s:.3}  removed {} {name}", clean(kind)));
                    }
                    Format::Json => {
                        let mut object = document(of, element);
                        object["time_s"] = json!(time_s);
                        object["change"] = json!(verb);
                        print_json(&object)?;
                    }
                }
            }
        }
    }
    Ok(())
}
