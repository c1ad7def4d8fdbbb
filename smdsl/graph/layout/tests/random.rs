//! Properties of every layout, checked on random networks.

use arbtest::arbitrary::{Result, Unstructured};
use arbtest::arbtest;
use rc_graph_layout::{Layout, Net, Node, Point, Port, Rect, Shape, layout};

/// Random boxes and lines: nested clusters, cycles, self-loops, several lines at one port.
fn network(u: &mut Unstructured<'_>) -> Result<(Vec<Node>, Vec<Net>)> {
    let mut nodes: Vec<Node> = Vec::new();
    let mut clusters: Vec<usize> = Vec::new();
    let (mut givers, mut takers) = (Vec::new(), Vec::new());
    for at in 0..u.int_in_range(0..=40)? {
        let parent = if clusters.is_empty() || u.ratio(1, 3)? {
            None
        } else {
            Some(*u.choose(&clusters)?)
        };
        let shape = if u.ratio(1, 4)? {
            clusters.push(at);
            Shape::Cluster {
                width: u.int_in_range(10..=200)?,
                header: 20,
            }
        } else {
            let (left, right) = (u.int_in_range(0..=4)?, u.int_in_range(0..=4)?);
            let ports = |count: i32| (0..count).map(|n| 30 + 16 * n).collect::<Vec<_>>();
            givers.extend((0..right as usize).map(|port| Port { node: at, port }));
            takers.extend((0..left as usize).map(|port| Port { node: at, port }));
            Shape::Leaf {
                width: u.int_in_range(40..=160)?,
                height: 30 + 16 * left.max(right),
                left: ports(left),
                right: ports(right),
            }
        };
        nodes.push(Node { parent, shape });
    }
    let mut nets = Vec::new();
    for from in givers {
        if takers.is_empty() || u.ratio(1, 4)? {
            continue;
        }
        let mut to = Vec::new();
        for _ in 0..u.int_in_range(1..=4)? {
            let port = *u.choose(&takers)?;
            if !to.contains(&port) {
                to.push(port);
            }
        }
        nets.push(Net { from, to });
    }
    Ok((nodes, nets))
}

fn apart(one: &Rect, other: &Rect) -> bool {
    one.x + one.width < other.x
        || other.x + other.width < one.x
        || one.y + one.height < other.y
        || other.y + other.height < one.y
}

fn within(inner: &Rect, outer: &Rect, header: i32) -> bool {
    inner.x > outer.x
        && inner.y >= outer.y + header
        && inner.x + inner.width < outer.x + outer.width
        && inner.y + inner.height < outer.y + outer.height
}

/// Whether a line crosses the inside of a box.
fn crosses(one: Point, other: Point, rect: &Rect) -> bool {
    one.x.min(other.x) < rect.x + rect.width
        && one.x.max(other.x) > rect.x
        && one.y.min(other.y) < rect.y + rect.height
        && one.y.max(other.y) > rect.y
}

fn is_inside(nodes: &[Node], inner: usize, outer: usize) -> bool {
    std::iter::successors(Some(inner), |at| nodes[*at].parent).any(|at| at == outer)
}

fn check_boxes(nodes: &[Node], drawn: &Layout) {
    let whole = Rect {
        x: -1,
        y: -1,
        width: drawn.width + 2,
        height: drawn.height + 2,
    };
    for (at, rect) in drawn.boxes.iter().enumerate() {
        let (outer, header) = match nodes[at].parent {
            Some(parent) => match nodes[parent].shape {
                Shape::Cluster { header, .. } => (&drawn.boxes[parent], header),
                Shape::Leaf { .. } => panic!("a leaf has no boxes inside"),
            },
            None => (&whole, 0),
        };
        assert!(
            within(rect, outer, header),
            "{at}: {rect:?} is not in {outer:?}"
        );
        for (other, beside) in drawn.boxes.iter().enumerate().skip(at + 1) {
            let nested = is_inside(nodes, other, at) || is_inside(nodes, at, other);
            assert!(nested || apart(rect, beside), "{at} and {other} overlap");
        }
    }
}

fn check_route(nodes: &[Node], drawn: &Layout, from: Port, to: Port, route: &[Point]) {
    let (source, target) = (&drawn.boxes[from.node], &drawn.boxes[to.node]);
    let (first, last) = (route[0], route[route.len() - 1]);
    assert_eq!(first.x, source.x + source.width);
    assert!(source.y <= first.y && first.y <= source.y + source.height);
    assert_eq!(last.x, target.x);
    assert!(target.y <= last.y && last.y <= target.y + target.height);
    // A line leaves a port to the right and arrives from the left.
    assert!(route[1].x > first.x && route[route.len() - 2].x < last.x);
    for pair in route.windows(2) {
        let (one, other) = (pair[0], pair[1]);
        assert!(
            (one.x == other.x) != (one.y == other.y),
            "{one:?} to {other:?}"
        );
        for (at, rect) in drawn.boxes.iter().enumerate() {
            let around = is_inside(nodes, from.node, at) || is_inside(nodes, to.node, at);
            let own_cluster = around && matches!(nodes[at].shape, Shape::Cluster { .. });
            assert!(
                own_cluster || !crosses(one, other, rect),
                "{one:?} to {other:?} runs through {at}, {rect:?}"
            );
        }
    }
}

#[test]
fn boxes_do_not_overlap_and_lines_avoid_them() {
    arbtest(|u| {
        let (nodes, nets) = network(u)?;
        let drawn = layout(&nodes, &nets);
        check_boxes(&nodes, &drawn);
        for (net, routes) in nets.iter().zip(&drawn.routes) {
            assert_eq!(net.to.len(), routes.len());
            for (to, route) in net.to.iter().zip(routes) {
                check_route(&nodes, &drawn, net.from, *to, route);
            }
        }
        Ok(())
    })
    .budget_ms(3_000)
    .size_max(4_000);
}

/// Whether two segments overlap in more than a point.
fn upon(one: (Point, Point), other: (Point, Point)) -> bool {
    let overlap = |a: i32, b: i32, c: i32, d: i32| a.max(b).min(c.max(d)) > a.min(b).max(c.min(d));
    let ((a, b), (c, d)) = (one, other);
    (a.y == b.y && c.y == d.y && a.y == c.y && overlap(a.x, b.x, c.x, d.x))
        || (a.x == b.x && c.x == d.x && a.x == c.x && overlap(a.y, b.y, c.y, d.y))
}

/// No line of a net lies upon one of another net.
fn check_lines(u: &mut Unstructured<'_>) -> Result<()> {
    let (nodes, nets) = network(u)?;
    let drawn = layout(&nodes, &nets);
    for (at, one) in nets.iter().enumerate() {
        for (number, other) in nets.iter().enumerate().skip(at + 1) {
            // Lines to one port join before it.
            if one.to.iter().any(|to| other.to.contains(to)) {
                continue;
            }
            for (route, beside) in drawn.routes[at]
                .iter()
                .flat_map(|r| drawn.routes[number].iter().map(move |s| (r, s)))
            {
                let pairs = route.windows(2);
                let mut pairs = pairs.flat_map(|p| beside.windows(2).map(move |q| (p, q)));
                let bad = pairs.find(|(p, q)| upon((p[0], p[1]), (q[0], q[1])));
                assert!(bad.is_none(), "nets {at} and {number}: {bad:?}");
            }
        }
    }
    Ok(())
}

#[test]
fn lines_of_different_nets_do_not_overlap() {
    arbtest(check_lines).budget_ms(3_000).size_max(4_000);
}

/// A line from a box that has no room to move lay upon one that turns behind it.
#[test]
fn networks_whose_lines_have_overlapped_are_drawn_apart() {
    arbtest(check_lines).seed(0x8506_9380_0000_003e);
}

#[test]
fn an_empty_network_has_no_layout_and_layouts_are_deterministic() {
    let drawn = layout(&[], &[]);
    assert_eq!((drawn.width, drawn.height), (0, 0));
    arbtest(|u| {
        let (nodes, nets) = network(u)?;
        let (one, other) = (layout(&nodes, &nets), layout(&nodes, &nets));
        assert_eq!(one.boxes, other.boxes);
        assert_eq!(one.routes, other.routes);
        Ok(())
    })
    .budget_ms(500);
}
