//! The pages of one component: its log, its parameters, its connections.

use super::model::{Component, Model, Page, Rate};
use super::style::{bytes, chosen, faint, percent, plain, rate, strong, uptime};
use super::text::{fit, offset, opt, put, times, wrap};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::Span;
use rc_deploy_client::params::text;
use rc_deploy_client::states;
use rc_deploy_client::status::clock_text;
use rc_management::component::{ClockKind, ParameterStatus, Role, SlotStatus};

/// The most transitions of a state machine that are shown.
const TRANSITIONS: usize = 4;

/// The page of one component.
pub(super) fn component(model: &Model, body: &[Rect], buf: &mut Buffer) {
    let Some(component) = model.component() else {
        return;
    };
    let mut lines = body.iter().copied();
    let mut next = |spans: Vec<Span<'_>>| {
        if let Some(at) = lines.next() {
            put(buf, at, spans);
        }
    };
    let status = &component.status;
    let figures = component.figures();
    let mut facts = format!(
        "  up {}  cpu {}  mem {}",
        opt(figures.uptime, uptime),
        opt(figures.usage.cpu, percent),
        opt(figures.usage.memory, bytes)
    );
    if let Some(pid) = status.pid {
        facts += &format!("  pid {pid}");
    }
    if let Some(lifecycle) = status.lifecycle {
        facts += &format!("  {lifecycle}");
    }
    if status.by_hand {
        facts += "  by hand";
    }
    if let Some(process) = &status.process {
        facts += &format!("  in process {process}");
    }
    if let Some(host) = &status.host {
        facts += &format!("  on {host}");
    }
    next(vec![
        Span::styled(format!("{}  ", status.name), strong()),
        Span::styled(status.state.to_string(), model.state(status.state)),
        Span::raw(facts),
    ]);
    let mut facts = format!(
        "{}  restarts {}  lost {}",
        status.middleware, status.restarts, figures.lost
    );
    if let Some(report) = &component.report {
        facts += &format!("  period {}ms", report.period_ms);
        if let Some(work) = figures.compute {
            facts += &format!("  compute {}", times(work));
        }
        facts += &format!(
            "  overruns {}  errors {}",
            report.overruns, report.compute.errors
        );
    }
    let clock = component.report.as_ref().map(|report| &report.clock);
    if let Some(clock) = clock.filter(|clock| clock.kind != ClockKind::System) {
        facts += &format!("  {}", clock_text(clock));
    }
    next(vec![Span::raw(facts)]);
    let machine = component.report.as_ref().and_then(|r| r.machine.as_ref());
    if let Some(machine) = machine {
        let (now, last) = states::lines(machine, status.uptime_s.unwrap_or_default());
        next(vec![Span::raw(plain(&now))]);
        for line in last.iter().take(TRANSITIONS) {
            next(vec![Span::styled(plain(line), faint())]);
        }
    }
    let error = component
        .report
        .as_ref()
        .and_then(|r| r.last_error.as_ref());
    if let Some(text) = status.exit.as_ref().or(error) {
        next(vec![Span::styled(plain(text), model.bad())]);
    }
    for trouble in &status.troubles {
        let text = format!("{}: {}", trouble.code, plain(&trouble.message));
        next(vec![Span::styled(text, model.care())]);
    }
    let tabs = [
        (Page::Log, "log"),
        (Page::Parameters, "parameters"),
        (Page::Connections, "connections"),
    ];
    let mut spans = Vec::new();
    for (page, title) in tabs {
        let style = if page == model.page {
            chosen()
        } else {
            faint()
        };
        spans.push(Span::styled(format!(" {title} "), style));
        spans.push(Span::raw(" "));
    }
    if model.page == Page::Log && model.line > 0 {
        spans.push(Span::raw(format!("{} lines up", model.line)));
    }
    next(spans);
    let lines: Vec<Rect> = lines.collect();
    match model.page {
        Page::Parameters => parameters(model, &lines, buf),
        Page::Connections => connections(model, component, &lines, buf),
        _ if status.log.as_os_str().is_empty() => {
            say(
                "It prints to a terminal or a pipe, not into a file.",
                &lines,
                buf,
            );
        }
        Page::Table | Page::Log | Page::Help => log(model, &lines, buf),
    }
}

fn log(model: &Model, lines: &[Rect], buf: &mut Buffer) {
    if model.log.is_empty() {
        return say("It has printed nothing.", lines, buf);
    }
    let end = model.log.len().saturating_sub(model.line);
    let end = end.max(lines.len().min(model.log.len()));
    let start = end.saturating_sub(lines.len());
    for (line, &at) in model.log.range(start..end).zip(lines) {
        put(buf, at, [Span::raw(plain(line))]);
    }
}

fn say(text: &str, lines: &[Rect], buf: &mut Buffer) {
    if let Some(&at) = lines.first() {
        put(buf, at, [Span::styled(text.to_owned(), faint())]);
    }
}

/// The most lines below the parameters that tell more of the chosen one.
const NOTE_LINES: usize = 3;

fn parameters(model: &Model, lines: &[Rect], buf: &mut Buffer) {
    let known = match &model.parameters {
        None => return say("It has not answered yet.", lines, buf),
        Some(Err(reason)) => return say(&plain(reason), lines, buf),
        Some(Ok(known)) if known.parameters.is_empty() => {
            return say("It has none.", lines, buf);
        }
        Some(Ok(known)) => known,
    };
    let Some(&last) = lines.last() else {
        return;
    };
    let chosen_one = known.parameters.get(model.line);
    let note = chosen_one.map_or_else(String::new, note);
    let mut note = wrap(&note, usize::from(last.width));
    note.truncate(NOTE_LINES.min(lines.len()));
    let (lines, below) = lines.split_at(lines.len() - note.len());
    let width = |column: fn(&ParameterStatus) -> String, most: usize| {
        let widths = known.parameters.iter().map(|p| column(p).chars().count());
        widths.max().unwrap_or(0).min(most)
    };
    let path = width(|p| p.path.clone(), usize::from(last.width) / 2);
    let value = width(value, usize::from(last.width) / 3);
    let rest = usize::from(last.width).saturating_sub(path + value + 4);
    let first = offset(model.line, known.parameters.len(), lines.len());
    let shown = known.parameters.iter().enumerate().skip(first);
    for ((index, parameter), &at) in shown.zip(lines) {
        let style = if parameter.editable || parameter.restart {
            Style::new()
        } else {
            faint()
        };
        put(
            buf,
            at,
            [
                Span::styled(fit(&parameter.path, path), strong()),
                Span::styled(format!("  {}", fit(&self::value(parameter), value)), style),
                Span::raw(format!("  {}", fit(&parameter.allowed, rest).trim_end())),
            ],
        );
        if index == model.line {
            buf.set_style(at, chosen());
        }
    }
    for (line, &at) in note.into_iter().zip(below) {
        put(buf, at, [Span::styled(line, faint())]);
    }
}

/// Allowed values of a parameter, when a change takes effect, and its documentation.
fn note(parameter: &ParameterStatus) -> String {
    let mut notes = vec![match (parameter.editable, parameter.restart) {
        (_, true) => "changes at the next start",
        (true, _) => "changes at once",
        _ => "is fixed",
    }];
    if parameter.unsaved {
        notes.push("is not saved");
    }
    let doc = parameter.doc.join(" ");
    let allowed = plain(&parameter.allowed);
    format!("{allowed}; {}. {}", notes.join(", "), plain(&doc))
}

/// Present value of a parameter, and its value after the next start.
fn value(parameter: &ParameterStatus) -> String {
    let now = plain(&text(&parameter.value));
    let unsaved = if parameter.unsaved { "*" } else { "" };
    match &parameter.pending {
        Some(pending) => format!("{now} -> {}{unsaved}", plain(&text(pending))),
        None => format!("{now}{unsaved}"),
    }
}

fn connections(model: &Model, component: &Component, lines: &[Rect], buf: &mut Buffer) {
    let Some(report) = &component.report else {
        return say("It does not answer.", lines, buf);
    };
    if report.slots.is_empty() {
        return say("It has no slots.", lines, buf);
    }
    let rates = component
        .rates
        .iter()
        .copied()
        .map(Some)
        .chain(std::iter::repeat(None));
    let mut shown: Vec<Vec<Span<'_>>> = Vec::new();
    for (slot, rate) in report.slots.iter().zip(rates) {
        shown.push(slot_line(model, slot, rate));
        shown.push(others_line(model, slot));
    }
    let first = model.line.min(shown.len().saturating_sub(lines.len()));
    for (spans, &at) in shown.into_iter().skip(first).zip(lines) {
        put(buf, at, spans);
    }
}

fn slot_line<'t>(model: &Model, slot: &SlotStatus, per_second: Option<Rate>) -> Vec<Span<'t>> {
    let peers = format!(
        "{} peer{}",
        slot.peers,
        if slot.peers == 1 { "" } else { "s" }
    );
    let style = if slot.peers == 0 {
        model.care()
    } else {
        model.good()
    };
    let takes = matches!(slot.role, Role::Implements | Role::SubscribesTo);
    let number = per_second.map(|r| if takes { r.handled } else { r.sent });
    let mut facts = format!("  {}/s", opt(number, rate));
    if takes {
        if slot.handlers.count > 0 {
            facts += &format!("  {}", times(slot.handlers));
        }
        facts += &format!("  {} errors", slot.handlers.errors);
    }
    if slot.role == Role::SubscribesTo {
        facts += &format!("  {} lost", slot.lost);
    }
    if let Some(forwarded) = slot.forwarded {
        facts += &format!(
            "  {} forwarded, delay {} µs, at most {} µs",
            forwarded.messages, forwarded.mean_us, forwarded.most_us
        );
    }
    if let Some(converted) = &slot.converted {
        facts += &format!("  {} converted", converted.messages);
        if converted.bad_values > 0 {
            facts += &format!(", {} refused", converted.bad_values);
        }
        if converted.unplaced > 0 {
            facts += &format!(", {} without a transform", converted.unplaced);
        }
        if converted.locked > 0 {
            facts += &format!(", {} at a gimbal lock", converted.locked);
        }
    }
    if let Some(freshness) = slot.freshness {
        if let Some(age) = freshness.currency_ms {
            facts += &format!("  {age:.1} ms old");
        }
        if let Some(rate) = freshness.rate {
            facts += &format!(", {:.0} % of its uses fresh", 100.0 * rate);
        }
        facts += &format!(", {} cached", freshness.cached);
        if freshness.unmatched > 0 {
            facts += &format!(", {} without a match", freshness.unmatched);
        }
    }
    vec![
        Span::styled(slot.name.clone(), strong()),
        Span::raw(format!("  {}  ", slot.role.word())),
        Span::styled(peers, style),
        Span::raw(facts),
    ]
}

fn others_line<'t>(model: &Model, slot: &SlotStatus) -> Vec<Span<'t>> {
    let arrow = match slot.role {
        Role::Requires | Role::Publishes => "  → ",
        Role::Implements | Role::SubscribesTo => "  ← ",
    };
    let others = model.others(slot);
    let address = slot.address.as_deref().unwrap_or("no address");
    let text = match (others.as_slice(), slot.peers) {
        ([], 0) => format!("nobody at {address}"),
        // Programs that rcdeploy has not started.
        ([], _) => format!("strangers at {address}"),
        (others, _) => others.join(", "),
    };
    let style = if others.is_empty() {
        faint()
    } else {
        Style::new()
    };
    let transports = slot.transports.iter();
    let transports: Vec<String> = transports
        .map(|of| format!("{} ({})", of.middleware, of.messages))
        .collect();
    let over = if transports.is_empty() {
        slot.middleware.clone()
    } else {
        transports.join(", ")
    };
    let over = format!("  over {over}, {}", slot.interface);
    vec![
        Span::raw(arrow),
        Span::styled(text, style),
        Span::styled(over, faint()),
    ]
}
