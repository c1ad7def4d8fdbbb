//! Arranges unconnected parts on shelves.

use crate::Point;
use crate::elements::{Item, LevelNet, Placed};
use crate::layers::arrange;
use crate::route::straight;

/// Between parts that are not connected, and at the border of a cluster.
pub(crate) const MARGIN: i32 = 16;

/// Lays out one level: each connected part by itself, all on shelves. Without a header there is no
/// border either.
pub(crate) fn pack(
    items: &[Item],
    nets: &[LevelNet],
    least_width: i32,
    header: Option<i32>,
) -> Placed {
    let margin = if header.is_some() { MARGIN } else { 0 };
    let header = header.unwrap_or(0);
    let mut out = Placed {
        items: vec![Point::new(0, 0); items.len()],
        left: vec![None; nets.len()],
        right: vec![None; nets.len()],
        routes: nets
            .iter()
            .map(|n| vec![Vec::new(); n.targets.len()])
            .collect(),
        ..Placed::default()
    };
    let parts: Vec<(Part, Placed)> = parts(items, nets)
        .into_iter()
        .map(|part| {
            let placed = arrange(&part.items(items), &part.nets(nets));
            (part, placed)
        })
        .collect();
    let area: f64 = parts
        .iter()
        .map(|(_, p)| f64::from(p.width + MARGIN) * f64::from(p.height + MARGIN))
        .sum();
    let widest = parts.iter().map(|(_, p)| p.width).max().unwrap_or(0);
    // A page is wider than it is high.
    let limit = widest.max((area * 1.5).sqrt() as i32);
    let (mut x, mut y, mut shelf) = (0, header, 0);
    for (part, placed) in &parts {
        if x > 0 && x + placed.width > limit {
            (x, y, shelf) = (0, y + shelf + MARGIN, 0);
        }
        // Parts that reach the border reach it by themselves; the others keep a distance from it.
        let left = if part.border { 0 } else { margin };
        part.take(placed, Point::new(x + left, y), &mut out);
        x += placed.width + MARGIN;
        shelf = shelf.max(placed.height);
        let right = if part.border { 0 } else { 2 * margin };
        out.width = out.width.max(x - MARGIN + right);
        if part.border {
            // Nothing may be next to a part that leads to the border.
            x = limit + 1;
        }
    }
    out.width = out.width.max(least_width);
    out.height = y + shelf + margin;
    for (net, routes) in nets.iter().zip(&mut out.routes) {
        for (target, route) in net.targets.iter().zip(routes) {
            if let (None, Some(last)) = (target, route.last().copied()) {
                route.push(Point::new(out.width, last.y));
            }
            *route = straight(std::mem::take(route));
        }
    }
    out
}

/// Items that are connected, and the nets between them.
struct Part {
    items: Vec<usize>,
    nets: Vec<usize>,
    border: bool,
}

/// The item that represents all items connected to it.
fn find(root: &mut [usize], mut at: usize) -> usize {
    while root[at] != at {
        root[at] = root[root[at]];
        at = root[at];
    }
    at
}

/// The connected parts; that which reaches the border comes first, the others in the order of their
/// first items.
fn parts(items: &[Item], nets: &[LevelNet]) -> Vec<Part> {
    // The border is one more item.
    let border = items.len();
    let mut root: Vec<usize> = (0..=border).collect();
    let index = |end: Option<(usize, usize)>| end.map_or(border, |(item, _)| item);
    for net in nets {
        for target in &net.targets {
            let one = find(&mut root, index(net.source));
            let other = find(&mut root, index(*target));
            root[one.max(other)] = one.min(other);
        }
    }
    let mut parts: Vec<Part> = Vec::new();
    let mut known: Vec<Option<usize>> = vec![None; border + 1];
    let outer = find(&mut root, border);
    for item in 0..items.len() {
        let own = find(&mut root, item);
        let at = *known[own].get_or_insert_with(|| {
            parts.push(Part {
                items: Vec::new(),
                nets: Vec::new(),
                border: own == outer,
            });
            parts.len() - 1
        });
        parts[at].items.push(item);
    }
    for (number, net) in nets.iter().enumerate() {
        let own = find(&mut root, index(net.source));
        if let Some(at) = known[own] {
            parts[at].nets.push(number);
        }
    }
    parts.sort_by_key(|part| !part.border);
    parts
}

impl Part {
    fn items(&self, all: &[Item]) -> Vec<Item> {
        self.items.iter().map(|item| all[*item].clone()).collect()
    }

    fn nets(&self, all: &[LevelNet]) -> Vec<LevelNet> {
        let own = |(item, port): (usize, usize)| {
            let item = self.items.iter().position(|i| *i == item);
            (item.unwrap_or(0), port)
        };
        let nets = self.nets.iter().map(|net| &all[*net]);
        nets.map(|net| LevelNet {
            source: net.source.map(own),
            targets: net.targets.iter().map(|t| t.map(own)).collect(),
        })
        .collect()
    }

    /// Transfers a laid-out part into the whole.
    fn take(&self, placed: &Placed, by: Point, out: &mut Placed) {
        for (item, place) in self.items.iter().zip(&placed.items) {
            out.items[*item] = place.moved(by);
        }
        for (at, net) in self.nets.iter().enumerate() {
            out.left[*net] = placed.left[at].map(|y| y + by.y);
            out.right[*net] = placed.right[at].map(|y| y + by.y);
            let routes = placed.routes[at].iter();
            out.routes[*net] = routes
                .map(|route| route.iter().map(|p| p.moved(by)).collect())
                .collect();
        }
    }
}
