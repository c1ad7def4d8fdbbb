//! `rcgen venv`: the virtual environment of a component in Python.

use crate::command_line::Common;
use crate::reports::{Failure, load, print_line, report, tell};
use rc_codegen::python::environment::{self, Error};
use rc_diagnostics::SourceMap;
use rc_vocabulary::Language;
use std::path::Path;

pub(crate) fn make(
    file: &Path,
    common: &Common,
    python: Option<&Path>,
    dev: bool,
) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let (project, found) = load(file, common, &mut sources)?;
    report(&sources, &found, common.format)?;
    if project.language() != Some(Language::Python) {
        tell(format_args!(
            "rcgen: error: {} is not in Python; cargo has its dependencies",
            file.display()
        ));
        return Err(Failure::Input);
    }
    match environment::make(project.code(), project.oldest_python(), python, dev) {
        Ok(place) => {
            print_line(format_args!("{} is ready", place.display()));
            Ok(())
        }
        Err(Error::Input(message)) => {
            tell(format_args!("rcgen: error: {message}"));
            Err(Failure::Input)
        }
        Err(Error::System(message)) => Err(Failure::System(message)),
    }
}
