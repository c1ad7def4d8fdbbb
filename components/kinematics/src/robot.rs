//! Reads the robot of the component.

use rc_diagnostics::{Format, SourceMap, render};
use rc_kinematics::Cell;
use rc_robot::Grounding;
use rc_syntax::Beside;
use std::path::Path;

/// Reads a URDF, or a `.kdsl` with its robots.
///
/// # Errors
/// The findings, or why the file is not readable, as text.
pub(crate) fn read(path: &Path) -> Result<Cell, String> {
    let mut sources = SourceMap::new();
    let source = if path.extension().is_some_and(|ending| ending == "kdsl") {
        let text = rc_files::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
        sources.add(path, text)
    } else {
        let name = path.file_name().and_then(|name| name.to_str());
        let name = name.ok_or_else(|| format!("{} is not a file", path.display()))?;
        let text = format!("import \"{name}\";\nKinematics robot\n{{\n}};\n");
        sources.add(
            path.with_file_name("(the robot of the component).kdsl"),
            text,
        )
    };
    let (cell, found) = rc_kinematics::load(&mut sources, &Beside(rc_files::read), source);
    let text = render(&sources, &found, Format::Short);
    match cell {
        Some(cell) if cell.choices.grounding != Grounding::default() => Err(format!(
            "{}: the interface `Kinematics` has metres and the axes of ROS: remove `lengths` and `frames`",
            path.display()
        )),
        Some(cell) if !found.has_errors() => Ok(cell),
        _ => Err(text),
    }
}
