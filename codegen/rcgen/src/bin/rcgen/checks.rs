//! `rcgen check`, `rcgen fmt` and `rcgen explain`.

use crate::command_line::Common;
use crate::generation::manifest;
use crate::reports::{Failure, print_line, report, system, tell, unreadable};
use rc_codegen::{FileLoader, Project, copied, source_files};
use rc_diagnostics::foreign::clean_lines;
use rc_diagnostics::{Diagnostics, Format, SourceMap};
use rcgen::check::Model;
use rcgen::fix::{Change, FixSelection};
use std::io;
use std::path::PathBuf;

/// How often files are checked again. A fix may make a text readable that has further ones.
const ROUNDS: usize = 20;

pub(crate) fn check(
    files: &[PathBuf],
    robocomp: bool,
    fix: Option<FixSelection>,
    common: &Common,
) -> Result<(), Failure> {
    let mut rounds = 0;
    loop {
        let mut sources = SourceMap::new();
        let mut found = Diagnostics::new();
        let (mut refused, copies) = look(files, robocomp, common, &mut sources, &mut found)?;
        if let Some(which) = fix.filter(|_| rounds < ROUNDS) {
            rounds += 1;
            let (changes, errors) = rcgen::fix::files(&sources, &found, which);
            for change in &changes {
                print_line(format_args!("{}", line(change)));
            }
            for (file, error) in &errors {
                unreadable(file, error, &mut sources, &mut found, &mut refused);
            }
            if !changes.is_empty() && errors.is_empty() {
                continue;
            }
        }
        if rounds == ROUNDS {
            tell(format_args!(
                "`rcgen fix` stopped after {ROUNDS} rounds of fixes"
            ));
        }
        let reported = report(&sources, &found, common.format);
        if common.format == Format::Human {
            offer(&sources, &found, fix);
        }
        let copies = copies.map_err(manifest);
        return match refused {
            Some(why) => Err(Failure::System(why)),
            None => copies.and(reported),
        };
    }
}

/// Checks all files once. Returns the errors of the system, and whether the manifests could be
/// read.
fn look(
    files: &[PathBuf],
    robocomp: bool,
    common: &Common,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> Result<(Option<String>, io::Result<()>), Failure> {
    let loader = FileLoader::new(&common.include);
    let (mut components, mut refused) = (Vec::new(), None);
    for file in rcgen::check::files(files, sources, found).map_err(system)? {
        let include = &common.include;
        match rcgen::check::file(&file, robocomp, sources, &loader, include, found) {
            Ok(Some(Model::Component(project))) => components.push(project),
            Ok(_) => {}
            Err(error) => unreadable(&file, &error, sources, found, &mut refused),
        }
    }
    let components: Vec<&Project> = components.iter().map(Box::as_ref).collect();
    let copies = copied::check(&components, found);
    Ok((refused, copies))
}

/// A change, for people.
fn line(change: &Change) -> String {
    let shown = |text: &str| clean_lines(text, 80);
    let Change {
        file, line, column, ..
    } = change;
    let place = format!("fix {}:{line}:{column}:", shown(&file.to_string_lossy()));
    // Foreign spaces all look alike.
    let old = match change.old.chars().next() {
        Some(c) if c.is_whitespace() => format!("U+{:04X}", u32::from(c)),
        _ => shown(&change.old),
    };
    // An addition has ends of lines around it; a space replaces a foreign one.
    let new = match old.as_str() {
        "" => shown(change.new.trim()),
        _ => shown(&change.new),
    };
    if old.is_empty() {
        format!("{place} add `{new}`")
    } else {
        format!("{place} `{old}` becomes `{new}`")
    }
}

/// Says how many of the findings `rcgen fix` fixes.
fn offer(sources: &SourceMap, found: &Diagnostics, which: Option<FixSelection>) {
    let (certain, likely) = rcgen::fix::count(sources, found);
    if certain > 0 && which.is_none() {
        tell(format_args!("`rcgen fix` fixes {certain} of these"));
    }
    if likely > 0 && which != Some(FixSelection::Likely) {
        let all = if which.is_none() {
            certain + likely
        } else {
            likely
        };
        tell(format_args!("`rcgen fix --likely` fixes {all} of these"));
    }
}

pub(crate) fn fmt(paths: &[PathBuf], check: bool, format: Format) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let mut found = Diagnostics::new();
    let mut refused = None;
    let mut differs = false;
    let files = source_files::files(paths, &rcgen::format::is_formatted).map_err(system)?;
    if files.is_empty() {
        return Err(Failure::Usage("there is nothing to format".to_owned()));
    }
    for file in files {
        match rcgen::format::file(&file, check, &mut sources, &mut found) {
            Ok(false) => {}
            Ok(true) => {
                differs = true;
                let word = if check { "not formatted:" } else { "format" };
                print_line(format_args!("{word} {}", file.display()));
            }
            Err(error) => unreadable(&file, &error, &mut sources, &mut found, &mut refused),
        }
    }
    let reported = report(&sources, &found, format);
    match refused {
        Some(why) => Err(Failure::System(why)),
        None if check && differs => Err(Failure::Input),
        None => reported,
    }
}

pub(crate) fn explain(code: Option<&str>) -> Result<(), Failure> {
    let pages = rcgen::explain::pages();
    let Some(code) = code else {
        pages
            .iter()
            .for_each(|page| print_line(format_args!("{}", page.code)));
        return Ok(());
    };
    if let Some(page) = pages.iter().find(|page| page.code == code) {
        print_line(format_args!("{}\n\n{}", page.code, page.text));
        return Ok(());
    }
    let near = rc_diagnostics::nearest(code, pages.iter().map(|page| page.code));
    let hint = near.map_or("`rcgen explain` lists all codes".to_owned(), |near| {
        format!("did you mean `{near}`?")
    });
    Err(Failure::Usage(format!("there is no code `{code}`; {hint}")))
}
