//! The parts of a recording that a reader has to leave out.

use super::files::MOST_MISSING;
use std::fmt;

/// Why less was read than was recorded.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// The number of damaged chunks and records that were skipped.
    pub damaged: u64,
    /// The number of messages whose channel was in one of these.
    pub without_channel: u64,
    /// The first damage.
    pub damage: Option<String>,
    /// The numbers of parts of a long recording that are not next to the others, the first ones.
    pub missing: Vec<u32>,
    /// Why a file ends before its end, if one does: it was cut, or is damaged from there on.
    pub cut: Option<String>,
}

impl Faults {
    /// Whether everything was read.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        if let Some(damage) = &self.damage {
            let what = if self.damaged == 1 {
                "1 damaged chunk or record was"
            } else {
                &format!("{} damaged chunks and records were", self.damaged)
            };
            parts.push(format!("{what} skipped ({damage})"));
        }
        if self.without_channel > 0 {
            parts.push(format!("{} messages have no channel", self.without_channel));
        }
        if !self.missing.is_empty() {
            let named = self.missing.iter().take(MOST_MISSING);
            let numbers = named.map(u32::to_string).collect::<Vec<_>>().join(", ");
            parts.push(match self.missing.len() {
                1 => format!("part {numbers} of it is missing"),
                2..=MOST_MISSING => format!("parts {numbers} of it are missing"),
                _ => format!("parts {numbers} and more of it are missing"),
            });
        }
        let cut = self.cut.as_ref();
        parts.extend(cut.map(|reason| format!("it ends before its end ({reason})")));
        f.write_str(&parts.join("; "))
    }
}
