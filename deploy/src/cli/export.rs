//! `rcdeploy export`.

use super::arguments::Input;
use super::description::load;
use super::output::{Failure, print_line, print_note, system};
use rc_codegen::files::Change;
use rc_deploy_export::{Engine, Export};
use std::collections::BTreeSet;
use std::path::Path;

pub(super) fn export(
    input: &Input,
    engine: Engine,
    out: &Path,
    image: Option<&str>,
    dry_run: bool,
) -> Result<u8, Failure> {
    let network = load(input, rc_diagnostics::Format::Human, |network, found| {
        network.programs.check_locations(input.profile, found);
    })?;
    let plan = network.plan(input.profile)?;
    let user = (
        rustix::process::getuid().as_raw(),
        rustix::process::getgid().as_raw(),
    );
    let export = rc_deploy_export::export(&network, &plan, engine, image, user)
        .map_err(|e| Failure(1, e))?;
    for note in &export.notes {
        print_note(note);
    }
    let programs: BTreeSet<&Path> = plan.components.iter().map(|c| &*c.executable).collect();
    for program in programs.into_iter().filter(|program| !program.exists()) {
        print_note(&format_args!("{} is not built yet", program.display()));
    }
    write(&export, out, rc_deploy_export::FIRST_WORDS, dry_run)?;
    Ok(0)
}

/// Writes the files of an export, or lists them. Returns whether one of them is new. A file that
/// does not begin with `first_words` is never overwritten.
pub(super) fn write(
    export: &Export,
    out: &Path,
    first_words: &str,
    dry_run: bool,
) -> Result<bool, Failure> {
    let steps = export.files.plan(out).map_err(|e| system(&e))?;
    let foreign = rc_codegen::export::first_foreign_file(&steps, out, first_words);
    if let Some(foreign) = foreign.map_err(|e| system(&e))? {
        return Err(Failure(
            2,
            format!(
                "{} is there, and was not written by this command; name another folder, or move it away",
                foreign.display()
            ),
        ));
    }
    if !dry_run {
        export.files.write(out).map_err(|e| system(&e))?;
        for left in export.left(out).map_err(|e| system(&e))? {
            print_note(&format_args!(
                "{} is of an earlier export; remove it",
                left.display()
            ));
        }
    }
    for step in steps.iter().filter(|step| step.change != Change::Keep) {
        let path = out.join(&step.path);
        print_line(format_args!("{} {}", step.change.word(), path.display()));
    }
    Ok(steps.iter().any(|step| step.change == Change::Create))
}
