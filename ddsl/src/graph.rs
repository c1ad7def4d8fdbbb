//! Circles in a graph.

/// Circles of the graph in which `next[n]` are the nodes that node `n` leads to; each circle in the order of its
/// steps, the last of which leads back to its first node. No two of them share a node, so that all together are no
/// longer than the graph; where there is any circle, at least one is found.
pub(crate) fn circles(next: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut circles = Vec::new();
    let mut reported = vec![false; next.len()];
    let mut seen = vec![false; next.len()];
    // Where a node stands on the way, while it does.
    let mut position: Vec<Option<usize>> = vec![None; next.len()];
    for start in 0..next.len() {
        if seen[start] {
            continue;
        }
        // The nodes on the way, each with how many of its steps were taken. No recursion: a chain may be longer
        // than a stack.
        seen[start] = true;
        position[start] = Some(0);
        let mut way = vec![(start, 0)];
        while let Some((node, taken)) = way.last_mut() {
            let Some(step) = next[*node].get(*taken).copied() else {
                position[*node] = None;
                way.pop();
                continue;
            };
            *taken += 1;
            if let Some(at) = position[step] {
                let circle: Vec<usize> = way[at..].iter().map(|(node, _)| *node).collect();
                if !circle.iter().any(|node| reported[*node]) {
                    circle.iter().for_each(|node| reported[*node] = true);
                    circles.push(circle);
                }
            } else if !seen[step] {
                seen[step] = true;
                position[step] = Some(way.len());
                way.push((step, 0));
            }
        }
    }
    circles
}

/// For each node the number of its part: nodes that lead to each other, directly or through others, have one part.
pub(crate) fn parts(next: &[Vec<usize>]) -> Vec<usize> {
    // Kosaraju: in the reverse order of their ends, what leads to a node and was not taken yet belongs to it.
    let mut ended = Vec::with_capacity(next.len());
    let mut seen = vec![false; next.len()];
    for start in 0..next.len() {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let mut way = vec![(start, 0)];
        while let Some((node, taken)) = way.last_mut() {
            let Some(step) = next[*node].get(*taken).copied() else {
                ended.push(*node);
                way.pop();
                continue;
            };
            *taken += 1;
            if !std::mem::replace(&mut seen[step], true) {
                way.push((step, 0));
            }
        }
    }
    let mut before = vec![Vec::new(); next.len()];
    for (node, steps) in next.iter().enumerate() {
        steps.iter().for_each(|step| before[*step].push(node));
    }
    let mut parts: Vec<Option<usize>> = vec![None; next.len()];
    for start in ended.into_iter().rev() {
        let mut left = vec![start];
        while let Some(node) = left.pop() {
            if parts[node].is_none() {
                parts[node] = Some(start);
                left.extend(before[node].iter().copied());
            }
        }
    }
    parts.into_iter().map(|part| part.unwrap_or(0)).collect()
}

/// The shortest way from one node to another.
pub(crate) fn way(next: &[Vec<usize>], from: usize, to: usize) -> Vec<usize> {
    let mut came: Vec<Option<usize>> = vec![None; next.len()];
    let mut left = std::collections::VecDeque::from([from]);
    while let Some(node) = left.pop_front() {
        if node == to {
            break;
        }
        for step in next[node].iter().copied() {
            if came[step].is_none() && step != from {
                came[step] = Some(node);
                left.push_back(step);
            }
        }
    }
    let mut way: Vec<usize> = std::iter::successors(Some(to), |node| came[*node]).collect();
    way.reverse();
    way
}

#[cfg(test)]
mod tests {
    use super::{circles, parts, way};

    #[test]
    fn nodes_of_one_part_lead_to_each_other() {
        let next = [vec![1], vec![2, 3], vec![], vec![0, 4], vec![5], vec![4]];
        let found = parts(&next);
        assert_eq!((found[0], found[0]), (found[1], found[3]));
        assert_eq!(found[4], found[5]);
        assert!(found[2] != found[0] && found[4] != found[0] && found[2] != found[4]);
        assert_eq!(way(&next, 0, 5), [0, 1, 3, 4, 5]);
    }

    #[test]
    fn a_circle_is_found_however_it_is_reached() {
        let next = [vec![1], vec![2, 3], vec![], vec![1, 4], vec![4]];
        assert_eq!(circles(&next), [vec![1, 3], vec![4]]);
        assert!(circles(&[vec![1, 2], vec![2], vec![]]).is_empty());
    }

    #[test]
    fn a_long_chain_needs_no_stack() {
        let count = 200_000;
        let next: Vec<Vec<usize>> = (0..count).map(|n| vec![(n + 1) % count]).collect();
        assert_eq!(circles(&next)[0].len(), count);
    }
}
