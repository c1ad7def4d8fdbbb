//! Draws a model at any size.

use super::keys::{HELP, leaving};
use super::model::{Component, Figures, Host, Model, Page, Prompt};
use super::rows::{Kind, Row};
use super::style::{bytes, chosen, faint, percent, plain, rate, strong, uptime};
use super::text::{fit, offset, opt, put, times};
use super::{chains, details};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::Span;
use rc_management::event::{Event, time_text};
use rc_management::supervisor::ComponentState;

/// Below this width a name is cut.
const NAME: usize = 12;

/// One column of the table, right of the name.
struct Column {
    head: &'static str,
    width: usize,
    /// The lowest numbers stay when there is little room.
    rank: usize,
    cell: fn(&Figures) -> String,
}

/// Columns of the table in addition to name and state.
const COLUMNS: [Column; 10] = [
    Column {
        head: "UP",
        width: 6,
        rank: 7,
        cell: |f| opt(f.uptime, uptime),
    },
    Column {
        head: "CPU",
        width: 5,
        rank: 0,
        cell: |f| opt(f.usage.cpu, percent),
    },
    Column {
        head: "MEM",
        width: 5,
        rank: 1,
        cell: |f| opt(f.usage.memory, bytes),
    },
    Column {
        head: "IN/s",
        width: 5,
        rank: 4,
        cell: |f| opt(f.traffic, |t| rate(t.values_in)),
    },
    Column {
        head: "OUT/s",
        width: 5,
        rank: 5,
        cell: |f| opt(f.traffic, |t| rate(t.values_out)),
    },
    Column {
        head: "CALLS/s",
        width: 7,
        rank: 6,
        cell: |f| opt(f.traffic, |t| rate(t.calls)),
    },
    Column {
        head: "COMPUTE p50/p99",
        width: 15,
        rank: 8,
        cell: |f| opt(f.compute, times),
    },
    Column {
        head: "HANDLER p50/p99",
        width: 15,
        rank: 9,
        cell: |f| opt(f.handlers, times),
    },
    Column {
        head: "RESTARTS",
        width: 8,
        rank: 2,
        cell: |f| f.restarts.to_string(),
    },
    Column {
        head: "LOST",
        width: 5,
        rank: 3,
        cell: |f| rate(f.lost as f64),
    },
];

/// Draws the whole screen.
pub(crate) fn draw(model: &Model, area: Rect, buf: &mut Buffer) {
    let lines = split(area);
    let Some((&head, rest)) = lines.split_first() else {
        return;
    };
    header(model, head, buf);
    let Some((&foot, body)) = rest.split_last() else {
        return;
    };
    footer(model, foot, buf);
    match model.page {
        Page::Table => table_and_events(model, body, buf),
        Page::Help => help(model, body, buf),
        Page::Log | Page::Parameters | Page::Connections => details::component(model, body, buf),
    }
}

/// The lines of the screen.
fn split(area: Rect) -> Vec<Rect> {
    if area.width == 0 {
        return Vec::new();
    }
    let line = |y| Rect::new(area.x, y, area.width, 1);
    (area.top()..area.bottom()).map(line).collect()
}

fn header(model: &Model, at: Rect, buf: &mut Buffer) {
    let mut spans = vec![Span::styled(model.network.clone(), strong())];
    if model.stopping {
        let text = match model.host {
            Host::Up => "  STOPPING, ctrl+c kills",
            Host::Top => "  STOPPING",
        };
        spans.push(Span::styled(text, model.care()));
    }
    for (state, count) in model.counts() {
        spans.push(Span::raw("  "));
        spans.push(Span::styled(format!("{count} {state}"), model.state(state)));
    }
    let all = Figures::of(&model.components);
    let right = format!(
        "{} {}",
        opt(all.usage.cpu, percent),
        opt(all.usage.memory, bytes)
    );
    let used: usize = spans.iter().map(Span::width).sum();
    let room = usize::from(at.width).saturating_sub(used + right.len());
    if room > 1 {
        spans.push(Span::raw(" ".repeat(room)));
        spans.push(Span::styled(right, faint()));
    }
    put(buf, at, spans);
}

fn footer(model: &Model, at: Rect, buf: &mut Buffer) {
    match &model.prompt {
        Some(Prompt::Confirm { question, .. }) => {
            let answers = Span::styled("y/n ", strong());
            return put(
                buf,
                at,
                [answers, Span::styled(question.clone(), model.care())],
            );
        }
        Some(Prompt::Edit {
            path,
            text,
            secret,
            is_old,
            ..
        }) => {
            let shown = if *secret {
                "*".repeat(text.chars().count())
            } else {
                text.clone()
            };
            // Shows the end of the input.
            let head = format!("{path} = ");
            let room = usize::from(at.width).saturating_sub(head.len() + 1).max(1);
            let skipped = shown.chars().count().saturating_sub(room);
            let shown: String = shown.chars().skip(skipped).collect();
            return put(
                buf,
                at,
                [
                    Span::styled(head, strong()),
                    // The old value is marked as what typing replaces.
                    Span::styled(shown, if *is_old { chosen() } else { Style::new() }),
                    Span::styled(" ", if *is_old { Style::new() } else { chosen() }),
                ],
            );
        }
        None => {}
    }
    if let Some(notice) = &model.notice {
        let style = if notice.failed {
            model.bad()
        } else {
            model.good()
        };
        return put(buf, at, [Span::styled(plain(&notice.text), style)]);
    }
    let (keys, last): (&[(&str, &str)], _) = match model.page {
        Page::Table if model.component().is_none() => (
            &[
                ("r", "restart"),
                ("x", "stop"),
                ("s", "start"),
                ("e", "emergency"),
                ("enter", "fold"),
            ],
            ("?", "help"),
        ),
        Page::Table => (
            &[
                ("r", "restart"),
                ("x", "stop"),
                ("s", "start"),
                ("e", "emergency"),
                ("enter", "log"),
                ("p", "parameters"),
                ("c", "connections"),
            ],
            ("?", "help"),
        ),
        Page::Parameters => (
            &[
                ("enter", "change"),
                ("w", "save"),
                ("tab", "connections"),
                ("r", "restart"),
                ("e", "emergency"),
            ],
            ("esc", "back"),
        ),
        Page::Log => (
            &[
                ("tab", "parameters"),
                ("r", "restart"),
                ("x", "stop"),
                ("s", "start"),
                ("e", "emergency"),
            ],
            ("esc", "back"),
        ),
        Page::Connections => (
            &[
                ("tab", "log"),
                ("r", "restart"),
                ("x", "stop"),
                ("s", "start"),
                ("e", "emergency"),
            ],
            ("esc", "back"),
        ),
        Page::Help => (&[], ("esc", "back")),
    };
    let quit = match model.host {
        Host::Up => ("q", "stop the network"),
        Host::Top => ("q", "leave"),
    };
    let width = |(key, what): &(&str, &str)| key.len() + what.len() + 3;
    let mut room = usize::from(at.width).saturating_sub(width(&last) + width(&quit));
    let mut spans = Vec::new();
    let fitting = keys.iter().take_while(|key| {
        let fits = room >= width(key);
        room = room.saturating_sub(width(key));
        fits
    });
    for (key, what) in fitting.chain([&last, &quit]) {
        spans.push(Span::styled(*key, strong()));
        spans.push(Span::raw(format!(" {what}  ")));
    }
    put(buf, at, spans);
}

fn table_and_events(model: &Model, body: &[Rect], buf: &mut Buffer) {
    let rows = model.rows();
    // The events get the rest of the table's room, and at least a third; if that is nothing, the
    // table gets everything.
    let wanted = rows.len() + 1;
    let least = match body.len() {
        0..6 => 0,
        lines => lines / 3,
    };
    let for_table = wanted.min(body.len() - least);
    let for_table = if body.len() - for_table < 2 {
        body.len()
    } else {
        for_table
    };
    let (above, below) = body.split_at(for_table);
    table(model, &rows, above, buf);
    let (middle, below) = below.split_at(chains::wanted(model, below.len()));
    chains::draw(model, middle, buf);
    events(model, below, buf);
}

/// The least room after a name in which active states are shown.
const STATES: usize = 8;
/// From this width on, columns make room for active states, up to this width of the first column.
const WIDE: usize = 72;
const WIDEST: usize = 24;

/// The width of the first column: it has room for names, and on a wide screen for active states.
fn name_width(model: &Model, rows: &[Row<'_>], width: usize) -> usize {
    if width < WIDE {
        return NAME;
    }
    let wanted = rows.iter().filter(|row| row.kind == Kind::Component);
    let wanted = wanted.map(|row| {
        let states = row.members.iter().map(|&m| &model.components[m]);
        let states = states.map(|one| machine_states(one).chars().count());
        let states = states.max().filter(|length| *length > 0);
        states.map_or(0, |length| {
            2 * row.depth + row.label.chars().count() + 2 + length
        })
    });
    wanted
        .max()
        .unwrap_or(0)
        .clamp(NAME, (width / 4).min(WIDEST))
}

fn table(model: &Model, rows: &[Row<'_>], lines: &[Rect], buf: &mut Buffer) {
    let Some((&head, lines)) = lines.split_first() else {
        return;
    };
    let width = usize::from(head.width);
    let columns = columns(width, name_width(model, rows, width));
    let taken: usize = columns.iter().map(|c| c.width + 1).sum();
    let name = width.saturating_sub(taken + 10).max(NAME);
    let mut text = format!("{:name$} {:9}", "COMPONENT", "STATE");
    for column in &columns {
        text += &format!(" {:>1$}", column.head, column.width);
    }
    put(buf, head, [Span::styled(text, strong())]);
    let selected = rows.iter().position(|row| row.path == model.selected);
    let first = offset(selected.unwrap_or(0), rows.len(), lines.len());
    for (row, &at) in rows.iter().skip(first).zip(lines) {
        let members: Vec<&Component> = row.members.iter().map(|&m| &model.components[m]).collect();
        let figures = Figures::of(members.iter().copied());
        let mark = match row.kind {
            Kind::Component => "",
            Kind::Group { folded: true } => "▸ ",
            Kind::Group { folded: false } => "▾ ",
        };
        let label = format!("{}{mark}{}", "  ".repeat(row.depth), row.label);
        // The active states of its machine, where a long name leaves room.
        let states = match members.as_slice() {
            [one] if row.kind == Kind::Component => machine_states(one),
            _ => String::new(),
        };
        let room = name.saturating_sub(label.chars().count());
        let states = if states.is_empty() || room < STATES {
            " ".repeat(room)
        } else {
            fit(&format!("  {states}"), room)
        };
        let (state, style) = state(model, row, &members);
        let mut cells = String::new();
        for column in &columns {
            cells += &format!(" {:>1$}", (column.cell)(&figures), column.width);
        }
        let name_style = if row.kind == Kind::Component {
            Style::new()
        } else {
            strong()
        };
        put(
            buf,
            at,
            [
                Span::styled(fit(&label, name - room), name_style),
                Span::styled(format!("{states} "), faint()),
                Span::styled(format!("{state:9}"), style),
                Span::raw(cells),
            ],
        );
        if row.path == model.selected {
            buf.set_style(at, chosen());
        }
    }
}

/// The names of the active states of a component's machine, without those that contain them.
fn machine_states(component: &Component) -> String {
    let machine = component.status.machine.as_ref();
    let states = machine.into_iter().flat_map(|machine| &machine.states);
    let names: Vec<String> = states
        .map(|path| plain(path.rsplit('.').next().unwrap_or_default()))
        .collect();
    names.join(" ")
}

/// The columns that fit after the name, in their order.
fn columns(width: usize, name: usize) -> Vec<&'static Column> {
    let mut ranked: Vec<&Column> = COLUMNS.iter().collect();
    ranked.sort_by_key(|column| column.rank);
    let mut room = width.saturating_sub(name + 10);
    let mut rank = 0;
    for column in ranked {
        if room < column.width + 1 {
            break;
        }
        room -= column.width + 1;
        rank = column.rank + 1;
    }
    COLUMNS.iter().filter(|column| column.rank < rank).collect()
}

/// The state of a component. For a group, the number of running components, or their worst state.
fn state(model: &Model, row: &Row<'_>, members: &[&Component]) -> (String, Style) {
    if row.kind == Kind::Component
        && let Some(one) = members.first()
    {
        let state = one.status.state;
        return if one.silent && state == ComponentState::Running {
            ("silent".to_owned(), model.care())
        } else if state == ComponentState::Running && !one.is_active() {
            // Its page shows the whole word.
            (one.lifecycle_word(), model.care())
        } else if state == ComponentState::Running && one.status.by_hand {
            ("by hand".to_owned(), model.good())
        } else if state == ComponentState::Running && !one.status.troubles.is_empty() {
            // Its page shows the conditions.
            (format!("{state} !"), model.care())
        } else {
            (state.to_string(), model.state(state))
        };
    }
    let is = |state: ComponentState| members.iter().filter(|c| c.status.state == state).count();
    for bad in [
        ComponentState::Failed,
        ComponentState::Hung,
        ComponentState::Emergency,
    ] {
        if is(bad) > 0 {
            return (bad.to_string(), model.state(bad));
        }
    }
    let running = is(ComponentState::Running);
    let style = if running == members.len() {
        model.good()
    } else {
        model.care()
    };
    (format!("{running}/{}", members.len()), style)
}

pub(super) fn rule(at: Rect, title: &str, buf: &mut Buffer) {
    let width = usize::from(at.width);
    let line = format!("── {title} ");
    let rest = width.saturating_sub(line.chars().count());
    put(
        buf,
        at,
        [Span::styled(format!("{line}{}", "─".repeat(rest)), faint())],
    );
}

fn events(model: &Model, lines: &[Rect], buf: &mut Buffer) {
    let Some((&head, lines)) = lines.split_first() else {
        return;
    };
    let title = match model.events_scroll {
        0 => "events".to_owned(),
        lines => format!("events, {lines} lines up"),
    };
    rule(head, &title, buf);
    // The newest event is the lowest. The first line of a message precedes the others.
    let mut shown: Vec<Vec<Span<'_>>> = Vec::new();
    for event in model.events.iter().rev() {
        if shown.len() >= lines.len() + model.events_scroll {
            break;
        }
        shown.extend(event_lines(model, event).into_iter().rev());
    }
    let scroll = model
        .events_scroll
        .min(shown.len().saturating_sub(lines.len()));
    let shown = shown.into_iter().skip(scroll).take(lines.len());
    let shown: Vec<Vec<Span<'_>>> = shown.collect();
    for (spans, &at) in shown.into_iter().rev().zip(lines) {
        put(buf, at, spans);
    }
}

fn event_lines<'e>(model: &Model, event: &'e Event) -> Vec<Vec<Span<'e>>> {
    let style = model.severity(event.severity);
    // The time of the day, of a time of RFC 3339.
    let time = time_text(event.time);
    let time = time.get(11..19).unwrap_or_default();
    let mut lines = event.message.lines();
    let name = event.component.as_ref().map(|name| format!("{name}: "));
    let first = vec![
        Span::styled(format!("{time} "), faint()),
        Span::styled(name.unwrap_or_default(), strong()),
        Span::styled(plain(lines.next().unwrap_or_default()), style),
    ];
    let others = lines.map(|line| vec![Span::raw(" ".repeat(9)), Span::raw(plain(line))]);
    std::iter::once(first).chain(others).collect()
}

fn help(model: &Model, lines: &[Rect], buf: &mut Buffer) {
    for ((keys, what), &at) in HELP.iter().zip(lines) {
        let what = if what.is_empty() {
            leaving(model.host)
        } else {
            what
        };
        put(
            buf,
            at,
            [
                Span::styled(format!("{keys:14}"), strong()),
                Span::raw(what),
            ],
        );
    }
}
