//! Exports interfaces to OMG IDL and to packages of ROS 2, for programs of other frameworks.

mod component;
mod idl;
pub(crate) mod literal;
mod module;
mod names;
mod ros2;
mod rpc;
mod rpc_names;
mod scope;
pub(crate) mod uses;

pub use component::component;
pub use ros2::ros2;

use crate::files::{Change, Owner, Step};
use crate::{Files, paths};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap};
use rc_idsl::model::{Module, ModuleId};
use rc_idsl::{Library, Session};
use rc_syntax::Loader;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

/// The beginning of the first comment of an exported file. An export overwrites no other files.
pub const HEADER: &str = "Exported by rcgen";

/// The message types of calls, which every interface with calls includes.
const RPC: &str = include_str!("export/dds_rpc.idl");
const RPC_FILE: &str = "dds_rpc.idl";

/// Loads `file` with its imports. A name without folder is also searched like an import.
///
/// # Errors
/// The system cannot read the file.
pub fn load(
    file: &Path,
    sources: &mut SourceMap,
    loader: &dyn Loader,
) -> io::Result<(Library, Diagnostics)> {
    let (path, text) = match rc_files::read(file) {
        Ok(text) => (paths::normal(file), text),
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
    session.load_source(source, &path);
    Ok((session.library, session.found))
}

/// Exports each module to a file of OMG IDL 4.2 with the same name: the types of DDS topics and
/// calls, as final types with XCDR1 encoding.
pub fn dds(library: &Library, sources: &SourceMap) -> (Files, Diagnostics) {
    let mut found = Diagnostics::new();
    check_module_names(library, &mut found);
    let names = names::Names::new(library, &mut found);
    let mut files = Files::default();
    let mut taken = HashMap::new();
    for (at, module) in library.modules.iter().enumerate() {
        let id = ModuleId(at);
        let file = idl_file_name(module, sources);
        // Many file systems do not distinguish `a.idl` and `A.idl`.
        let first = taken.insert(file.to_lowercase(), module);
        if first.is_some() || file.eq_ignore_ascii_case(RPC_FILE) {
            let message = format!("two modules would be exported to the same file `{file}`");
            let mut diagnostic = Diagnostic::error("export-name", module.name.span, message)
                .help("rename the .idsl file: the exported file has the same name");
            if let Some(first) = first {
                diagnostic = diagnostic.label(first.name.span, "other module");
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

/// The first file in `folder` that an export would overwrite although no export wrote it: its first
/// comment does not begin with `first_words`.
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

/// A text without the comment mark at its start.
fn without_comment_mark(text: &[u8]) -> &[u8] {
    let mark = text.iter().take_while(|byte| b"#/<!- ".contains(byte));
    &text[mark.count()..]
}

fn idl_file_name(module: &Module, sources: &SourceMap) -> String {
    let stem = sources.path(module.source).file_stem().unwrap_or_default();
    format!("{}.idl", stem.to_string_lossy())
}

/// Reports names of modules that are not valid or become equal in OMG IDL, which ignores case.
fn check_module_names(library: &Library, found: &mut Diagnostics) {
    let mut seen: HashMap<String, &Module> = HashMap::new();
    for module in &library.modules {
        let name = &module.name;
        let low = name.text.to_lowercase();
        if low == "dds" {
            let message = format!("the name of module `{}` is reserved in OMG IDL", name.text);
            found.push(Diagnostic::error("export-name", name.span, message));
        } else if low.starts_with('_') {
            let message = format!(
                "`{}` is not valid in OMG IDL: it begins with `_`",
                name.text
            );
            found.push(Diagnostic::error("export-name", name.span, message));
        } else if scope::is_annotation(&name.text) {
            let message = format!("module `{}` would hide an annotation of OMG IDL", name.text);
            found.push(Diagnostic::error("export-name", name.span, message));
        } else if let Some(first) = seen.insert(low, module) {
            let message = format!(
                "modules `{}` and `{}` differ only in case, which OMG IDL ignores",
                first.name.text, name.text
            );
            found.push(
                Diagnostic::error("export-name", name.span, message)
                    .label(first.name.span, "other module"),
            );
        }
    }
}
