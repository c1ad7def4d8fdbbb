//! `--as`: values as those of a data prototype.

use super::output::{Failure, print_findings, print_note, system};
use clap::Args;
use rc_codegen::FileLoader;
use rc_command_line::files;
use rc_diagnostics::{Format, SourceMap};
use rc_record::meaning::Converter;
use std::path::PathBuf;

/// The prototype of which values are shown.
#[derive(Args, Clone)]
pub(super) struct ConversionOptions {
    /// Converts values into those of this data prototype, by the plan that `rcgen convert` prints.
    #[arg(long = "as", value_name = "PROTOTYPE", requires = "prototypes")]
    name: Option<String>,
    /// Converts values of this prototype only, where the files have several of one type.
    #[arg(long = "of", value_name = "PROTOTYPE", requires = "name")]
    of: Option<String>,
    /// Reads data prototypes from this file. May be given several times.
    #[arg(long, value_name = "FILE.dproto", requires = "name", add = files(&["dproto"]))]
    prototypes: Vec<PathBuf>,
}

impl ConversionOptions {
    /// The conversion of values, if a prototype is named. Errors of the files, and losses, are
    /// printed.
    pub(super) fn converter(&self) -> Result<Option<Converter>, Failure> {
        let Some(name) = &self.name else {
            return Ok(None);
        };
        let (mut sources, mut texts) = (SourceMap::new(), Vec::new());
        for file in &self.prototypes {
            let text = rc_files::read(file);
            let text = text.map_err(|e| system(&format!("{}: {e}", file.display())))?;
            texts.push(sources.add(file, text));
        }
        let loader = FileLoader::new(&[]);
        let (library, found) = rc_prototypes::load(&mut sources, &loader, &texts);
        if found.has_errors() {
            print_findings(&sources, &found, Format::Human);
            return Err(Failure(1, String::new()));
        }
        let converter = Converter::new(&library, name, self.of.as_deref());
        let converter = converter.map_err(|reason| Failure(1, reason))?;
        for loss in converter.losses() {
            print_note(&loss);
        }
        Ok(Some(converter))
    }
}
