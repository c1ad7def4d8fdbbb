//! The vertical positions of elements: their order is kept, and lines are as straight as possible.

use crate::elements::{ColumnItem, Layers};

/// Between two boxes, a box and a line, and two lines.
const BOXES: i32 = 22;
const BOX_AND_LINE: i32 = 14;
const LINES: i32 = 10;

/// No element is moved further than this for the sake of a straight line.
const FAR: i32 = 40;

/// A line to another element: where that is if it is straight, and how much that counts.
struct Pull {
    element: usize,
    /// The other's upper edge plus this is the own upper edge, if the line is straight.
    shift: i32,
    weight: f64,
}

/// Sets `y` of all elements; the least is 0.
pub(crate) fn place(layers: &mut Layers) {
    let (before, behind) = pulls(layers);
    for column in layers.columns.clone() {
        let mut y = 0;
        for (row, element) in column.iter().enumerate() {
            if row > 0 {
                y += distance(layers, column[row - 1], *element);
            }
            layers.elements[*element].y = y;
        }
    }
    let count = layers.columns.len();
    for _ in 0..10 {
        for at in 0..count {
            settle(layers, at, &[&before]);
        }
        for at in (0..count).rev() {
            settle(layers, at, &[&behind]);
        }
    }
    for _ in 0..6 {
        for at in (0..count).chain((0..count).rev()) {
            settle(layers, at, &[&before, &behind]);
        }
    }
    for _ in 0..4 {
        for at in 0..count {
            straighten(layers, at, &before, &behind);
        }
    }
    let top = layers.elements.iter().map(|e| e.y).min().unwrap_or(0);
    layers.elements.iter_mut().for_each(|e| e.y -= top);
}

/// From the upper edge of one element to that of the next one, at least.
fn distance(layers: &Layers, upper: usize, lower: usize) -> i32 {
    let item = |e: usize| matches!(layers.elements[e].what, ColumnItem::Item(_));
    let room = match (item(upper), item(lower)) {
        (true, true) => BOXES,
        (false, false) => LINES,
        _ => BOX_AND_LINE,
    };
    layers.elements[upper].height + room
}

/// For each element its lines to the previous column, and to the next one.
fn pulls(layers: &Layers) -> (Vec<Vec<Pull>>, Vec<Vec<Pull>>) {
    let count = layers.elements.len();
    let mut before: Vec<Vec<Pull>> = Vec::new();
    before.resize_with(count, Vec::new);
    let mut behind: Vec<Vec<Pull>> = Vec::new();
    behind.resize_with(count, Vec::new);
    let lane = |e: usize| matches!(layers.elements[e].what, ColumnItem::Lane { .. });
    for wire in layers.gaps.iter().flatten() {
        for left in &wire.left {
            for right in &wire.right {
                let weight = match (lane(left.element), lane(right.element)) {
                    (true, true) => 8.0,
                    (false, false) => 1.0,
                    _ => 2.0,
                };
                let shift = layers.offset(*left, true) - layers.offset(*right, false);
                before[right.element].push(Pull {
                    element: left.element,
                    shift,
                    weight,
                });
                behind[left.element].push(Pull {
                    element: right.element,
                    shift: -shift,
                    weight,
                });
            }
        }
    }
    (before, behind)
}

/// Moves the elements of a column to where they are pulled, as near as their order and their room
/// allow.
fn settle(layers: &mut Layers, at: usize, pulls: &[&Vec<Vec<Pull>>]) {
    let column = layers.columns[at].clone();
    let mut offsets = Vec::with_capacity(column.len());
    let mut sum = 0;
    for (row, element) in column.iter().enumerate() {
        if row > 0 {
            sum += distance(layers, column[row - 1], *element);
        }
        offsets.push(sum);
    }
    // Groups that are as close together as allowed, each at the mean of the wishes of its elements.
    let mut groups: Vec<(f64, f64, usize)> = Vec::new();
    for (element, offset) in column.iter().zip(&offsets) {
        let (wanted, weight) = wish(layers, *element, pulls);
        let mut group = (f64::from(wanted - offset), weight, 1);
        while let Some(last) = groups.last().copied().filter(|last| last.0 > group.0) {
            let weight = last.1 + group.1;
            let mean = (last.0 * last.1 + group.0 * group.1) / weight;
            group = (mean, weight, last.2 + group.2);
            groups.pop();
        }
        groups.push(group);
    }
    let places = groups
        .iter()
        .flat_map(|(place, _, count)| std::iter::repeat_n(place.round() as i32, *count));
    for ((element, offset), place) in column.iter().zip(&offsets).zip(places) {
        layers.elements[*element].y = place + offset;
    }
}

/// Where an element would have its middle line straight, and how much it wants that.
fn wish(layers: &Layers, element: usize, pulls: &[&Vec<Vec<Pull>>]) -> (i32, f64) {
    let mut all: Vec<(i32, f64)> = pulls
        .iter()
        .flat_map(|p| &p[element])
        .map(|p| (layers.elements[p.element].y + p.shift, p.weight))
        .collect();
    if all.is_empty() {
        return (layers.elements[element].y, 0.05);
    }
    all.sort_by_key(|(y, _)| *y);
    let total: f64 = all.iter().map(|(_, w)| w).sum();
    let mut sum = 0.0;
    let median = all.iter().find(|(_, weight)| {
        sum += weight;
        sum * 2.0 >= total
    });
    (median.map_or(0, |(y, _)| *y), total)
}

/// Moves each element, within the room that its neighbours leave, to where most of its lines are
/// straight.
fn straighten(layers: &mut Layers, at: usize, before: &[Vec<Pull>], behind: &[Vec<Pull>]) {
    let column = layers.columns[at].clone();
    for (row, element) in column.iter().copied().enumerate() {
        let y = |e: usize| layers.elements[e].y;
        let above = row.checked_sub(1).map(|r| column[r]);
        let lowest = above.map(|upper| y(upper) + distance(layers, upper, element));
        let below = column.get(row + 1).copied();
        let highest = below.map(|lower| y(lower) - distance(layers, element, lower));
        let lines = || before[element].iter().chain(&behind[element]);
        let straight = |place: i32| -> f64 {
            let fitting = lines().filter(|p| y(p.element) + p.shift == place);
            fitting.map(|p| p.weight).sum()
        };
        let own = y(element);
        let mut best = (straight(own), 0, own);
        for pull in lines() {
            let place = y(pull.element) + pull.shift;
            let near = (place - own).abs() <= FAR;
            let fits = near
                && lowest.is_none_or(|low| place >= low)
                && highest.is_none_or(|high| place <= high);
            let rated = (straight(place), -(place - own).abs(), place);
            if fits && rated > best {
                best = rated;
            }
        }
        layers.elements[element].y = best.2;
    }
}
