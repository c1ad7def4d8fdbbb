//! `rcgen config --update`.

use crate::command_line::Common;
use crate::reports::{Failure, print_line, report, tell, unreadable};
use rc_codegen::{FileLoader, configuration};
use rc_diagnostics::{Diagnostics, SourceMap};
use std::path::Path;

pub(crate) fn update(
    file: &Path,
    common: &Common,
    dry_run: bool,
    check: bool,
) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let (mut found, mut refused) = (Diagnostics::new(), None);
    let loader = FileLoader::new(&common.include);
    let updated = match configuration::update(file, &mut sources, &loader, &mut found) {
        Ok(updated) => updated,
        Err(error) => {
            unreadable(file, &error, &mut sources, &mut found, &mut refused);
            None
        }
    };
    if let Some(why) = refused {
        return Err(Failure::System(why));
    }
    report(&sources, &found, common.format)?;
    let Some(updated) = updated else {
        return Err(Failure::Input);
    };
    let path = updated.path.display();
    for change in &updated.update.changes {
        print_line(format_args!("{path}: {change}"));
    }
    if check && updated.differs() {
        tell(format_args!(
            "{path} is not up to date: rcgen config --update {path}"
        ));
        return Err(Failure::Input);
    }
    if !dry_run && !check {
        updated
            .write()
            .map_err(|e| Failure::System(format!("{path}: {e}")))?;
        let changes = updated.update.changes.iter();
        let gone = changes
            .filter(|change| matches!(change.kind, rc_configuration::ChangeKind::Removed(_)));
        match gone.count() {
            0 => {}
            1 => tell(format_args!("{path}: 1 value has become a comment")),
            gone => tell(format_args!("{path}: {gone} values have become comments")),
        }
    }
    if updated
        .update
        .changes
        .iter()
        .any(rc_configuration::Change::needs_decision)
    {
        tell(format_args!(
            "{path}: the remaining errors are left to you; correct them, then: rcgen config --update {path}"
        ));
        return Err(Failure::Input);
    }
    Ok(())
}
