//! Lookup of type names.

use crate::ast::Scoped;
use crate::model::{ModuleId, Primitive, Reference, TypeId};
use crate::resolver::ModuleResolver;
use rc_diagnostics::Diagnostic;

/// The number of unknown names per session for which a similar name is looked for.
const MAX_SUGGESTIONS: usize = 100;

/// Types of C++, ROS and others, with those of IDSL.
const FOREIGN: [(&str, &str); 26] = [
    ("std::string", "string"),
    ("String", "string"),
    ("str", "string"),
    ("wstring", "string"),
    ("boolean", "bool"),
    ("char", "byte"),
    ("octet", "byte"),
    ("uchar", "byte"),
    ("int8_t", "int8"),
    ("int16_t", "int16"),
    ("int32_t", "int32"),
    ("int64_t", "int64"),
    ("uint8_t", "uint8"),
    ("uint16_t", "uint16"),
    ("uint32_t", "uint32"),
    ("uint64_t", "uint64"),
    ("uint", "uint32"),
    ("unsigned", "uint32"),
    ("size_t", "uint64"),
    ("std::size_t", "uint64"),
    ("i32", "int32"),
    ("u32", "uint32"),
    ("i64", "int64"),
    ("u64", "uint64"),
    ("f32", "float32"),
    ("f64", "float64"),
];

impl ModuleResolver<'_> {
    /// The type `name` of this module.
    pub(crate) fn own(&self, name: &str) -> Option<TypeId> {
        let module = self.library.module(self.module);
        module.types_by_name.get(name).copied()
    }

    /// Resolves a name. Reports an error, or a warning for an unscoped name of another module.
    pub(crate) fn named(&mut self, scoped: &Scoped) -> Option<TypeId> {
        let found = self.lookup(scoped)?;
        let module = self.library.ty(found).module;
        let references = &mut self.library.references;
        if let Some(name) = &scoped.module {
            references.push((name.span, Reference::Module(module)));
        }
        references.push((scoped.name.span, Reference::Type(found)));
        Some(found)
    }

    fn lookup(&mut self, scoped: &Scoped) -> Option<TypeId> {
        let library = &*self.library;
        let wanted = scoped.name.text.as_str();
        let own = |module: ModuleId| library.module(module).types_by_name.get(wanted).copied();
        // The fast path: most names are of this module.
        if scoped.module.is_none()
            && let Some(found) = self.own(wanted)
        {
            return Some(found);
        }
        let reachable = library.reachable(self.module);
        let modules: Vec<ModuleId> = match &scoped.module {
            Some(name) => reachable
                .iter()
                .copied()
                .filter(|m| library.module(*m).name.text == name.text)
                .collect(),
            None => Vec::new(),
        };
        if let Some(found) = modules.iter().find_map(|m| own(*m)) {
            return Some(found);
        }
        let written = scoped.text();
        let mut foreign = FOREIGN.iter().filter(|(foreign, _)| *foreign == written);
        let foreign = foreign.next().map(|(_, ours)| *ours);
        let elsewhere: Vec<TypeId> = reachable.iter().filter_map(|m| own(*m)).collect();
        let paths: Vec<String> = elsewhere
            .iter()
            .map(|t| format!("`{}`", library.type_path(*t)))
            .collect();
        let span = scoped.span();
        match (elsewhere.as_slice(), &scoped.module) {
            ([one], None) => {
                let message = format!("unscoped name `{wanted}` refers to {}", paths[0]);
                self.report(
                    Diagnostic::warning("unscoped-name", span, message)
                        .help(format!("write {}", paths[0]))
                        .fix(wanted, library.type_path(*one)),
                );
                return Some(*one);
            }
            (all, module) if all.is_empty() || module.is_some() && modules.is_empty() => {
                let diagnostic = match module {
                    _ if foreign.is_some() => {
                        let message = format!("unknown type `{written}`");
                        Diagnostic::error("unknown-type", span, message)
                            .did_you_mean(&written, foreign)
                    }
                    Some(module) if modules.is_empty() => {
                        let known = reachable.iter().map(|m| &library.module(*m).name);
                        let near = rc_diagnostics::nearest(
                            &module.text,
                            known.map(|name| name.text.as_str()),
                        );
                        let message = format!("module `{}` is not imported", module.text);
                        let diagnostic = Diagnostic::error("unknown-module", module.span, message);
                        match near {
                            Some(_) => diagnostic.did_you_mean(&module.text, near),
                            None if self.import_failed => {
                                diagnostic.help("fix the failed import of this file first")
                            }
                            None if !paths.is_empty() => {
                                diagnostic.help(format!("import its file, or write {}", paths[0]))
                            }
                            None => diagnostic.help("import the file that declares it"),
                        }
                    }
                    _ => {
                        let message = format!("unknown type `{written}`");
                        // A limit: comparing thousands of names with thousands takes minutes.
                        let near = if *self.suggestions < MAX_SUGGESTIONS {
                            *self.suggestions += 1;
                            let words = Primitive::idsl_words().map(|(word, _)| word);
                            let types = reachable.iter().flat_map(|m| &library.module(*m).types);
                            let types = types.map(|t| library.ty(*t).name.text.as_str());
                            // A word in the place of a type may be a misspelled pattern, too.
                            let others = ["string", "command", "query", "publish"];
                            rc_diagnostics::nearest(wanted, words.chain(others).chain(types))
                        } else {
                            None
                        };
                        let diagnostic = Diagnostic::error("unknown-type", span, message);
                        match near {
                            Some(_) => diagnostic.did_you_mean(wanted, near),
                            None => diagnostic.help("declare it, or import the file that does"),
                        }
                    }
                };
                self.report(diagnostic);
            }
            (_, None) => {
                let message = format!("ambiguous type `{wanted}`: found {}", paths.join(" and "));
                self.report(
                    Diagnostic::error("ambiguous-type", span, message)
                        .help(format!("write {}", paths[0])),
                );
            }
            (_, Some(module)) => {
                let message = format!(
                    "module `{}` has no type `{wanted}`; found {}",
                    module.text,
                    paths.join(" and ")
                );
                self.report(
                    Diagnostic::error("type-moved", span, message)
                        .help(format!("write {}", paths[0])),
                );
            }
        }
        None
    }
}
