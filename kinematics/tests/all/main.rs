//! Tests of solvers.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

mod arms;
mod cells;
mod choices;
mod closed;
mod cpp;
mod ctypes;
mod cycles;
mod driven;
mod findings;
mod frames;
mod hinges;
mod ilk;
mod interpreted;
mod inverse;
mod printed;
mod sets;
mod single;
mod straight;
mod trees;

use rc_diagnostics::{Format, SourceMap, render};
use rc_kinematics::Cell;
use rc_syntax::MemoryLoader;

/// An arm with a joint of each kind, a joint that follows, and masses.
const ARM: &str = include_str!("../../examples/arm.urdf");

/// Loads a text beside the arm. Returns what it is and its findings.
fn load(text: &str) -> (Option<Cell>, String) {
    load_with(text, ARM)
}

/// Loads a text beside this robot.
fn load_with(text: &str, robot: &str) -> (Option<Cell>, String) {
    load_beside(text, &[("arm.urdf", robot)])
}

/// Loads a text beside these robots.
fn load_beside(text: &str, robots: &[(&str, &str)]) -> (Option<Cell>, String) {
    let mut sources = SourceMap::new();
    let source = sources.add("cell.kdsl", text);
    let loader = MemoryLoader::new(robots.iter().copied());
    let (cell, found) = rc_kinematics::load(&mut sources, &loader, source);
    (cell, render(&sources, &found, Format::Short))
}
