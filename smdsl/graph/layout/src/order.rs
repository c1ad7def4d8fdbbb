//! Orders the elements of columns so that few lines cross.

use crate::elements::{ColumnItem, Element, Layers, Touch};

/// How often all columns are sorted.
const SWEEPS: usize = 24;

/// One end of a line that an element has, as seen from it.
#[derive(Clone, Copy)]
struct Neighbour {
    element: usize,
    /// Where the line touches this element, and the other one: 0 at the upper edge, 1 at the lower
    /// one.
    own: f64,
    other: f64,
}

/// The lines of each element.
struct Lines {
    /// To the column before.
    before: Vec<Vec<Neighbour>>,
    /// To the next column.
    behind: Vec<Vec<Neighbour>>,
    /// Within its own column, where a line turns round.
    beside: Vec<Vec<usize>>,
}

/// Sorts the columns.
pub(crate) fn order(layers: &mut Layers) {
    let lines = Lines::new(layers);
    let mut best = layers.columns.clone();
    let mut fewest = crossings(&lines, &layers.elements, &best);
    for start_forward in [true, false] {
        let mut columns = layers.columns.clone();
        for sweep in 0..SWEEPS {
            let forward = (sweep % 2 == 0) == start_forward;
            let count = columns.len();
            for step in 0..count {
                let at = if forward { step } else { count - 1 - step };
                sort(&lines, &mut columns, at, forward);
            }
            swap_neighbours(&lines, &layers.elements, &mut columns);
            let now = crossings(&lines, &layers.elements, &columns);
            if now < fewest {
                fewest = now;
                best.clone_from(&columns);
            }
        }
    }
    layers.columns = best;
}

impl Lines {
    fn new(layers: &Layers) -> Self {
        let count = layers.elements.len();
        let mut lines = Self {
            before: vec![Vec::new(); count],
            behind: vec![Vec::new(); count],
            beside: vec![Vec::new(); count],
        };
        let part = |touch: Touch, right| {
            let element = &layers.elements[touch.element];
            match element.what {
                ColumnItem::Lane { .. } => 0.5,
                ColumnItem::Item(_) => {
                    f64::from(layers.offset(touch, right)) / f64::from(element.height.max(1))
                }
            }
        };
        for wire in layers.gaps.iter().flatten() {
            for left in &wire.left {
                for right in &wire.right {
                    let (own, other) = (part(*left, true), part(*right, false));
                    lines.behind[left.element].push(Neighbour {
                        element: right.element,
                        own,
                        other,
                    });
                    lines.before[right.element].push(Neighbour {
                        element: left.element,
                        own: other,
                        other: own,
                    });
                }
            }
            for side in [&wire.left, &wire.right] {
                for one in side {
                    let is_back = |t: usize| {
                        matches!(layers.elements[t].what, ColumnItem::Lane { back: true, .. })
                    };
                    for other in side.iter().filter(|o| o.element != one.element) {
                        if is_back(one.element) || is_back(other.element) {
                            lines.beside[one.element].push(other.element);
                        }
                    }
                }
            }
        }
        lines
    }
}

/// The place of each element in its column.
fn positions(columns: &[Vec<usize>], count: usize) -> Vec<f64> {
    let mut positions = vec![0.0; count];
    for column in columns {
        for (at, element) in column.iter().enumerate() {
            positions[*element] = at as f64;
        }
    }
    positions
}

/// Sorts one column by the mean place of what its elements are connected to; those with no lines
/// stay.
fn sort(lines: &Lines, columns: &mut [Vec<usize>], at: usize, forward: bool) {
    let positions = positions(columns, lines.before.len());
    let side = if forward {
        &lines.before
    } else {
        &lines.behind
    };
    let mean = |element: usize| {
        let there = side[element].iter();
        let there = there.map(|n| positions[n.element] + n.other - n.own);
        let here = lines.beside[element].iter().map(|n| positions[*n] + 0.25);
        let all: Vec<f64> = there.chain(here).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    let column = &columns[at];
    let mut wanted: Vec<(f64, usize)> = column
        .iter()
        .filter_map(|e| mean(*e).map(|m| (m, *e)))
        .collect();
    wanted.sort_by(|one, other| one.0.total_cmp(&other.0));
    let mut sorted = wanted.into_iter().map(|(_, element)| element);
    let column = column.iter().map(|element| {
        if mean(*element).is_some() {
            sorted.next().unwrap_or(*element)
        } else {
            *element
        }
    });
    columns[at] = column.collect();
}

/// How often the lines of `upper` cross those of `lower`, which is below it.
fn between(lines: &[Vec<Neighbour>], position: &[f64], upper: usize, lower: usize) -> usize {
    let place = |n: &Neighbour| position[n.element] + n.other * 0.9;
    let crossed = |one: &Neighbour| {
        let others = lines[lower].iter();
        others.filter(|other| place(one) > place(other)).count()
    };
    lines[upper].iter().map(crossed).sum()
}

fn swap_neighbours(lines: &Lines, elements: &[Element], columns: &mut [Vec<usize>]) {
    for _ in 0..8 {
        let mut better = false;
        for at in 0..columns.len() {
            let position = positions(columns, elements.len());
            for row in 1..columns[at].len() {
                let (upper, lower) = (columns[at][row - 1], columns[at][row]);
                let cost = |upper, lower| {
                    between(&lines.before, &position, upper, lower)
                        + between(&lines.behind, &position, upper, lower)
                };
                if cost(lower, upper) < cost(upper, lower) {
                    columns[at].swap(row - 1, row);
                    better = true;
                }
            }
        }
        if !better {
            break;
        }
    }
}

/// The crossings of a whole order; a line that turns round crosses everything between.
fn crossings(lines: &Lines, elements: &[Element], columns: &[Vec<usize>]) -> usize {
    let position = positions(columns, elements.len());
    let mut count = 0;
    for column in columns {
        // All lines of the next gap, in the order of their beginnings: how many pairs end in
        // another order.
        let mut ends: Vec<(f64, f64)> = column
            .iter()
            .flat_map(|e| {
                let place = position[*e];
                let line = lines.behind[*e].iter();
                line.map(move |n| (place + n.own * 0.9, n.element, n.other))
            })
            .map(|(own, element, other)| (own, position[element] + other * 0.9))
            .collect();
        ends.sort_by(|one, other| one.0.total_cmp(&other.0));
        for (at, one) in ends.iter().enumerate() {
            let later = ends[at + 1..].iter();
            count += later
                .filter(|other| one.0 < other.0 && one.1 > other.1)
                .count();
        }
        for element in column {
            for other in &lines.beside[*element] {
                let distance = (position[*element] - position[*other]).abs();
                count += distance as usize / 2;
            }
        }
    }
    count
}
