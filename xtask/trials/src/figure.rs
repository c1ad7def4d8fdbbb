//! Goals and their measurements, as rows of Markdown.

use std::time::Duration;

/// The limit for a first build, which is not measured: one with optimisation takes more than a quarter of an hour on
/// two processors that others use, too.
pub(crate) const BUILD: Duration = Duration::from_hours(1);

/// A goal and its measurement: one row of a table.
pub(crate) struct Figure {
    pub(crate) what: &'static str,
    /// Empty if there is none. Then the figure is neither met nor missed.
    pub(crate) goal: &'static str,
    pub(crate) measured: String,
    pub(crate) met: bool,
}

/// Prints figures. Returns whether all goals are met.
pub(crate) fn table(figures: impl IntoIterator<Item = Figure>) -> bool {
    println!("| | goal | measured | |\n|---|---|---|---|");
    let mut met = true;
    for figure in figures {
        let Figure {
            what,
            goal,
            measured,
            met: good,
        } = figure;
        if goal.is_empty() {
            println!("| {what} | none | {measured} | |");
            continue;
        }
        println!("| {what} | {goal} | {measured} | {} |", mark(good));
        met &= good;
    }
    met
}

pub(crate) fn mark(met: bool) -> &'static str {
    if met { "met" } else { "**missed**" }
}
