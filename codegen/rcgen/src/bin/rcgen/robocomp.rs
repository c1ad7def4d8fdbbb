//! `rcgen import robocomp`.

use crate::checks;
use crate::command_line::Common;
use crate::reports::{Failure, print, print_line, system};
use rc_codegen::files::Owner;
use rcgen::robocomp::Import;
use std::path::Path;

/// Where the list is that the command prints, unless an earlier one is there.
const REPORT: &str = "IMPORT.md";

/// Writes the components and networks of a folder of RoboComp, and lists what stays to be done. A
/// file that exists stays as it is.
pub(crate) fn import(folder: &Path, out: &Path, common: &Common) -> Result<(), Failure> {
    let mut import = Import::of(folder).map_err(system)?;
    if import.is_empty() {
        let message = format!(
            "{}: no file of RoboComp is there; expected .cdsl files, files of rcmanager, or sub.toml",
            folder.display()
        );
        return Err(Failure::Usage(message));
    }
    let report = import.report();
    import.files.add(REPORT, Owner::Specific, report.clone());
    let mut common = Common {
        include: common.include.clone(),
        format: common.format,
    };
    common.include.push(out.join("interfaces"));
    let mut descriptions = Vec::new();
    for step in import.files.write(out).map_err(system)? {
        let path = out.join(&step.path);
        print_line(format_args!("{} {}", step.change.word(), path.display()));
        if path.extension().is_some_and(|ending| ending == "cdsl") {
            descriptions.push(path);
        }
    }
    print(&format!("\n{report}"));
    checks::check(&descriptions, false, None, &common)
}
