//! The elements of SVG: frames, lines, boxes, in this order.

use crate::boxes::{Boxes, Content, DOT, HEAD, NAME, ROW, SIDE, name, rows};
use rc_diagnostics::xml::escaped;
use rc_drawing::{INK, forks, head, path, rounded, text};
use rc_graph_layout::{Layout, Rect};
use rc_smdsl::StateMachine;
use rc_smdsl::model::{StateId, StateKind};
use std::collections::BTreeSet;

const BLUE: &str = "#0b5cad";
/// The background of an active state.
const LIT: &str = "#d6e9fb";

/// All elements.
pub(crate) fn elements(
    machine: &StateMachine,
    boxes: &Boxes,
    layout: &Layout,
    active: &BTreeSet<String>,
) -> String {
    let is_active = |id: StateId| active.contains(&machine.state(id).name.text);
    let (mut frames, mut states) = (String::new(), String::new());
    for (content, rect) in boxes.contents.iter().zip(&layout.boxes) {
        match content {
            Content::Frame(id) => frames += &frame(machine, *id, rect, is_active(*id)),
            Content::State(id) => states += &state(machine, *id, rect, is_active(*id)),
            Content::Start => {
                let (x, y) = (rect.x + DOT / 2, rect.y + DOT / 2);
                states += &format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\"/>\n", DOT / 2);
            }
        }
    }
    frames + &lines(boxes, layout) + &states
}

fn stroke(is_active: bool) -> String {
    if is_active {
        format!("stroke=\"{BLUE}\" stroke-width=\"2.4\"")
    } else {
        format!("stroke=\"{INK}\" stroke-width=\"1.2\"")
    }
}

fn frame(machine: &StateMachine, id: StateId, rect: &Rect, is_active: bool) -> String {
    let is_parallel = machine
        .state(id)
        .region
        .as_ref()
        .is_some_and(|r| r.parallel);
    let dashes = if is_parallel {
        " stroke-dasharray=\"7 3\""
    } else {
        ""
    };
    let frame = format!(
        "fill=\"#000000\" fill-opacity=\"0.04\" {}{dashes}",
        stroke(is_active)
    );
    rounded(rect, 10, &frame)
}

/// A state with its rows.
fn state(machine: &StateMachine, id: StateId, rect: &Rect, is_active: bool) -> String {
    let it = machine.state(id);
    let fill = if is_active { LIT } else { "#ffffff" };
    let mut out = String::from("<g>");
    let active = if is_active { ", active" } else { "" };
    let doc: String = it.doc.iter().map(|line| format!("\n{line}")).collect();
    let kind = match (&it.kind, &it.region) {
        (StateKind::End, _) => "end state",
        (StateKind::History { .. }, _) => "history state",
        (StateKind::Plain, Some(region)) if region.parallel => "parallel state",
        (StateKind::Plain, _) => "state",
    };
    let title = format!("{kind} {}{active}{doc}", it.name.text);
    let lines: Vec<String> = title.lines().map(escaped).collect();
    out += &format!("<title>{}</title>\n", lines.join("\n"));
    out += &rounded(rect, 6, &format!("fill=\"{fill}\" {}", stroke(is_active)));
    if it.kind == StateKind::End {
        let inner = Rect {
            x: rect.x + 3,
            y: rect.y + 3,
            width: rect.width - 6,
            height: rect.height - 6,
        };
        out += &rounded(&inner, 4, &format!("fill=\"none\" {}", stroke(false)));
    }
    let bold = format!(" font-size=\"{NAME}\" font-weight=\"bold\" text-anchor=\"middle\"");
    out += &text(
        rect.x + rect.width / 2,
        rect.y + 16,
        &bold,
        &name(machine, id),
    );
    for ((row, line), at) in rows(machine, id).into_iter().zip(0..) {
        let y = rect.y + HEAD + at * ROW + ROW / 2 + 4;
        let (x, anchor) = match line {
            Some(_) => (rect.x + rect.width - SIDE, " text-anchor=\"end\""),
            None => (rect.x + SIDE, ""),
        };
        out += &text(x, y, anchor, &row);
    }
    out + "</g>\n"
}

fn lines(boxes: &Boxes, layout: &Layout) -> String {
    let (mut drawn, mut heads) = (String::new(), BTreeSet::new());
    for (line, routes) in boxes.lines.iter().zip(&layout.routes) {
        let forks = forks(routes);
        let paths: String = routes.iter().map(|route| path(route, &forks)).collect();
        let dashes = if line.is_initial {
            " stroke-dasharray=\"2 3\""
        } else {
            ""
        };
        drawn += &format!(
            "<g><title>{}</title><path d=\"{paths}\" fill=\"none\" stroke=\"{INK}\" stroke-width=\"1.2\"{dashes}/></g>\n",
            escaped(&line.title)
        );
        heads.extend(routes.iter().filter_map(|route| route.last().copied()));
    }
    drawn + &heads.into_iter().map(head).collect::<String>()
}
