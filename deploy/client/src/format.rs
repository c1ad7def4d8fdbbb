//! The two forms of output.

/// The form of output of a command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// Lines for people: what components print on standard output, all else on standard error.
    #[default]
    Human,
    /// One JSON object a line on standard output, lines of components too (code `log`).
    Json,
}
