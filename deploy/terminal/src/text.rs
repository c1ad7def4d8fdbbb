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

/// A text as lines of at most `width`, broken between words where that is possible. At least one
/// line.
pub(super) fn wrap(text: &str, width: usize) -> Vec<String> {
    let width = width.max(1);
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let mut word: Vec<char> = word.chars().collect();
        loop {
            let line = lines.last().map_or(0, |line| line.chars().count());
            let gap = usize::from(line > 0);
            if line + gap + word.len() <= width || line == 0 && word.len() <= width {
                break;
            }
            if line > 0 {
                lines.push(String::new());
            } else {
                let rest = word.split_off(width);
                lines.pop();
                lines.extend([word.into_iter().collect(), String::new()]);
                word = rest;
            }
        }
        if let Some(line) = lines.last_mut() {
            if !line.is_empty() {
                line.push(' ');
            }
            line.extend(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::wrap;

    #[test]
    fn lines_break_between_words() {
        assert_eq!(wrap("from 150 to 3000", 9), ["from 150", "to 3000"]);
        assert_eq!(wrap("abcdefgh ij", 3), ["abc", "def", "gh", "ij"]);
        assert_eq!(wrap("", 3), [""]);
    }
}
