//! The chains of the network: a line for each, coloured by its state.

use super::model::Model;
use super::style::{faint, plain, strong};
use super::text::{fit, put};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::Span;
use rc_management::chains::ChainStatus;

/// The widest name that is not cut.
const NAME: usize = 16;

/// The lines that the chains want, of so many in all: with their title, at most a third.
pub(super) fn wanted(model: &Model, lines: usize) -> usize {
    match model.chains.len() {
        0 => 0,
        chains => {
            let most = lines / 3;
            if most < 2 { 0 } else { most.min(chains + 1) }
        }
    }
}

/// Draws the chains below their title. Those that are late come first where there is no room for all.
pub(super) fn draw(model: &Model, lines: &[Rect], buf: &mut Buffer) {
    let Some((&head, lines)) = lines.split_first() else {
        return;
    };
    let mut shown: Vec<&ChainStatus> = model.chains.iter().collect();
    let title = match shown.len().checked_sub(lines.len()) {
        None | Some(0) => "chains".to_owned(),
        Some(hidden) => {
            shown.sort_by_key(|chain| chain.conditions.is_empty());
            format!("chains, {hidden} more")
        }
    };
    super::render::rule(head, &title, buf);
    let names = shown.iter().map(|chain| chain.name.chars().count());
    let name = names.max().unwrap_or(0).min(NAME);
    for (chain, &at) in shown.iter().zip(lines) {
        let style = style(model, chain);
        let spans = [
            Span::styled(format!("{}  ", fit(&plain(&chain.name), name)), strong()),
            Span::styled(way(chain), style),
            Span::styled(format!("  {}", times(chain)), style),
        ];
        put(buf, at, spans);
    }
}

fn style(model: &Model, chain: &ChainStatus) -> Style {
    if !chain.conditions.is_empty() {
        model.bad()
    } else if !chain.missing.is_empty() {
        model.care()
    } else if chain.times.is_none() {
        faint()
    } else {
        model.good()
    }
}

/// `lidar ━ avoider 26.4 ━ base 0.6`: the components, each with the median of its time.
fn way(chain: &ChainStatus) -> String {
    let first = chain.hops.first().map(|hop| hop.component.as_str());
    let begins = chain.from.split('.').next().unwrap_or_default();
    // A chain may begin where its first component receives a message.
    let mut way = match first {
        Some(first) if first == begins => String::new(),
        _ => plain(begins),
    };
    for hop in &chain.hops {
        if !way.is_empty() {
            way += " ━ ";
        }
        way += &plain(&hop.component);
        if let Some(times) = hop.times {
            way += &format!(" {:.1}", times.p50_ms);
        }
    }
    way
}

/// Median, percentile and worst time, the limit, and what is wrong.
fn times(chain: &ChainStatus) -> String {
    let mut text = match chain.times {
        None => "no message has come to the end".to_owned(),
        Some(times) => format!(
            "{:.1} ms, p99 {:.1}, worst {:.1}",
            times.p50_ms, times.p99_ms, times.worst_ms
        ),
    };
    if let Some(within) = chain.within_ms {
        text += &format!(" of {within}");
    }
    for note in chain.conditions.iter().chain(&chain.missing) {
        text += &format!(", {}", plain(note));
    }
    text
}
