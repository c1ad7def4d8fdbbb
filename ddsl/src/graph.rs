//! Algorithms on directed graphs. `next[n]` are the successors of node `n`.

/// Cycles that share no nodes, each in the order of its edges. Finds at least one if there is any.
/// Their total length is at most that of the graph.
pub(crate) fn cycles(next: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut cycles = Vec::new();
    let mut reported = vec![false; next.len()];
    let mut seen = vec![false; next.len()];
    // The index of each node on the current path.
    let mut position: Vec<Option<usize>> = vec![None; next.len()];
    for start in 0..next.len() {
        if seen[start] {
            continue;
        }
        // The nodes of the path, each with the number of edges followed. It is explicit because a
        // chain may be too long for recursion.
        seen[start] = true;
        position[start] = Some(0);
        let mut path = vec![(start, 0)];
        while let Some((node, taken)) = path.last_mut() {
            let Some(step) = next[*node].get(*taken).copied() else {
                position[*node] = None;
                path.pop();
                continue;
            };
            *taken += 1;
            if let Some(at) = position[step] {
                let cycle: Vec<usize> = path[at..].iter().map(|(node, _)| *node).collect();
                if !cycle.iter().any(|node| reported[*node]) {
                    cycle.iter().for_each(|node| reported[*node] = true);
                    cycles.push(cycle);
                }
            } else if !seen[step] {
                seen[step] = true;
                position[step] = Some(path.len());
                path.push((step, 0));
            }
        }
    }
    cycles
}

/// For each node, the number of its strongly connected component.
pub(crate) fn strongly_connected_components(next: &[Vec<usize>]) -> Vec<usize> {
    // Kosaraju's algorithm.
    let mut post_order = Vec::with_capacity(next.len());
    let mut seen = vec![false; next.len()];
    for start in 0..next.len() {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let mut path = vec![(start, 0)];
        while let Some((node, taken)) = path.last_mut() {
            let Some(step) = next[*node].get(*taken).copied() else {
                post_order.push(*node);
                path.pop();
                continue;
            };
            *taken += 1;
            if !std::mem::replace(&mut seen[step], true) {
                path.push((step, 0));
            }
        }
    }
    let mut reversed = vec![Vec::new(); next.len()];
    for (node, steps) in next.iter().enumerate() {
        steps.iter().for_each(|step| reversed[*step].push(node));
    }
    let mut components: Vec<Option<usize>> = vec![None; next.len()];
    for start in post_order.into_iter().rev() {
        let mut pending = vec![start];
        while let Some(node) = pending.pop() {
            if components[node].is_none() {
                components[node] = Some(start);
                pending.extend(reversed[node].iter().copied());
            }
        }
    }
    components
        .into_iter()
        .map(|component| component.unwrap_or(0))
        .collect()
}

/// The shortest path between two nodes.
pub(crate) fn shortest_path(next: &[Vec<usize>], from: usize, to: usize) -> Vec<usize> {
    let mut previous: Vec<Option<usize>> = vec![None; next.len()];
    let mut pending = std::collections::VecDeque::from([from]);
    while let Some(node) = pending.pop_front() {
        if node == to {
            break;
        }
        for step in next[node].iter().copied() {
            if previous[step].is_none() && step != from {
                previous[step] = Some(node);
                pending.push_back(step);
            }
        }
    }
    let mut path: Vec<usize> = std::iter::successors(Some(to), |node| previous[*node]).collect();
    path.reverse();
    path
}

#[cfg(test)]
mod tests {
    use super::{cycles, shortest_path, strongly_connected_components};

    #[test]
    fn nodes_of_one_part_lead_to_each_other() {
        let next = [vec![1], vec![2, 3], vec![], vec![0, 4], vec![5], vec![4]];
        let found = strongly_connected_components(&next);
        assert_eq!((found[0], found[0]), (found[1], found[3]));
        assert_eq!(found[4], found[5]);
        assert!(found[2] != found[0] && found[4] != found[0] && found[2] != found[4]);
        assert_eq!(shortest_path(&next, 0, 5), [0, 1, 3, 4, 5]);
    }

    #[test]
    fn a_circle_is_found_however_it_is_reached() {
        let next = [vec![1], vec![2, 3], vec![], vec![1, 4], vec![4]];
        assert_eq!(cycles(&next), [vec![1, 3], vec![4]]);
        assert!(cycles(&[vec![1, 2], vec![2], vec![]]).is_empty());
    }

    #[test]
    fn a_long_chain_needs_no_stack() {
        let count = 200_000;
        let next: Vec<Vec<usize>> = (0..count).map(|n| vec![(n + 1) % count]).collect();
        assert_eq!(cycles(&next)[0].len(), count);
    }
}
