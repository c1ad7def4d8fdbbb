//! `rcgen init` and `rcgen new`.

use crate::reports::{Failure, print_line};
use rc_codegen::files::Change;
use rc_codegen::{Files, workspace};
use std::path::Path;

pub(crate) fn init(dir: &Path, framework: &str) -> Result<(), Failure> {
    let framework = workspace::Framework::parse(framework).map_err(Failure::Usage)?;
    if dir.join("Cargo.toml").exists() {
        return Err(Failure::Usage(format!(
            "{} has a Cargo.toml already",
            dir.display()
        )));
    }
    let files = workspace::init(&framework).map_err(|e| Failure::System(e.to_string()))?;
    write_new(&files, dir)
}

pub(crate) fn new(name: &str) -> Result<(), Failure> {
    let files = workspace::new_component(name).map_err(Failure::Usage)?;
    if Path::new("components").join(name).exists() {
        return Err(Failure::Usage(format!("components/{name} exists already")));
    }
    write_new(&files, Path::new("."))
}

pub(crate) fn write_new(files: &Files, folder: &Path) -> Result<(), Failure> {
    let steps = files
        .write(folder)
        .map_err(|e| Failure::System(e.to_string()))?;
    for step in steps.iter().filter(|s| s.change == Change::Create) {
        print_line(format_args!("create {}", folder.join(&step.path).display()));
    }
    Ok(())
}
