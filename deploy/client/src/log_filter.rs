//! Which lines of a log are shown: by text, time and level.

use rc_management::event::parse_time;
use std::str::FromStr;
use std::time::SystemTime;

/// The level of a message, the least important first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Each step, for developers.
    Trace,
    /// Details for developers.
    Debug,
    /// Normal operation, and lines that the component prints.
    Info,
    /// Something does not work as it should.
    Warn,
    /// Something does not work.
    Error,
}

impl Level {
    /// All levels with their words.
    pub const WORDS: [(&str, Self); 5] = [
        ("error", Self::Error),
        ("warn", Self::Warn),
        ("info", Self::Info),
        ("debug", Self::Debug),
        ("trace", Self::Trace),
    ];
}

impl FromStr for Level {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut all = Self::WORDS.into_iter();
        let found = all.find(|(word, _)| word.eq_ignore_ascii_case(text));
        found
            .map(|(_, level)| level)
            .ok_or_else(|| "the levels are error, warn, info, debug and trace".to_owned())
    }
}

/// Which lines are shown. The default shows all lines.
#[derive(Clone, Debug, Default)]
pub struct LogFilter {
    /// A line has one of these texts; all lines if there is no text. A text without capital letters
    /// matches capital letters, too.
    pub texts: Vec<String>,
    /// A message is not older.
    pub since: Option<SystemTime>,
    /// A message has this level or a more important one.
    pub level: Option<Level>,
}

impl LogFilter {
    /// Whether all lines are shown.
    pub fn is_open(&self) -> bool {
        self.texts.is_empty() && self.since.is_none() && self.level.is_none()
    }
}

/// Decides about the lines of one log, in their order.
#[derive(Debug)]
pub(crate) struct LineFilter<'f> {
    filter: &'f LogFilter,
    /// The time and level of the message that the present line belongs to.
    time: Option<SystemTime>,
    level: Level,
}

impl<'f> LineFilter<'f> {
    pub(crate) fn new(filter: &'f LogFilter) -> Self {
        Self {
            filter,
            time: None,
            level: Level::Info,
        }
    }

    pub(crate) fn is_open(&self) -> bool {
        self.filter.is_open()
    }

    /// Whether this line is shown. A line without a time and a level belongs to the message before
    /// it.
    pub(crate) fn shows(&mut self, line: &str) -> bool {
        if let Some((time, level)) = head(line) {
            (self.time, self.level) = (Some(time), level);
        } else if let Some(level) = level_of_printed(line) {
            self.level = level;
        }
        let LogFilter {
            texts,
            since,
            level,
        } = self.filter;
        level.is_none_or(|least| self.level >= least)
            && since.is_none_or(|since| self.time.is_some_and(|time| time >= since))
            && (texts.is_empty() || texts.iter().any(|text| has(line, text)))
    }
}

/// Whether the line has the text, as [`LogFilter::texts`] says.
fn has(line: &str, text: &str) -> bool {
    if text.chars().any(char::is_uppercase) {
        line.contains(text)
    } else {
        line.to_lowercase().contains(text)
    }
}

/// The time and the level at the beginning of a message: `2026-01-31T12:00:00.123456Z  WARN text`.
fn head(line: &str) -> Option<(SystemTime, Level)> {
    let (time, rest) = line.split_once(' ')?;
    let time = parse_time(time)?;
    let level = rest.trim_start().split(' ').next()?;
    Some((time, level.parse().ok()?))
}

/// The level of what Rust, Python and the runtime print when a component fails, or warn of.
fn level_of_printed(line: &str) -> Option<Level> {
    let is_panic = line.starts_with("thread '") && line.contains(" panicked at ");
    if is_panic || line.starts_with("Traceback (most recent call last)") {
        return Some(Level::Error);
    }
    let of_process = |(name, rest): (&str, &str)| {
        let is_name = !name.is_empty() && !name.contains(' ');
        let level = rest.split(':').next()?;
        match level {
            "error" if is_name => Some(Level::Error),
            "warning" if is_name => Some(Level::Warn),
            _ => None,
        }
    };
    line.split_once(": ").and_then(of_process)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: [&str; 9] = [
        "loads the firmware",
        "2026-01-31T12:00:00.000001Z  INFO starts",
        "2026-01-31T12:00:01.000000Z  WARN motor 3 is hot: 81 °C",
        "  of at most 80 °C",
        "2026-01-31T12:00:02.000000Z DEBUG Motor 3: torque 4",
        "thread 'main' panicked at src/worker.rs:12:9:",
        "no map",
        "2026-01-31T12:00:03.000000Z  INFO ends",
        "avoider: error: the component panicked",
    ];

    /// The numbers of the lines that this filter shows.
    fn shown(filter: &LogFilter) -> Vec<usize> {
        let mut lines = LineFilter::new(filter);
        (0..LOG.len()).filter(|at| lines.shows(LOG[*at])).collect()
    }

    #[test]
    fn a_line_without_a_level_belongs_to_its_message_and_a_panic_is_an_error() {
        let at_least = |level: Level| {
            shown(&LogFilter {
                level: Some(level),
                ..LogFilter::default()
            })
        };
        assert_eq!(at_least(Level::Error), [5, 6, 8]);
        assert_eq!(at_least(Level::Warn), [2, 3, 5, 6, 8]);
        assert_eq!(at_least(Level::Info), [0, 1, 2, 3, 5, 6, 7, 8]);
        assert_eq!(at_least(Level::Trace).len(), LOG.len());
    }

    #[test]
    fn time_and_text_and_level_hold_together() {
        let since = parse_time("2026-01-31T12:00:02Z");
        let text = |text: &str| vec![text.to_owned()];
        let mut filter = LogFilter {
            since,
            ..LogFilter::default()
        };
        assert_eq!(shown(&filter), [4, 5, 6, 7, 8]);
        filter.texts = text("motor");
        assert_eq!(shown(&filter), [4]);
        filter.since = None;
        assert_eq!(shown(&filter), [2, 4]);
        filter.texts = text("Motor");
        assert_eq!(shown(&filter), [4]);
        filter.level = Some(Level::Info);
        assert_eq!(shown(&filter), [0; 0]);
        assert!(LogFilter::default().is_open() && !filter.is_open());
    }
}
