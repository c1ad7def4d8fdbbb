//! The legend below a picture: symbols and findings.

use super::{INK, PORT, SMALL, arrow, dashes};
use crate::marks::{Level, Marks};
use crate::model::Graph;
use rc_deploy_network::topology::Kind;
use rc_drawing::{text, width, wrap};
use rc_graph_layout::Point;
use std::collections::BTreeSet;

const LINE: i32 = 15;
/// Above the legend, and between its two parts.
const SPACE: i32 = 18;
/// The width of a sample line, and the gaps after it and after its name.
const SAMPLE: i32 = 34;
const GAP: i32 = 6;
/// The minimum width of a line of findings.
const LEAST: i32 = 460;

enum Sample {
    Line(&'static str),
    Call,
    Topic,
    Provides,
    Consumes,
}

pub(super) struct Legend {
    pub(super) width: i32,
    pub(super) height: i32,
    /// The explained symbols: position, drawing, name.
    samples: Vec<(Point, Sample, &'static str)>,
    findings: Vec<(Level, Vec<String>)>,
    /// Where the findings begin.
    below: i32,
}

impl Legend {
    /// The legend of a picture that is this wide.
    pub(super) fn new(graph: &Graph, marks: &Marks<'_>, wide: i32) -> Self {
        let room = wide.max(LEAST);
        let mut all: Vec<(Sample, &'static str)> = Vec::new();
        let has = |kind| graph.connections.iter().any(|c| c.kind == kind);
        let has_slot = |is_provided: bool| {
            let mut slots = graph.components.iter().flat_map(|c| &c.slots);
            slots.any(|slot| slot.role.is_provided() == is_provided)
        };
        if has(Kind::Call) {
            all.push((Sample::Call, "call"));
        }
        if has(Kind::Topic) {
            all.push((Sample::Topic, "data of a topic"));
        }
        if has_slot(true) {
            all.push((Sample::Provides, "implements or publishes"));
        }
        if has_slot(false) {
            all.push((Sample::Consumes, "requires or subscribes"));
        }
        let used: BTreeSet<&str> = graph.connections.iter().map(|c| c.middleware).collect();
        all.extend(used.into_iter().map(|m| (Sample::Line(m), m)));
        let (mut x, mut y, mut furthest) = (0, SPACE, 0);
        let mut samples = Vec::new();
        for (sample, name) in all {
            let step = sample.width() + GAP + width(name, SMALL, false);
            if x > 0 && x + step > room {
                (x, y) = (0, y + LINE);
            }
            samples.push((Point::new(x, y), sample, name));
            furthest = furthest.max(x + step);
            x += step + 3 * GAP;
        }
        let numbers = marks.listed.iter().zip(1..);
        let findings: Vec<(Level, Vec<String>)> = numbers
            .map(|((level, _), n)| (*level, wrap(&marks.line(n), SMALL, room)))
            .collect();
        let below = match samples.len() {
            0 => 0,
            _ => y + LINE / 2,
        };
        let lines: usize = findings.iter().map(|(_, lines)| lines.len()).sum();
        let height = match lines {
            0 => below,
            lines => below + SPACE + LINE * lines as i32,
        };
        Self {
            width: if lines > 0 { room } else { furthest },
            height,
            samples,
            findings,
            below,
        }
    }

    pub(super) fn draw(&self, at: Point) -> String {
        let mut out = format!("<g transform=\"translate({} {})\">\n", at.x, at.y);
        for (place, sample, name) in &self.samples {
            out += &sample.draw(*place);
            out += &text(place.x + sample.width() + GAP, place.y + 4, "", name);
        }
        let mut y = self.below + SPACE;
        for (level, lines) in &self.findings {
            for line in lines {
                out += &text(0, y + 4, &format!(" fill=\"{}\"", level.colour()), line);
                y += LINE;
            }
        }
        out + "</g>\n"
    }
}

impl Sample {
    fn width(&self) -> i32 {
        match self {
            Self::Line(_) | Self::Call | Self::Topic => SAMPLE,
            Self::Provides | Self::Consumes => 2 * PORT,
        }
    }

    fn draw(&self, at: Point) -> String {
        let line = |dashes: &str| {
            let dashes = match dashes {
                "" => String::new(),
                dashes => format!(" stroke-dasharray=\"{dashes}\""),
            };
            format!(
                "<path d=\"M{} {}H{}\" stroke=\"{INK}\" stroke-width=\"1.2\"{dashes}/>\n",
                at.x,
                at.y,
                at.x + SAMPLE
            )
        };
        let square = |fill: &str| {
            format!(
                "<rect x=\"{}\" y=\"{}\" width=\"{2}\" height=\"{2}\" fill=\"{fill}\" stroke=\"{INK}\"/>\n",
                at.x,
                at.y - PORT,
                2 * PORT
            )
        };
        match self {
            Self::Line(middleware) => line(dashes(middleware)),
            Self::Call => line("") + &arrow(Point::new(at.x - PORT - 1, at.y), true, INK),
            Self::Topic => {
                let end = Point::new(at.x + SAMPLE + PORT + 1, at.y);
                line("") + &arrow(end, false, INK)
            }
            Self::Provides => square(INK),
            Self::Consumes => square("#ffffff"),
        }
    }
}
