//! The two forms of output.

/// The form of output of a command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// Text for people: log lines on standard output, everything else on standard error.
    #[default]
    Human,
    /// One JSON object a line on standard output, including log lines (code `log`).
    Json,
}
