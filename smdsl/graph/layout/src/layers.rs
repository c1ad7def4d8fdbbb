//! One connected part of one level: items in columns, lanes for lines that pass a column, and the
//! gaps between.
//!
//! Column 0 and the last one are the borders. Gap `g` is between columns `g` and `g + 1`. A line
//! runs forward through lanes of the columns between its source and its last target. To targets
//! that are not right of its source, it turns round and runs back through lanes of its own.

use crate::elements::{ColumnItem, Element, Item, Layers, LevelNet, Placed, Touch, Wire};
use crate::{Point, order, place, rank, tracks};
use std::collections::HashMap;

/// Lays out a connected part.
pub(crate) fn arrange(items: &[Item], nets: &[LevelNet]) -> Placed {
    let (mut layers, ways) = Layers::new(items, nets);
    order::order(&mut layers);
    place::place(&mut layers);
    tracks::assign(&mut layers);
    layers.finish(nets, &ways)
}

/// Where a net begins and ends.
#[derive(Debug)]
pub(crate) struct NetRoute {
    source: Touch,
    targets: Vec<Touch>,
    /// Lanes by column and sense.
    lanes: HashMap<(usize, bool), usize>,
}

impl Layers {
    fn new(items: &[Item], nets: &[LevelNet]) -> (Self, Vec<NetRoute>) {
        let ranks = rank::ranks(items, nets);
        let last = ranks.iter().max().map_or(1, |r| r + 2);
        let mut layers = Self {
            items: items.to_vec(),
            elements: Vec::new(),
            columns: vec![Vec::new(); last + 1],
            gaps: vec![Vec::new(); last],
        };
        for (item, rank) in ranks.iter().enumerate() {
            layers.add(ColumnItem::Item(item), rank + 1, items[item].height);
        }
        let ways = nets.iter().enumerate();
        let ways = ways
            .map(|(net, ends)| layers.way(net, ends, last))
            .collect();
        (layers, ways)
    }

    fn add(&mut self, what: ColumnItem, column: usize, height: i32) -> usize {
        self.elements.push(Element {
            what,
            column,
            height,
            y: 0,
        });
        self.columns[column].push(self.elements.len() - 1);
        self.elements.len() - 1
    }

    /// Makes the lanes of a net and its wires.
    fn way(&mut self, net: usize, ends: &LevelNet, last: usize) -> NetRoute {
        let forward = ColumnItem::Lane { net, back: false };
        let touch = |element, port| Touch { element, port };
        // Items are the first elements, in their order.
        let source = match ends.source {
            Some((item, port)) => touch(item, port),
            None => touch(self.add(forward, 0, 0), 0),
        };
        let targets: Vec<Touch> = ends
            .targets
            .iter()
            .map(|target| match target {
                Some((item, port)) => touch(*item, *port),
                None => touch(self.add(forward, last, 0), 0),
            })
            .collect();
        let start = self.elements[source.element].column;
        let column = |layers: &Self, t: &Touch| layers.elements[t.element].column;
        let columns: Vec<usize> = targets.iter().map(|t| column(self, t)).collect();
        let furthest = columns.iter().copied().max().unwrap_or(start);
        let first = columns.iter().copied().min().unwrap_or(start);
        let mut lanes = HashMap::new();
        for column in start + 1..furthest {
            lanes.insert((column, false), self.add(forward, column, 0));
        }
        for column in first..=start {
            let back = ColumnItem::Lane { net, back: true };
            lanes.insert((column, true), self.add(back, column, 0));
        }
        let lane = |column: usize, back: bool| lanes.get(&(column, back)).map(|l| touch(*l, 0));
        for gap in first.saturating_sub(1).min(start)..furthest.max(start + 1) {
            let mut left: Vec<Touch> = Vec::new();
            left.extend((gap == start).then_some(source));
            left.extend(lane(gap, false));
            left.extend(lane(gap, true));
            let behind = targets.iter().zip(&columns).filter(|(_, c)| **c == gap + 1);
            let mut right: Vec<Touch> = behind.map(|(t, _)| *t).collect();
            right.extend(lane(gap + 1, false));
            right.extend(lane(gap + 1, true));
            if !left.is_empty() || !right.is_empty() {
                let wire = Wire {
                    net,
                    left,
                    right,
                    x: 0,
                };
                self.gaps[gap].push(wire);
            }
        }
        NetRoute {
            source,
            targets,
            lanes,
        }
    }

    fn finish(&self, nets: &[LevelNet], ways: &[NetRoute]) -> Placed {
        let (columns, tracks) = self.across();
        let last = self.columns.len() - 1;
        let mut placed = Placed {
            width: columns[last].0,
            height: self
                .elements
                .iter()
                .map(|e| e.y + e.height)
                .max()
                .unwrap_or(0),
            left: vec![None; nets.len()],
            right: vec![None; nets.len()],
            ..Placed::default()
        };
        for (at, item) in self.items.iter().enumerate() {
            let element = &self.elements[at];
            let (x, width) = columns[element.column];
            placed
                .items
                .push(Point::new(x + (width - item.width) / 2, element.y));
        }
        for element in &self.elements {
            if let ColumnItem::Lane { net, .. } = element.what {
                if element.column == 0 {
                    placed.left[net] = Some(element.y);
                } else if element.column == last {
                    placed.right[net] = Some(element.y);
                }
            }
        }
        let xs = |net: usize, gap: usize| tracks.get(&(net, gap)).copied().unwrap_or(0);
        placed.routes = ways
            .iter()
            .enumerate()
            .map(|(net, way)| {
                let ends = way.targets.iter();
                ends.map(|end| {
                    self.route(
                        &placed.items,
                        way,
                        *end,
                        &|gap| xs(net, gap),
                        columns[last].0,
                    )
                })
                .collect()
            })
            .collect();
        placed
    }

    /// Left edge and width of each column, and where the wire of each net in each gap runs up and
    /// down.
    fn across(&self) -> (Vec<(i32, i32)>, HashMap<(usize, usize), i32>) {
        let mut tracks = HashMap::new();
        let mut columns = Vec::new();
        let mut x = 0;
        for (number, column) in self.columns.iter().enumerate() {
            let widths = column.iter().map(|e| match self.elements[*e].what {
                ColumnItem::Item(item) => self.items[item].width,
                ColumnItem::Lane { .. } => 0,
            });
            let width = widths.max().unwrap_or(0);
            columns.push((x, width));
            x += width;
            if let Some(gap) = self.gaps.get(number) {
                for wire in gap {
                    tracks.insert((wire.net, number), x + wire.x);
                }
                x += tracks::width(self, number);
            }
        }
        (columns, tracks)
    }

    fn route(
        &self,
        items: &[Point],
        way: &NetRoute,
        end: Touch,
        track: &dyn Fn(usize) -> i32,
        right: i32,
    ) -> Vec<Point> {
        let column = |touch: Touch| self.elements[touch.element].column;
        let (start, stop) = (column(way.source), column(end));
        let lane = |column: usize, back: bool| {
            let element = way.lanes.get(&(column, back));
            element.map_or(0, |e| self.elements[*e].y)
        };
        let begin = match self.elements[way.source.element].what {
            ColumnItem::Item(item) => items[item].x + self.items[item].width,
            ColumnItem::Lane { .. } => 0,
        };
        let finish = match self.elements[end.element].what {
            ColumnItem::Item(item) => items[item].x,
            ColumnItem::Lane { .. } => right,
        };
        let mut y = self.y(way.source, true);
        let mut points = vec![Point::new(begin, y)];
        let mut turn = |gap: usize, to: i32, points: &mut Vec<Point>| {
            points.extend([Point::new(track(gap), y), Point::new(track(gap), to)]);
            y = to;
        };
        let target = self.y(end, false);
        if stop > start {
            for gap in start..stop - 1 {
                turn(gap, lane(gap + 1, false), &mut points);
            }
            turn(stop - 1, target, &mut points);
        } else {
            for gap in (stop..=start).rev() {
                turn(gap, lane(gap, true), &mut points);
            }
            turn(stop - 1, target, &mut points);
        }
        points.push(Point::new(finish, target));
        points
    }
}
