//! Joints that follow each other.

use rc_diagnostics::{Name, Span};
use std::collections::{BTreeMap, BTreeSet};

/// The circles among joints, each with its place and a message. `leaders` has the leader of each
/// joint that follows one.
pub(crate) fn circles(leaders: &BTreeMap<String, Name>) -> Vec<(Span, String)> {
    let mut found = Vec::new();
    let mut done: BTreeSet<&str> = BTreeSet::new();
    for start in leaders.keys() {
        let mut path: Vec<(&str, &Name)> = Vec::new();
        let mut places: BTreeMap<&str, usize> = BTreeMap::new();
        let mut at = start.as_str();
        while !done.contains(at) {
            let Some((joint, leader)) = leaders.get_key_value(at) else {
                break;
            };
            if let Some(place) = places.insert(joint, path.len()) {
                let circle = &path[place..];
                let names = circle
                    .iter()
                    .map(|(_, leader)| format!("`{}`", leader.text));
                let names: Vec<String> = names.collect();
                let message = format!(
                    "`{joint}` follows {}: no joint leads",
                    names.join(", which follows ")
                );
                found.extend(circle.first().map(|(_, leader)| (leader.span, message)));
                break;
            }
            path.push((joint, leader));
            at = &leader.text;
        }
        done.extend(path.iter().map(|(joint, _)| *joint));
    }
    found
}
