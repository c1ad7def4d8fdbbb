//! Nested clusters: each is laid out by itself, and a line across their borders is joined from its
//! parts.

use crate::elements::{Item, LevelNet, Placed};
use crate::pack::pack;
use crate::route::straight;
use crate::{Layout, Net, Node, Point, Rect, Shape};
use std::collections::HashMap;

/// The layout of the direct content of a cluster.
#[derive(Default)]
struct Level {
    placed: Placed,
    /// The nets of the placement, by their numbers outside.
    nets: HashMap<usize, usize>,
    /// For each net of the placement, the targets: boxes of this level, none for those outside.
    targets: Vec<Vec<Option<(usize, usize)>>>,
    /// By the number of a box, its item.
    items: HashMap<usize, usize>,
    /// Nets that enter through the left border, in the order of their ports.
    enter: Vec<usize>,
    /// Nets that leave through the right border, in the order of their ports.
    leave: Vec<usize>,
}

struct Nest<'a> {
    nodes: &'a [Node],
    nets: &'a [Net],
    /// The boxes of each cluster; the last entry has those outside all clusters.
    children: Vec<Vec<usize>>,
    levels: Vec<Level>,
}

/// Lays out everything. Parents come before their children in `nodes`; ports that do not exist are
/// a mistake of the caller.
pub fn layout(nodes: &[Node], nets: &[Net]) -> Layout {
    let outside = nodes.len();
    let mut children = vec![Vec::new(); outside + 1];
    for (at, node) in nodes.iter().enumerate() {
        children[node.parent.unwrap_or(outside)].push(at);
    }
    let mut levels: Vec<Level> = Vec::new();
    levels.resize_with(outside + 1, Level::default);
    let mut nest = Nest {
        nodes,
        nets,
        children,
        levels,
    };
    let concerned = nest.concerned();
    // Inner clusters come after those around them.
    for at in (0..outside).rev() {
        if matches!(nodes[at].shape, Shape::Cluster { .. }) {
            nest.levels[at] = nest.level(at, &concerned[at]);
        }
    }
    nest.levels[outside] = nest.level(outside, &concerned[outside]);
    let boxes = nest.boxes();
    let routes = nets.iter().enumerate();
    let routes = routes
        .map(|(number, net)| {
            let ends = net.to.iter();
            ends.map(|to| nest.route(&boxes, number, net.from.node, to.node, to.port))
                .collect()
        })
        .collect();
    let root = &nest.levels[outside].placed;
    Layout {
        width: root.width,
        height: root.height,
        boxes,
        routes,
    }
}

impl Nest<'_> {
    /// The clusters around a box, from inside to outside; the last is the number after all boxes.
    fn around(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        let outside = self.nodes.len();
        let parents = std::iter::successors(self.nodes[node].parent, |at| self.nodes[*at].parent);
        parents.chain([outside])
    }

    /// The box directly in `cluster` that is `node` or contains it, if `node` is inside.
    fn child(&self, cluster: usize, node: usize) -> Option<usize> {
        let outside = self.nodes.len();
        let own = std::iter::successors(Some(node), |at| self.nodes[*at].parent);
        own.into_iter()
            .find(|at| self.nodes[*at].parent.unwrap_or(outside) == cluster)
    }

    /// For each cluster, the nets that have to do with something inside.
    fn concerned(&self) -> Vec<Vec<usize>> {
        let mut concerned = vec![Vec::new(); self.nodes.len() + 1];
        for (number, net) in self.nets.iter().enumerate() {
            for port in net.to.iter().chain([&net.from]) {
                for cluster in self.around(port.node) {
                    if concerned[cluster].last() != Some(&number) {
                        concerned[cluster].push(number);
                    }
                }
            }
        }
        concerned
    }

    fn item(&self, node: usize) -> Item {
        match &self.nodes[node].shape {
            Shape::Leaf {
                width,
                height,
                left,
                right,
            } => Item {
                width: *width,
                height: *height,
                left: left.clone(),
                right: right.clone(),
                rigid: false,
            },
            Shape::Cluster { .. } => {
                let level = &self.levels[node];
                let y = |all: &[Option<i32>], net: &usize| all[level.nets[net]].unwrap_or(0);
                let (left, right) = (&level.placed.left, &level.placed.right);
                Item {
                    width: level.placed.width,
                    height: level.placed.height,
                    left: level.enter.iter().map(|net| y(left, net)).collect(),
                    right: level.leave.iter().map(|net| y(right, net)).collect(),
                    rigid: true,
                }
            }
        }
    }

    /// The number of the port at which a net meets a box.
    fn port(&self, node: usize, net: usize, own: usize, enters: bool) -> usize {
        if matches!(self.nodes[node].shape, Shape::Leaf { .. }) {
            return own;
        }
        let level = &self.levels[node];
        let ports = if enters { &level.enter } else { &level.leave };
        ports.iter().position(|n| *n == net).unwrap_or(0)
    }

    /// Lays out the boxes directly in one cluster.
    fn level(&self, cluster: usize, concerned: &[usize]) -> Level {
        let children = &self.children[cluster];
        let items: HashMap<usize, usize> = children.iter().copied().zip(0..).collect();
        let mut level = Level {
            items,
            ..Level::default()
        };
        let mut nets: Vec<LevelNet> = Vec::new();
        for number in concerned.iter().copied() {
            let net = &self.nets[number];
            let source = self.child(cluster, net.from.node);
            let mut targets: Vec<Option<(usize, usize)>> = Vec::new();
            for to in &net.to {
                let target = match self.child(cluster, to.node) {
                    // It stays within a cluster inside this one, and is drawn there.
                    Some(child) if Some(child) == source && child != to.node => continue,
                    Some(child) => Some((child, self.port(child, number, to.port, true))),
                    None if source.is_none() => continue,
                    None => None,
                };
                if !targets.contains(&target) {
                    targets.push(target);
                }
            }
            if targets.is_empty() {
                continue;
            }
            let source = source.map(|s| (s, self.port(s, number, net.from.port, false)));
            if source.is_none() {
                level.enter.push(number);
            }
            if targets.contains(&None) {
                level.leave.push(number);
            }
            let item = |(node, port): (usize, usize)| (level.items[&node], port);
            nets.push(LevelNet {
                source: source.map(item),
                targets: targets.iter().map(|t| t.map(item)).collect(),
            });
            level.nets.insert(number, nets.len() - 1);
            level.targets.push(targets);
        }
        let items: Vec<Item> = children.iter().map(|node| self.item(*node)).collect();
        let (width, header) = match self.nodes.get(cluster).map(|n| &n.shape) {
            Some(Shape::Cluster { width, header }) => (*width, Some(*header)),
            _ => (0, None),
        };
        level.placed = pack(&items, &nets, width, header);
        level
    }

    fn boxes(&self) -> Vec<Rect> {
        let outside = self.nodes.len();
        let mut boxes: Vec<Rect> = Vec::with_capacity(outside);
        for (at, node) in self.nodes.iter().enumerate() {
            let parent = node.parent.unwrap_or(outside);
            let origin = boxes
                .get(parent)
                .map_or(Point::new(0, 0), |b| Point::new(b.x, b.y));
            let level = &self.levels[parent];
            let place = level.placed.items[level.items[&at]].moved(origin);
            let (width, height) = match &node.shape {
                Shape::Leaf { width, height, .. } => (*width, *height),
                Shape::Cluster { .. } => {
                    let placed = &self.levels[at].placed;
                    (placed.width, placed.height)
                }
            };
            boxes.push(Rect {
                x: place.x,
                y: place.y,
                width,
                height,
            });
        }
        boxes
    }

    /// The whole way of a net to one of its ends: up through the clusters around its beginning,
    /// down to the end.
    fn route(
        &self,
        boxes: &[Rect],
        net: usize,
        from: usize,
        to: usize,
        to_port: usize,
    ) -> Vec<Point> {
        let up: Vec<usize> = self.around(from).collect();
        let down: Vec<usize> = self.around(to).collect();
        let Some(common) = up.iter().copied().find(|cluster| down.contains(cluster)) else {
            return Vec::new();
        };
        let mut clusters: Vec<usize> = up.into_iter().take_while(|c| *c != common).collect();
        clusters.push(common);
        let inside: Vec<usize> = down.into_iter().take_while(|c| *c != common).collect();
        clusters.extend(inside.into_iter().rev());
        let mut points: Vec<Point> = Vec::new();
        for cluster in clusters {
            let level = &self.levels[cluster];
            let target = self
                .child(cluster, to)
                .map(|child| (child, self.port(child, net, to_port, true)));
            let Some(number) = level.nets.get(&net).copied() else {
                continue;
            };
            let Some(end) = level.targets[number].iter().position(|t| *t == target) else {
                continue;
            };
            let origin = boxes
                .get(cluster)
                .map_or(Point::new(0, 0), |b| Point::new(b.x, b.y));
            let part = level.placed.routes[number][end].iter();
            points.extend(part.map(|p| p.moved(origin)));
        }
        straight(points)
    }
}
