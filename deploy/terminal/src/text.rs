//! Texts and lines as all pages draw them.

use super::style::time;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use rc_management::component::Timing;

pub(super) fn opt<T>(value: Option<T>, show: impl FnOnce(T) -> String) -> String {
    value.map_or_else(|| "-".to_owned(), show)
}

pub(super) fn times(work: Timing) -> String {
    format!("{}/{}", time(work.p50_us), time(work.p99_us))
}

pub(super) fn put<'t>(buf: &mut Buffer, at: Rect, spans: impl IntoIterator<Item = Span<'t>>) {
    let line = Line::from_iter(spans);
    buf.set_line(at.x, at.y, &line, at.width);
}

/// A list of which `at` is to be seen: the first line that is shown.
pub(super) fn offset(at: usize, count: usize, room: usize) -> usize {
    at.saturating_sub(room / 2).min(count.saturating_sub(room))
}

/// A text of just this width.
pub(super) fn fit(text: &str, width: usize) -> String {
    let count = text.chars().count();
    if count > width {
        let cut: String = text.chars().take(width.saturating_sub(1)).collect();
        format!("{cut}…")
    } else {
        format!("{text}{}", " ".repeat(width - count))
    }
}
