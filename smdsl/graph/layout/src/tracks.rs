//! Where lines run up and down in the gaps between the columns.

use crate::elements::{ColumnItem, Layers, Touch, Wire};

/// Between two parallel lines.
const SPACING: i32 = 8;
/// Between a column and the line next to it: room for an arrowhead.
const ROOM: i32 = 18;
/// Between two columns, at least.
const LEAST: i32 = 44;
/// Between a column and a border that no line reaches.
const BORDER: i32 = 16;
/// Lines that are nearer than this are seen as one.
const NEAR: i32 = 4;

/// The width of a gap.
pub(crate) fn width(layers: &Layers, gap: usize) -> i32 {
    let wires = &layers.gaps[gap];
    let last = layers.columns.len() - 1;
    let outer = gap == 0 || gap + 1 == last;
    if outer && wires.is_empty() {
        // A part that reaches no border reserves no room for it.
        let reaches = !(layers.columns[0].is_empty() && layers.columns[last].is_empty());
        return if reaches { BORDER } else { 0 };
    }
    let furthest = wires.iter().map(|w| w.x).max().unwrap_or(0);
    (furthest + ROOM).max(if outer { 2 * ROOM } else { LEAST })
}

/// How many rounds move overlapping lines.
const ROUNDS: usize = 4;
/// How far an overlapping line is moved.
const FURTHEST: i32 = 14;

/// Assigns each wire its track, and moves overlapping lines.
pub(crate) fn assign(layers: &mut Layers) {
    // Moving in one gap may cause an overlap in the previous one.
    for _ in 0..ROUNDS {
        for gap in 0..layers.gaps.len() {
            let order = sorted(layers, gap);
            separate(layers, gap, &order);
        }
    }
    for gap in 0..layers.gaps.len() {
        let order = sorted(layers, gap);
        let mut xs: Vec<(usize, i32)> = Vec::new();
        for wire in order {
            let (low, high) = span(layers, &layers.gaps[gap][wire]);
            let beside = xs.iter().filter(|(other, _)| {
                let (from, to) = span(layers, &layers.gaps[gap][*other]);
                from <= high + NEAR && low <= to + NEAR
            });
            let x = beside.map(|(_, x)| x + SPACING).max().unwrap_or(ROOM);
            xs.push((wire, x));
        }
        // Few lines are in the middle of a gap that is wider than they need.
        let furthest = xs.iter().map(|(_, x)| *x).max().unwrap_or(ROOM);
        let shift = (LEAST - furthest - ROOM).max(0) / 2;
        let outer = gap == 0 || gap + 2 == layers.columns.len();
        for (wire, x) in xs {
            layers.gaps[gap][wire].x = x + if outer { 0 } else { shift };
        }
    }
}

/// Where the lines of a wire touch the previous and the next column.
fn ends(layers: &Layers, wire: &Wire) -> (Vec<i32>, Vec<i32>) {
    let left = wire.left.iter().map(|t| layers.y(*t, true));
    let right = wire.right.iter().map(|t| layers.y(*t, false));
    (left.collect(), right.collect())
}

/// From where to where a wire runs up and down.
fn span(layers: &Layers, wire: &Wire) -> (i32, i32) {
    let (left, right) = ends(layers, wire);
    let all = || left.iter().chain(&right).copied();
    (all().min().unwrap_or(0), all().max().unwrap_or(0))
}

/// The cost if the first wire runs left of the second one.
fn cost(one: &(Vec<i32>, Vec<i32>), other: &(Vec<i32>, Vec<i32>)) -> usize {
    let crossing = |ys: &[i32], of: &(Vec<i32>, Vec<i32>)| {
        let all = || of.0.iter().chain(&of.1).copied();
        let (low, high) = (all().min().unwrap_or(0), all().max().unwrap_or(0));
        let within = ys
            .iter()
            .filter(|y| low <= **y && **y <= high && low < high);
        within.count()
    };
    let upon = one
        .1
        .iter()
        .flat_map(|y| other.0.iter().map(move |z| (y, z)));
    let upon = upon.filter(|(y, z)| (*y - *z).abs() < NEAR).count();
    crossing(&one.1, other) + crossing(&other.0, one) + 50 * upon
}

/// The wires of a gap from left to right, so that they cross little: each in turn goes to its best
/// place.
fn sorted(layers: &Layers, gap: usize) -> Vec<usize> {
    let wires = &layers.gaps[gap];
    let ends: Vec<_> = wires.iter().map(|w| ends(layers, w)).collect();
    let mut order: Vec<usize> = (0..wires.len()).collect();
    for _ in 0..6 {
        let mut moved = false;
        for wire in 0..wires.len() {
            let Some(at) = order.iter().position(|w| *w == wire) else {
                continue;
            };
            order.remove(at);
            // The cost of all places, from that before all others on.
            let mut sum: i64 = order
                .iter()
                .map(|o| cost(&ends[wire], &ends[*o]) as i64)
                .sum();
            let mut costs = vec![sum];
            for other in &order {
                sum += cost(&ends[*other], &ends[wire]) as i64;
                sum -= cost(&ends[wire], &ends[*other]) as i64;
                costs.push(sum);
            }
            let least = costs.iter().copied().min().unwrap_or(0);
            let best = if costs[at] == least {
                at
            } else {
                costs.iter().position(|c| *c == least).unwrap_or(at)
            };
            moved |= best != at;
            order.insert(best, wire);
        }
        if !moved {
            break;
        }
    }
    order
}

/// If a line to the right overlaps one from the left that turns further right, one of them is moved
/// a little.
fn separate(layers: &mut Layers, gap: usize, order: &[usize]) {
    for (at, first) in order.iter().enumerate() {
        for number in 0..layers.gaps[gap][*first].right.len() {
            let right = layers.gaps[gap][*first].right[number];
            let y = layers.y(right, false);
            for second in &order[at + 1..] {
                for number in 0..layers.gaps[gap][*second].left.len() {
                    let left = layers.gaps[gap][*second].left[number];
                    if (layers.y(left, true) - layers.y(right, false)).abs() >= NEAR {
                        continue;
                    }
                    if moves(layers, right) {
                        let step = step(layers, gap, right, false, y);
                        shift(layers, right, false, step);
                    } else if moves(layers, left) {
                        let step = step(layers, gap, left, true, layers.y(left, true));
                        shift(layers, left, true, step);
                    } else {
                        let by = room(layers, right.element);
                        layers.elements[right.element].y += by;
                    }
                }
            }
        }
    }
}

/// Whether a line can be moved where it touches an element.
fn moves(layers: &Layers, touch: Touch) -> bool {
    match layers.elements[touch.element].what {
        ColumnItem::Lane { .. } => true,
        ColumnItem::Item(item) => !layers.items[item].rigid,
    }
}

/// The best distance to move a line: short, and onto no other line of its gap.
fn step(layers: &Layers, gap: usize, touch: Touch, is_left: bool, y: i32) -> i32 {
    let taken = |y: i32| {
        let wires = &layers.gaps[gap];
        let left = wires.iter().flat_map(|w| &w.left).map(|t| (t, true));
        let right = wires.iter().flat_map(|w| &w.right).map(|t| (t, false));
        let mut others = left
            .chain(right)
            .filter(|(t, l)| !(**t == touch && *l == is_left));
        others.any(|(t, l)| (layers.y(*t, l) - y).abs() < NEAR)
    };
    let mut steps = (NEAR..=FURTHEST).flat_map(|by| [by, -by]);
    steps.find(|by| !taken(y + by)).unwrap_or(0)
}

/// Moves a lane, or a port of an item on its right or left side.
fn shift(layers: &mut Layers, touch: Touch, on_its_right: bool, by: i32) {
    match layers.elements[touch.element].what {
        ColumnItem::Lane { .. } => layers.elements[touch.element].y += by,
        ColumnItem::Item(item) => {
            let item = &mut layers.items[item];
            let ports = if on_its_right {
                &mut item.right
            } else {
                &mut item.left
            };
            if let Some(port) = ports.get_mut(touch.port).filter(|_| !item.rigid) {
                *port += by;
            }
        }
    }
}

/// The best distance to move an element with its ports: short, to where its neighbours leave more
/// room.
fn room(layers: &Layers, element: usize) -> i32 {
    let own = &layers.elements[element];
    let column = &layers.columns[own.column];
    let ends = |other: &usize| {
        let other = &layers.elements[*other];
        (other.y, other.y + other.height)
    };
    let others = || column.iter().filter(|other| **other != element).map(ends);
    let above = others().filter(|(y, _)| *y < own.y);
    let above = above.map(|(_, end)| own.y - end).min();
    let below = others().filter(|(y, _)| *y >= own.y);
    let below = below.map(|(y, _)| y - own.y - own.height).min();
    let (above, below) = (above.unwrap_or(own.y), below.unwrap_or(i32::MAX));
    match above.max(below) {
        ..=NEAR => 0,
        _ if below >= above => NEAR,
        _ => -NEAR,
    }
}
