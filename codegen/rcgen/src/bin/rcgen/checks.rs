//! `rcgen check`, `rcgen fmt` and `rcgen explain`.

use crate::command_line::Common;
use crate::reports::{Failure, print_line, report, unreadable};
use rc_codegen::FileLoader;
use rc_codegen::source_files;
use rc_diagnostics::{Diagnostics, Format, SourceMap};
use std::path::PathBuf;

pub(crate) fn check(files: &[PathBuf], robocomp: bool, common: &Common) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let mut found = Diagnostics::new();
    let loader = FileLoader::new(&common.include);
    let mut refused = None;
    let system = |e: std::io::Error| Failure::System(e.to_string());
    for file in rcgen::check::files(files, &mut sources, &mut found).map_err(system)? {
        let include = &common.include;
        let checked =
            rcgen::check::file(&file, robocomp, &mut sources, &loader, include, &mut found);
        if let Err(error) = checked {
            unreadable(&file, &error, &mut sources, &mut found, &mut refused);
        }
    }
    let reported = report(&sources, &found, common.format);
    refused.map_or(reported, |why| Err(Failure::System(why)))
}

pub(crate) fn fmt(paths: &[PathBuf], check: bool, format: Format) -> Result<(), Failure> {
    let system = |e: std::io::Error| Failure::System(e.to_string());
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
