//! Joints that form a cycle of links.

use crate::Edge;
use rc_diagnostics::Span;
use std::collections::{HashMap, HashSet};

/// The most joints that a message names.
const MOST_NAMES: usize = 5;

/// The cycles among links that have at most one joint above them, each with the place of its last joint and a
/// message.
pub(crate) fn cycles(joints: &[Edge<'_>]) -> Vec<(Span, String)> {
    let above = joints.iter().enumerate();
    let above: HashMap<&str, usize> = above.map(|(at, edge)| (&*edge.child.text, at)).collect();
    let mut found = Vec::new();
    let mut done: HashSet<usize> = HashSet::new();
    for start in 0..joints.len() {
        let mut path: Vec<usize> = Vec::new();
        let mut places: HashMap<usize, usize> = HashMap::new();
        let mut next = Some(start);
        while let Some(at) = next.filter(|at| !done.contains(at)) {
            if let Some(place) = places.insert(at, path.len()) {
                let mut cycle = path[place..].to_vec();
                cycle.sort_unstable();
                found.extend(described(joints, &cycle));
                break;
            }
            path.push(at);
            next = above.get(&*joints[at].parent.text).copied();
        }
        done.extend(path);
    }
    found
}

fn described(joints: &[Edge<'_>], cycle: &[usize]) -> Option<(Span, String)> {
    let last = &joints[*cycle.last()?].name;
    let names = cycle.iter().take(MOST_NAMES);
    let names: Vec<String> = names
        .map(|at| format!("`{}`", joints[*at].name.text))
        .collect();
    let message = match cycle.len() {
        1 => format!("the joint {} moves a link in itself", names[0]),
        count if count > MOST_NAMES => format!(
            "the joints {} and {} others form a cycle",
            names.join(", "),
            count - MOST_NAMES
        ),
        _ => format!("the joints {} form a cycle", names.join(", ")),
    };
    Some((last.span, message))
}
