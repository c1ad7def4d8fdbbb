//! `rcgen venv`: the virtual environment of a component in Python.

use crate::command_line::Common;
use crate::reports::{Failure, load, print_line, report, tell};
use rc_codegen::cargo_workspace::Workspace;
use rc_codegen::installed;
use rc_codegen::python::environment::{self, Error};
use rc_diagnostics::SourceMap;
use rc_vocabulary::Language;
use std::path::Path;

pub(crate) fn make(
    file: &Path,
    common: &Common,
    python: Option<&Path>,
    dev: bool,
    wheel: Option<&Path>,
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
    let workspace = Workspace::of(project.code()).ok().flatten();
    let framework = workspace.and_then(|workspace| workspace.framework());
    let known = || installed::wheel(framework.as_deref());
    let wheel = wheel.map(Path::to_path_buf).or_else(known);
    if wheel.is_none() {
        let how = framework.map_or_else(String::new, |framework| {
            let folder = framework.display();
            format!("`cargo xtask dist --only wheel` in {folder} writes one, or ")
        });
        tell(format_args!(
            "note: there is no wheel of the framework, so editors and type checkers will not find `robocomp`; {how}--wheel names one"
        ));
    }
    let oldest = project.oldest_python();
    match environment::make(project.code(), oldest, python, dev, wheel.as_deref()) {
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
