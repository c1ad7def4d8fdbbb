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

#[cfg(test)]
mod tests {
    use super::circles;

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
