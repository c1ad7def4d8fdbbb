//! Interfaces in the languages of others, so that programs without this project can talk to components.

mod idl;
mod module;
mod names;
mod ros2;
mod rpc;
mod rpc_names;
mod scope;
pub(crate) mod uses;

pub(crate) use idl::plain;
pub use ros2::ros2;

use crate::files::{Change, Owner, Step};
use crate::{Files, load};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap, Span};
use rc_idsl::model::{Module, ModuleId};
use rc_idsl::{Library, Session};
use rc_syntax::Loader;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

/// What an exported file begins with, behind the mark of a comment: what begins otherwise is not overwritten.
pub const HEADER: &str = "Exported by rcgen";

/// The envelope of calls, which every interface with calls includes.
const RPC: &str = include_str!("export/dds_rpc.idl");
const RPC_FILE: &str = "dds_rpc.idl";

/// Reads `file` with all that it imports; one that is only a name is also looked for where imports are. An error is a
/// file that the system does not give.
pub fn load(
    file: &Path,
    sources: &mut SourceMap,
    loader: &dyn Loader,
) -> io::Result<(Library, Diagnostics)> {
    let (path, text) = match load::read(file) {
        Ok(text) => (load::normal(file), text),
        Err(error) => {
            let missing = error.kind() == io::ErrorKind::NotFound;
            let name = file.to_str().filter(|name| missing && !name.contains('/'));
            let found = name.and_then(|name| loader.find(Path::new(""), name, "idsl").ok());
            let found = found.ok_or(error)?;
            (found.path, found.text)
        }
    };
    let source = sources.add(&path, text);
    let mut session = Session::new(sources, loader);
    session.load_source(source, path, Span::new(source, 0, 0));
    Ok((session.library, session.found))
}

/// Every module of `library` as a file of OMG IDL 4.2: the types that travel over DDS, as XCDR1 of FINAL types. The
/// files are called like those of the modules.
pub fn dds(library: &Library, sources: &SourceMap) -> (Files, Diagnostics) {
    let mut found = Diagnostics::new();
    check_module_names(library, &mut found);
    let names = names::Names::new(library, &mut found);
    let mut files = Files::default();
    let mut taken = HashMap::new();
    for (at, module) in library.modules.iter().enumerate() {
        let id = ModuleId(at);
        let file = idl_file_name(module, sources);
        // Folders that make no difference between `a.idl` and `A.idl` are many.
        let first = taken.insert(file.to_lowercase(), module);
        if first.is_some() || file.eq_ignore_ascii_case(RPC_FILE) {
            let message = format!("two modules would both be exported to `{file}`");
            let mut diagnostic = Diagnostic::error("export-name", module.name.span, message)
                .help("rename the .idsl file: the exported one is called like it");
            if let Some(first) = first {
                diagnostic = diagnostic.label(first.name.span, "the other one");
            }
            found.push(diagnostic);
        }
        let mut includes: Vec<String> = module
            .imports
            .iter()
            .map(|import| idl_file_name(library.module(*import), sources))
            .collect();
        let calls = module
            .interfaces
            .iter()
            .any(|i| uses::has_calls(library.interface(*i)));
        if calls {
            includes.insert(0, RPC_FILE.to_owned());
            let text = format!("// {HEADER}; rewritten at every export.\n{RPC}");
            files.add(RPC_FILE, Owner::Exported, text);
        }
        let source = sources.path(module.source).file_name().unwrap_or_default();
        let first_line = format!(
            "// {HEADER} from {}; rewritten at every export.",
            source.to_string_lossy()
        );
        let text = module::module(library, &names, id, &first_line, &includes);
        files.add(file, Owner::Exported, text);
    }
    (files, found)
}

/// The first file that an export into `folder` would overwrite although no export has written it: it does not begin with
/// `first_words`, whatever marks the comment.
pub fn first_foreign_file(
    steps: &[Step],
    folder: &Path,
    first_words: &str,
) -> io::Result<Option<PathBuf>> {
    for step in steps.iter().filter(|s| s.change == Change::Update) {
        let path = folder.join(&step.path);
        let text = std::fs::read(&path)?;
        if !without_comment_mark(&text).starts_with(without_comment_mark(first_words.as_bytes())) {
            return Ok(Some(path));
        }
    }
    Ok(None)
}

/// A text without what its first line begins with to be a comment.
fn without_comment_mark(text: &[u8]) -> &[u8] {
    let mark = text.iter().take_while(|byte| b"#/<!- ".contains(byte));
    &text[mark.count()..]
}

fn idl_file_name(module: &Module, sources: &SourceMap) -> String {
    let stem = sources.path(module.source).file_stem().unwrap_or_default();
    format!("{}.idl", stem.to_string_lossy())
}

/// IDL makes no difference between names that differ only in case; `dds` is there already.
fn check_module_names(library: &Library, found: &mut Diagnostics) {
    let mut seen: HashMap<String, &Module> = HashMap::new();
    for module in &library.modules {
        let name = &module.name;
        let low = name.text.to_lowercase();
        if low == "dds" {
            let message = format!("the module `{}` is one of DDS's own in IDL", name.text);
            found.push(Diagnostic::error("export-name", name.span, message));
        } else if low.starts_with('_') {
            let message = format!("`{}` is no name in IDL: it begins with `_`", name.text);
            found.push(Diagnostic::error("export-name", name.span, message));
        } else if scope::is_annotation(&name.text) {
            let message = format!("the module `{}` hides an annotation of IDL", name.text);
            found.push(Diagnostic::error("export-name", name.span, message));
        } else if let Some(first) = seen.insert(low, module) {
            let message = format!(
                "modules `{}` and `{}` differ only in case, which is one name in IDL",
                first.name.text, name.text
            );
            found.push(
                Diagnostic::error("export-name", name.span, message)
                    .label(first.name.span, "the other one"),
            );
        }
    }
}
