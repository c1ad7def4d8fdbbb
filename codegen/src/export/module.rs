//! A module as a file of OMG IDL.

use super::idl::{Text, Writer};
use super::names::Names;
use super::rpc;
use super::scope::escaped;
use rc_idsl::Library;
use rc_idsl::model::ModuleId;
use std::collections::HashSet;

/// Writes a module as the text of a file.
pub(super) fn module(
    library: &Library,
    names: &Names,
    id: ModuleId,
    first_line: &str,
    includes: &[String],
) -> String {
    let module = library.module(id);
    let mut writer = Writer {
        library,
        names,
        text: Text::default(),
        scope: names.scopes[id.0].clone(),
    };
    let guard = format!("RCGEN_{}_IDL", module.name.text.to_uppercase());
    writer.text.line(first_line);
    writer.text.line(&format!("#ifndef {guard}"));
    writer.text.line(&format!("#define {guard}"));
    writer.text.line("");
    for include in includes {
        writer.text.line(&format!("#include \"{include}\""));
    }
    if !includes.is_empty() {
        writer.text.line("");
    }
    writer.text.doc(&module.doc);
    writer
        .text
        .open(&format!("module {}", escaped(&module.name.text)));
    for (at, one) in module.consts.iter().enumerate() {
        writer.constant(&names.consts[&(id, at)], one);
    }
    let mut done = HashSet::new();
    for ty in &module.types {
        writer.declare(*ty, id, &mut done);
    }
    for interface in &module.interfaces {
        rpc::interface(&mut writer, library.interface(*interface));
    }
    writer.text.close();
    writer.text.line("");
    writer.text.line("#endif");
    writer.text.out
}
