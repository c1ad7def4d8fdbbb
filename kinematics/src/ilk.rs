//! ILK, the imperative models of solvers by M. Frigerio (github.com/mfrigerio17/ilk-generator): tables of Lua that list
//! compositions of poses and columns of Jacobians. Values of constant poses are in a file beside them.
//!
//! The pose `a__b` is where the frame `a` is in `b`. Velocities and spatial accelerations are those of the frame, along its own
//! axes. Angular parts come before linear ones.

mod layout;
mod lua;
mod motion;
mod operations;
mod print;
mod read;

pub use print::{Unprintable, print};
pub(crate) use read::load;

use rc_diagnostics::{Diagnostics, SourceId, SourceMap};

/// The operations, with their meanings.
pub const OPERATIONS: [(&str, &str); 8] = [
    ("pose-compose", "The pose `arg1` in the base of `arg2`."),
    ("joint-vel-twist", "The velocity `arg` that a joint gives."),
    (
        "vel-compose",
        "The sum of the velocities `arg1` and `arg2`, for the frame at `pose`.",
    ),
    (
        "joint-vel",
        "The velocity `arg` that a joint gives, in older models.",
    ),
    (
        "joint-acc-twist",
        "The acceleration `arg` that a joint gives.",
    ),
    (
        "acc-compose",
        "The acceleration `arg1` on top of `arg2`, whose frame is at `ctransform`, of a frame with `velocity`.",
    ),
    (
        "geom-jacobian",
        "A Jacobian with `columns`, of the frame at `pose`.",
    ),
    (
        "GJac-col",
        "The column `col` of a Jacobian, for a joint at `joint_pose`.",
    ),
];

/// The laid out text of a model.
///
/// # Errors
/// The text is not a table of Lua.
pub fn format(sources: &SourceMap, source: SourceId) -> Result<String, Diagnostics> {
    let text = sources.text(source);
    match lua::table(text, source) {
        (Some(_), found) if !found.has_errors() => {
            Ok(rc_syntax::with_ends_of(text, layout::layout(text)))
        }
        (_, found) => Err(found),
    }
}
