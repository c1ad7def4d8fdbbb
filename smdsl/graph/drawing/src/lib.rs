//! Texts, boxes and lines as SVG, for pictures of networks, of state machines and of graphs.
//!
#![doc = include_str!("example.md")]

mod text;

use rc_diagnostics::xml::escaped;
use rc_graph_layout::{Point, Rect};
use std::collections::{BTreeMap, BTreeSet};
pub use text::{width, wrap};

/// The radius of the corners of lines.
const ROUND: i32 = 5;
/// Around a picture.
const MARGIN: i32 = 16;
/// The colour of lines and texts.
pub const INK: &str = "#222222";

/// A picture of this size as a document, which ends with a line feed.
pub fn document(title: &str, size: Point, elements: &str) -> String {
    let (width, height) = (size.x + 2 * MARGIN, size.y + 2 * MARGIN);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"10\" fill=\"{INK}\">\n<title>{}</title>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n{}</svg>\n",
        escaped(title),
        at(Point::new(MARGIN, MARGIN), elements)
    )
}

/// Elements with their upper left corner at this place.
pub fn at(place: Point, elements: &str) -> String {
    let Point { x, y } = place;
    format!("<g transform=\"translate({x} {y})\">\n{elements}</g>\n")
}

/// An arrowhead at the left side of a box.
pub fn head(end: Point) -> String {
    let (x, y) = (end.x - 1, end.y);
    format!(
        "<path d=\"M{0} {1}L{x} {y}L{0} {2}Z\" fill=\"{INK}\"/>\n",
        x - 8,
        y - 4,
        y + 4
    )
}

/// A text with these attributes.
pub fn text(x: i32, y: i32, attributes: &str, text: &str) -> String {
    format!(
        "<text x=\"{x}\" y=\"{y}\"{attributes}>{}</text>\n",
        escaped(text)
    )
}

/// A box with round corners.
pub fn rounded(rect: &Rect, radius: i32, attributes: &str) -> String {
    format!(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"{radius}\" {attributes}/>\n",
        rect.x, rect.y, rect.width, rect.height
    )
}

/// The points where lines of one net part.
pub fn forks(routes: &[Vec<Point>]) -> BTreeSet<Point> {
    let mut corners: BTreeSet<Point> = BTreeSet::new();
    routes.iter().flatten().for_each(|p| {
        corners.insert(*p);
    });
    let mut ways: BTreeMap<Point, BTreeSet<(i32, i32)>> = BTreeMap::new();
    for pair in routes.iter().flat_map(|route| route.windows(2)) {
        let (from, to) = (pair[0], pair[1]);
        let sense = ((to.x - from.x).signum(), (to.y - from.y).signum());
        let within = |p: &Point| {
            (from.x.min(to.x)..=from.x.max(to.x)).contains(&p.x)
                && (from.y.min(to.y)..=from.y.max(to.y)).contains(&p.y)
        };
        for point in corners.iter().filter(|p| within(p)) {
            let ways = ways.entry(*point).or_default();
            if *point != to {
                ways.insert(sense);
            }
            if *point != from {
                ways.insert((-sense.0, -sense.1));
            }
        }
    }
    ways.retain(|_, ways| ways.len() > 2);
    ways.into_keys().collect()
}

/// A route with round corners, except where others part from it.
pub fn path(route: &[Point], forks: &BTreeSet<Point>) -> String {
    let Some(first) = route.first() else {
        return String::new();
    };
    let mut out = format!("M{} {}", first.x, first.y);
    for at in 1..route.len() {
        let here = route[at];
        let Some(next) = route.get(at + 1).filter(|_| !forks.contains(&here)) else {
            out += &format!("L{} {}", here.x, here.y);
            continue;
        };
        let before = route[at - 1];
        let length = |p: Point| (p.x - here.x).abs() + (p.y - here.y).abs();
        let round = ROUND.min(length(before) / 2).min(length(*next) / 2);
        let towards = |p: Point| {
            Point::new(
                here.x + (p.x - here.x).signum() * round,
                here.y + (p.y - here.y).signum() * round,
            )
        };
        let (one, other) = (towards(before), towards(*next));
        out += &format!(
            "L{} {}Q{} {} {} {}",
            one.x, one.y, here.x, here.y, other.x, other.y
        );
    }
    out
}
