//! The SVG picture: boxes with slots, arrows in the direction of calls or samples, and a legend.
//!
//! The picture can be read without colours: findings are bold and numbered, middlewares differ in
//! dashes, calls and topics in arrowheads.

mod boxes;
mod legend;
mod machines;
#[cfg(test)]
mod tests;

use crate::marks::{Level, Mark, Marks};
use crate::model::{Graph, chain_colour, provider_and_consumer, sentence};
use boxes::Boxes;
use machines::Machines;
use rc_deploy_network::topology::Kind;
use rc_diagnostics::xml::escaped;
use rc_drawing::{forks, path, text, width};
use rc_graph_layout::{Layout, Net, Point, Port};
use rc_vocabulary::Middleware;
use std::collections::BTreeMap;

/// Around all.
const MARGIN: i32 = 16;
/// Font sizes of names and of slots.
const NAME: f64 = 12.0;
const SMALL: f64 = 10.0;
/// Half of the edge of a slot's square.
const PORT: i32 = 3;

const INK: &str = "#222222";
const RED: &str = "#b00020";
const ORANGE: &str = "#c25b00";

impl Level {
    fn colour(self) -> &'static str {
        match self {
            Self::Error => RED,
            Self::Warning => ORANGE,
        }
    }
}

/// The dash pattern of a middleware. Empty: a solid line.
fn dashes(middleware: &str) -> &'static str {
    Middleware::from_word(middleware).map_or("1 3", |known| known.can().dashes)
}

/// All lines that come from one slot.
struct Bundle {
    net: Net,
    /// For each end, the index of its connection.
    connections: Vec<usize>,
}

/// Draws a network.
pub(crate) fn draw(graph: &Graph) -> String {
    let marks = Marks::new(graph);
    let boxes = Boxes::new(graph, &marks);
    let bundles = bundles(graph, &boxes);
    let nets: Vec<Net> = bundles.iter().map(|b| b.net.clone()).collect();
    let layout = rc_graph_layout::layout(&boxes.nodes, &nets);
    let legend = legend::Legend::new(graph, &marks, layout.width);
    let machines = Machines::new(graph);
    let inner = layout.width.max(legend.width).max(machines.width);
    let total = (
        inner + 2 * MARGIN,
        layout.height + legend.height + machines.height + 2 * MARGIN,
    );
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" font-family=\"sans-serif\" font-size=\"{SMALL}\" fill=\"{INK}\">\n<title>{2}</title>\n<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
        total.0,
        total.1,
        escaped(&format!("The network {}", graph.network)),
    );
    let by = Point::new(MARGIN + (inner - layout.width) / 2, MARGIN);
    out += &format!("<g transform=\"translate({} {})\">\n", by.x, by.y);
    out += &boxes.clusters(graph, &marks, &layout.boxes);
    out += &lines(graph, &marks, &bundles, &layout);
    out += &boxes.components(graph, &marks, &layout.boxes);
    out += &arrows(graph, &marks, &bundles, &layout);
    out += "</g>\n";
    out += &legend.draw(Point::new(MARGIN, MARGIN + layout.height));
    out += &machines.draw(MARGIN, MARGIN + layout.height + legend.height);
    out + "</svg>\n"
}

/// One bundle for each providing slot, in the order of slots.
fn bundles(graph: &Graph, boxes: &Boxes) -> Vec<Bundle> {
    let mut bundles: BTreeMap<(usize, usize), Bundle> = BTreeMap::new();
    for (number, connection) in graph.connections.iter().enumerate() {
        let (provider, consumer) = provider_and_consumer(connection);
        let (Some(from), Some(to)) = (boxes.port(provider), boxes.port(consumer)) else {
            continue;
        };
        let bundle = bundles.entry(provider).or_insert_with(|| Bundle {
            net: Net {
                from,
                to: Vec::new(),
            },
            connections: Vec::new(),
        });
        bundle.net.to.push(to);
        bundle.connections.push(number);
    }
    bundles.into_values().collect()
}

/// The attributes of a text with or without findings.
fn emphasis(mark: Option<&Mark>) -> String {
    mark.map_or_else(String::new, |m| {
        format!(" fill=\"{}\" font-weight=\"bold\"", m.level.colour())
    })
}

/// A tooltip: a first line, and findings.
fn title(first: &str, marks: &Marks<'_>, mark: Option<&Mark>) -> String {
    let mut all = vec![first.to_owned()];
    let numbers = mark.iter().flat_map(|m| &m.numbers);
    all.extend(numbers.map(|number| marks.line(*number)));
    format!("<title>{}</title>", xml_lines(&all))
}

/// A tooltip of several lines.
fn xml_lines(lines: &[String]) -> String {
    let lines = lines.iter().flat_map(|line| line.lines());
    lines.map(escaped).collect::<Vec<_>>().join("\n")
}

/// The properties that distinguish lines of a slot: the level of findings, the colour of a chain,
/// dashes.
type Look<'a> = (Option<Level>, Option<&'a str>, &'a str);

/// Draws the lines of all connections, errors last. Equal lines of one slot are one path, so that
/// their common part is drawn once.
fn lines(graph: &Graph, marks: &Marks<'_>, bundles: &[Bundle], layout: &Layout) -> String {
    let mut all: Vec<(Option<Level>, String)> = Vec::new();
    let mut dots = String::new();
    for (bundle, routes) in bundles.iter().zip(&layout.routes) {
        let forks = forks(routes);
        let mut paths: BTreeMap<Look<'_>, (Vec<usize>, String)> = BTreeMap::new();
        for (number, route) in bundle.connections.iter().zip(routes) {
            let level = marks.connection(*number).map(|m| m.level);
            let dashes = dashes(graph.connections[*number].middleware);
            let chain = chain_colour(graph, &graph.connections[*number]);
            let (numbers, drawn) = paths.entry((level, chain, dashes)).or_default();
            numbers.push(*number);
            *drawn += &path(route, &forks);
        }
        for ((level, chain, dashes), (numbers, drawn)) in paths {
            let colour = level.map_or(chain.unwrap_or(INK), Level::colour);
            let is_plain = level.is_none() && chain.is_none();
            let thick = if is_plain { "1.2" } else { "2.2" };
            let dashes = match dashes {
                "" => String::new(),
                dashes => format!(" stroke-dasharray=\"{dashes}\""),
            };
            let words: Vec<String> = numbers
                .iter()
                .map(|number| in_words(graph, marks, *number))
                .collect();
            let title = xml_lines(&words);
            let drawn = format!(
                "<g><title>{title}</title><path d=\"{drawn}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{thick}\"{dashes}/></g>\n"
            );
            all.push((level, drawn));
        }
        for fork in forks {
            dots += &format!("<circle cx=\"{}\" cy=\"{}\" r=\"2.4\"/>\n", fork.x, fork.y);
        }
    }
    all.sort_by_key(|(level, _)| *level);
    let lines: String = all.into_iter().map(|(_, drawn)| drawn).collect();
    lines + &dots
}

/// A connection and its findings, as lines.
fn in_words(graph: &Graph, marks: &Marks<'_>, number: usize) -> String {
    let mut words = sentence(&graph.connections[number]);
    for finding in marks.connection(number).iter().flat_map(|m| &m.numbers) {
        words += &format!("\n{}", marks.line(*finding));
    }
    words
}

/// Draws arrowheads and numbers of findings, above everything else.
fn arrows(graph: &Graph, marks: &Marks<'_>, bundles: &[Bundle], layout: &Layout) -> String {
    let mut heads: BTreeMap<(Point, bool), Option<Level>> = BTreeMap::new();
    let mut numbers = String::new();
    for (bundle, routes) in bundles.iter().zip(&layout.routes) {
        for (number, route) in bundle.connections.iter().zip(routes) {
            let mark = marks.connection(*number);
            let call = graph.connections[*number].kind == Kind::Call;
            // A line runs from provider to consumer, a call in the other direction.
            let end = if call { route.first() } else { route.last() };
            if let Some(end) = end {
                let head = heads.entry((*end, call)).or_default();
                *head = (*head).max(mark.map(|m| m.level));
            }
            if let Some(mark) = mark {
                numbers += &line_number(route, mark);
            }
        }
    }
    let heads: String = heads
        .into_iter()
        .map(|((end, call), level)| {
            let colour = level.map_or(INK, Level::colour);
            arrow(end, call, colour)
        })
        .collect();
    heads + &numbers
}

/// An arrowhead at a slot: of a topic at the left side of a box, of a call at its right side.
fn arrow(end: Point, call: bool, colour: &str) -> String {
    let (x, y) = (end.x, end.y);
    if call {
        let tip = x + PORT + 1;
        format!(
            "<path d=\"M{0} {1}L{tip} {y}L{0} {2}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\"/>\n",
            tip + 7,
            y - 4,
            y + 4
        )
    } else {
        let tip = x - PORT - 1;
        format!(
            "<path d=\"M{0} {1}L{tip} {y}L{0} {2}Z\" fill=\"{colour}\"/>\n",
            tip - 8,
            y - 4,
            y + 4
        )
    }
}

/// The numbers of findings about a connection, on the longest segment near its end.
fn line_number(route: &[Point], mark: &Mark) -> String {
    let level = route.windows(2).filter(|p| p[0].y == p[1].y);
    let Some(piece) = level.max_by_key(|p| (p[1].x - p[0].x).abs()) else {
        return String::new();
    };
    let (x, y) = (i32::midpoint(piece[0].x, piece[1].x), piece[0].y);
    let label = mark.text();
    let wide = width(&label, SMALL, true) + 4;
    let colour = mark.level.colour();
    let attributes = format!(" text-anchor=\"middle\" font-weight=\"bold\" fill=\"{colour}\"");
    format!(
        "<rect x=\"{}\" y=\"{}\" width=\"{wide}\" height=\"13\" fill=\"#ffffff\" stroke=\"{colour}\"/>\n{}",
        x - wide / 2,
        y - 7,
        text(x, y + 3, &attributes, &label)
    )
}

/// A slot as the layout knows it.
fn port(node: usize, port: usize) -> Port {
    Port { node, port }
}
