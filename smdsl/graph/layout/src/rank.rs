//! Assigns each item to a column.

use crate::elements::{Item, LevelNet};
use std::collections::{BTreeMap, BTreeSet};

/// No column is folded that is lower than this.
const LEAST_LIMIT: i32 = 800;

/// The column of each item, from 0: that of a source before those of its targets, as far as circles
/// allow.
pub(crate) fn ranks(items: &[Item], nets: &[LevelNet]) -> Vec<usize> {
    let count = items.len();
    let mut edges: Vec<(usize, usize)> = nets
        .iter()
        .flat_map(|net| {
            let targets = net.targets.iter().flatten().map(|(item, _)| *item);
            let source = net.source.map(|(item, _)| item);
            targets.filter_map(move |to| source.map(|from| (from, to)))
        })
        .filter(|(from, to)| from != to)
        .collect();
    // Circles are broken by turning the fewest edges round that a greedy order leaves wrong.
    let mut position = vec![0; count];
    for (at, item) in greedy(count, &edges).into_iter().enumerate() {
        position[item] = at;
    }
    for edge in &mut edges {
        if position[edge.0] > position[edge.1] {
            *edge = (edge.1, edge.0);
        }
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|item| position[*item]);
    let mut before = vec![Vec::new(); count];
    let mut after = vec![Vec::new(); count];
    for (from, to) in &edges {
        before[*to].push(*from);
        after[*from].push(*to);
    }
    let mut rank = vec![0_usize; count];
    for item in &order {
        rank[*item] = before[*item]
            .iter()
            .map(|b| rank[*b] + 1)
            .max()
            .unwrap_or(0);
    }
    let last = rank.iter().copied().max().unwrap_or(0);
    // Lines from and to the border pull, too.
    let mut pull = vec![0_i32; count];
    for net in nets {
        for target in &net.targets {
            match (net.source, target) {
                (None, Some((item, _))) => pull[*item] -= 1,
                (Some((item, _)), None) => pull[item] += 1,
                _ => {}
            }
        }
    }
    // Each step shortens the lines, so that this ends; the limit is for those who doubt it.
    for _ in 0..count + 2 {
        let mut moved = false;
        for item in order.iter().rev().copied() {
            let force = after[item].len() as i32 - before[item].len() as i32 + pull[item];
            let lowest = before[item].iter().map(|b| rank[*b] + 1).max().unwrap_or(0);
            let highest = after[item]
                .iter()
                .map(|a| rank[*a] - 1)
                .min()
                .unwrap_or(last);
            let wanted = match force {
                1.. => highest,
                ..0 => lowest,
                0 => continue,
            };
            moved |= wanted != rank[item];
            rank[item] = wanted;
        }
        if !moved {
            break;
        }
    }
    folded(items, &rank)
}

/// Removes empty columns, and breaks a column that is far higher than the picture is wide into
/// several.
fn folded(items: &[Item], rank: &[usize]) -> Vec<usize> {
    let room = |item: &Item| f64::from(item.width + 60) * f64::from(item.height + 30);
    let area: f64 = items.iter().map(room).sum();
    let limit = ((area * 1.5).sqrt() as i32).max(LEAST_LIMIT);
    let mut columns: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (item, rank) in rank.iter().enumerate() {
        columns.entry(*rank).or_default().push(item);
    }
    let mut out = vec![0; items.len()];
    let mut column = 0;
    for members in columns.into_values() {
        let height = |item: &usize| items[*item].height + 22;
        let whole: i32 = members.iter().map(height).sum();
        // As many as are needed, all of one height.
        let parts = (whole + limit - 1) / limit;
        let mut above = 0;
        for item in &members {
            let middle = above + height(item) / 2;
            out[*item] = column + (middle * parts / whole) as usize;
            above += height(item);
        }
        column += parts as usize;
    }
    compact(&out)
}

/// Numbers in the place of numbers: none is left out, their order stays.
fn compact(ranks: &[usize]) -> Vec<usize> {
    let used: BTreeSet<usize> = ranks.iter().copied().collect();
    let used: Vec<usize> = used.into_iter().collect();
    ranks
        .iter()
        .map(|r| used.binary_search(r).unwrap_or(0))
        .collect()
}

/// An order in which few edges lead backwards (Eades, Lin, Smyth 1993).
fn greedy(count: usize, edges: &[(usize, usize)]) -> Vec<usize> {
    let mut out = vec![Vec::new(); count];
    let mut into = vec![Vec::new(); count];
    for (from, to) in edges {
        out[*from].push(*to);
        into[*to].push(*from);
    }
    let mut outs: Vec<usize> = out.iter().map(Vec::len).collect();
    let mut ins: Vec<usize> = into.iter().map(Vec::len).collect();
    let mut left: Vec<usize> = (0..count).collect();
    let (mut front, mut back) = (Vec::new(), Vec::new());
    while !left.is_empty() {
        let sink = left.iter().position(|i| outs[*i] == 0);
        let source = || left.iter().position(|i| ins[*i] == 0);
        let (at, to_back) = match (sink, source) {
            (Some(at), _) => (at, true),
            (None, source) => {
                let best = |i: &usize| outs[*i] as i64 - ins[*i] as i64;
                let top = left.iter().map(best).max();
                let best = || left.iter().position(|i| Some(best(i)) == top);
                (source().or_else(best).unwrap_or(0), false)
            }
        };
        let item = left.remove(at);
        out[item].iter().for_each(|to| ins[*to] -= 1);
        into[item].iter().for_each(|from| outs[*from] -= 1);
        if to_back {
            back.push(item);
        } else {
            front.push(item);
        }
    }
    front.extend(back.into_iter().rev());
    front
}
