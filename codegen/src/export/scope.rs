//! Names as IDL has them.

use std::collections::HashSet;

/// The words of OMG IDL 4.2, in whatever case they are written.
const KEYWORDS: [&str; 83] = [
    "abstract",
    "any",
    "alias",
    "attribute",
    "bitfield",
    "bitmask",
    "bitset",
    "boolean",
    "case",
    "char",
    "component",
    "connector",
    "const",
    "consumes",
    "context",
    "custom",
    "default",
    "double",
    "emits",
    "enum",
    "eventtype",
    "exception",
    "factory",
    "false",
    "finder",
    "fixed",
    "float",
    "getraises",
    "home",
    "import",
    "in",
    "inout",
    "int16",
    "int32",
    "int64",
    "int8",
    "interface",
    "local",
    "long",
    "manages",
    "map",
    "mirrorport",
    "module",
    "multiple",
    "native",
    "object",
    "octet",
    "oneway",
    "out",
    "port",
    "porttype",
    "primarykey",
    "private",
    "provides",
    "public",
    "publishes",
    "raises",
    "readonly",
    "sequence",
    "setraises",
    "short",
    "string",
    "struct",
    "supports",
    "switch",
    "true",
    "truncatable",
    "typedef",
    "typeid",
    "typename",
    "typeprefix",
    "uint16",
    "uint32",
    "uint64",
    "uint8",
    "union",
    "unsigned",
    "uses",
    "valuebase",
    "valuetype",
    "void",
    "wchar",
    "wstring",
];

/// The annotations that are written. Where something has the name of one, in whatever case, Cyclone's compiler does not
/// find the annotation.
const ANNOTATIONS: [&str; 7] = ["default", "final", "max", "min", "range", "unit", "value"];

/// Whether `name` is that of an annotation.
pub(super) fn is_annotation(name: &str) -> bool {
    ANNOTATIONS.contains(&name.to_ascii_lowercase().as_str())
}

/// `name` as it is written: a `_` before it takes the meaning from a word, and belongs to no name.
pub(super) fn escaped(name: &str) -> String {
    let low = name.to_ascii_lowercase();
    if KEYWORDS.contains(&low.as_str()) {
        format!("_{name}")
    } else {
        name.to_owned()
    }
}

/// The names of one scope. Those that differ only in case are one.
#[derive(Clone, Debug, Default)]
pub(super) struct Scope(HashSet<String>);

impl Scope {
    /// A scope that has a name itself, which nothing in it may have.
    pub(super) fn new(name: &str) -> Self {
        let mut scope = Self::default();
        scope.claim(name);
        scope
    }

    /// The scope of a module, in which annotations are found.
    pub(super) fn module(name: &str) -> Self {
        let mut scope = Self::new(name);
        for annotation in ANNOTATIONS {
            scope.claim(annotation);
        }
        scope
    }

    /// Takes a name, if nobody has it.
    pub(super) fn claim(&mut self, name: &str) -> bool {
        self.0.insert(name.to_ascii_lowercase())
    }

    /// Whether somebody has this name.
    pub(super) fn contains(&self, name: &str) -> bool {
        self.0.contains(&name.to_ascii_lowercase())
    }

    /// Takes this name, or the next one with a `_` more at its end. No name begins with a `_`: compilers read it as one
    /// before a word.
    pub(super) fn unique_name(&mut self, name: &str) -> String {
        let first = if name.starts_with('_') { "x" } else { "" };
        let mut name = format!("{first}{name}");
        while !self.claim(&name) {
            name.push('_');
        }
        name
    }
}
