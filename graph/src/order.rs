//! The order in which edges can be added that start or end at other edges.

use crate::element::Id;
use std::collections::HashMap;

/// The order of edges, given by their ids and ends, in which each comes after those at its ends;
/// otherwise as they were given. `is_there` says which ids need not be waited for. Edges that lead
/// nowhere, or form cycles, are in the second list.
pub fn in_order(
    edges: &[(Option<Id>, [Id; 2])],
    is_there: impl Fn(Id) -> bool,
) -> (Vec<usize>, Vec<usize>) {
    let mut waiting: HashMap<Id, Vec<usize>> = HashMap::new();
    let mut missing = vec![0_u8; edges.len()];
    let mut order = Vec::with_capacity(edges.len());
    for (at, (_, ends)) in edges.iter().enumerate() {
        for end in ends.iter().filter(|end| !is_there(**end)) {
            waiting.entry(*end).or_default().push(at);
            missing[at] += 1;
        }
        if missing[at] == 0 {
            order.push(at);
        }
    }
    let mut next = 0;
    while let Some(at) = order.get(next) {
        next += 1;
        let freed = edges[*at].0.and_then(|id| waiting.remove(&id));
        for at in freed.into_iter().flatten() {
            missing[at] -= 1;
            if missing[at] == 0 {
                order.push(at);
            }
        }
    }
    let rest = (0..edges.len()).filter(|at| missing[*at] > 0);
    let rest = rest.collect();
    (order, rest)
}
