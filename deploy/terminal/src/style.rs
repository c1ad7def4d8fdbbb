//! Styles: few colours, and no meaning in colour alone.

use super::model::Model;
use ratatui::style::{Color, Modifier, Style};
use rc_management::supervisor::{ComponentState, Severity};

impl Model {
    fn coloured(&self, colour: Color) -> Style {
        if self.colours {
            Style::new().fg(colour)
        } else {
            Style::new()
        }
    }

    /// Good.
    pub(crate) fn good(&self) -> Style {
        self.coloured(Color::Green)
    }

    /// In transition, or of interest.
    pub(crate) fn care(&self) -> Style {
        self.coloured(Color::Yellow)
    }

    /// Bad.
    pub(crate) fn bad(&self) -> Style {
        self.coloured(Color::Red).add_modifier(Modifier::BOLD)
    }

    pub(crate) fn state(&self, state: ComponentState) -> Style {
        match state {
            ComponentState::Running => self.good(),
            ComponentState::Waiting | ComponentState::Starting | ComponentState::Stopping => {
                self.care()
            }
            ComponentState::Emergency | ComponentState::Failed | ComponentState::Hung => self.bad(),
            ComponentState::Done | ComponentState::Stopped => faint(),
        }
    }

    pub(crate) fn severity(&self, severity: Severity) -> Style {
        match severity {
            Severity::Error => self.bad(),
            Severity::Warning => self.care(),
            Severity::Info => Style::new(),
        }
    }
}

pub(crate) fn faint() -> Style {
    Style::new().add_modifier(Modifier::DIM)
}

pub(crate) fn strong() -> Style {
    Style::new().add_modifier(Modifier::BOLD)
}

pub(crate) fn chosen() -> Style {
    Style::new().add_modifier(Modifier::REVERSED)
}

/// Text without control sequences.
pub(crate) fn plain(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '\t' => plain.push_str("    "),
            // A sequence of the terminal, up to its last letter.
            '\u{1b}' if letters.next_if_eq(&'[').is_some() => {
                while letters.next().is_some_and(|l| !('@'..='~').contains(&l)) {}
            }
            letter if letter.is_control() => {}
            letter => plain.push(letter),
        }
    }
    plain
}

/// Seconds as `59s`, `1m02s`, `3h04m`, `2d03h`.
pub(crate) fn uptime(seconds: f64) -> String {
    let s = seconds.max(0.0) as u64;
    match s {
        0..60 => format!("{s}s"),
        60..3600 => format!("{}m{:02}s", s / 60, s % 60),
        3600..86_400 => format!("{}h{:02}m", s / 3600, s / 60 % 60),
        _ => format!("{}d{:02}h", s / 86_400, s / 3600 % 24),
    }
}

/// Bytes in three digits and a unit.
pub(crate) fn bytes(bytes: u64) -> String {
    short(bytes as f64 / 1024.0, 1024.0, &["K", "M", "G", "T"])
}

/// Microseconds in three digits and a unit.
pub(crate) fn time(us: u64) -> String {
    short(us as f64, 1000.0, &["us", "ms", "s"])
}

/// A rate per second.
pub(crate) fn rate(per_second: f64) -> String {
    if per_second == 0.0 {
        "0".to_owned()
    } else {
        short(per_second, 1000.0, &["", "k", "M", "G"])
    }
}

/// A part of one processor.
pub(crate) fn percent(part: f64) -> String {
    let percent = part * 100.0;
    if percent < 9.95 {
        format!("{percent:.1}%")
    } else {
        format!("{percent:.0}%")
    }
}

fn short(mut value: f64, step: f64, units: &[&str]) -> String {
    let mut at = 0;
    while value >= 999.5 && at + 1 < units.len() {
        value /= step;
        at += 1;
    }
    let digits = match value {
        v if v >= 9.95 => 0,
        v if v.fract() == 0.0 && at == 0 => 0,
        _ => 1,
    };
    format!("{value:.digits$}{}", units[at])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_abbreviated() {
        assert_eq!(
            [0.0, 61.9, 11_045.0, 183_600.0].map(uptime),
            ["0s", "1m01s", "3h04m", "2d03h"]
        );
        assert_eq!([0, 900 << 10, 4_300_000].map(bytes), ["0K", "900K", "4.1M"]);
        assert_eq!(
            [3, 999, 1_234, 56_000_000].map(time),
            ["3us", "999us", "1.2ms", "56s"]
        );
        assert_eq!(
            [0.0, 0.5, 19.96, 1_500.0].map(rate),
            ["0", "0.5", "20", "1.5k"]
        );
        assert_eq!([0.0, 0.0123, 1.5].map(percent), ["0.0%", "1.2%", "150%"]);
    }

    #[test]
    fn control_characters_of_components_are_escaped() {
        assert_eq!(
            plain("\u{1b}[32m INFO\u{1b}[0m a\tb\r\u{7}c\u{1b}[2J"),
            " INFO a    bc"
        );
    }
}
