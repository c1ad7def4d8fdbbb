//! Names in OMG IDL.

use std::collections::HashSet;

/// The keywords of OMG IDL 4.2. They are not case-sensitive.
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

/// The annotations that the export uses. If a declaration has the name of an annotation, ignoring
/// case, Cyclone's compiler does not find the annotation.
const ANNOTATIONS: [&str; 7] = ["default", "final", "max", "min", "range", "unit", "value"];

/// Whether `name` is the name of an annotation.
pub(super) fn is_annotation(name: &str) -> bool {
    ANNOTATIONS.contains(&name.to_ascii_lowercase().as_str())
}

/// Escapes keywords with a leading `_`, which is not part of the name.
pub(super) fn escaped(name: &str) -> String {
    let low = name.to_ascii_lowercase();
    if KEYWORDS.contains(&low.as_str()) {
        format!("_{name}")
    } else {
        name.to_owned()
    }
}

/// The names of one scope. Case is ignored.
#[derive(Clone, Debug, Default)]
pub(super) struct Scope(HashSet<String>);

impl Scope {
    /// A scope with a name, which no declaration in it may have.
    pub(super) fn new(name: &str) -> Self {
        let mut scope = Self::default();
        scope.claim(name);
        scope
    }

    /// The scope of a module, which reserves the names of annotations.
    pub(super) fn module(name: &str) -> Self {
        let mut scope = Self::new(name);
        for annotation in ANNOTATIONS {
            scope.claim(annotation);
        }
        scope
    }

    /// Adds a name. Returns whether it was unused.
    pub(super) fn claim(&mut self, name: &str) -> bool {
        self.0.insert(name.to_ascii_lowercase())
    }

    /// Whether the name is used.
    pub(super) fn contains(&self, name: &str) -> bool {
        self.0.contains(&name.to_ascii_lowercase())
    }

    /// Adds an unused name: `name`, with `_` appended until it is unused. Prepends `x` to a leading
    /// `_`, which compilers would read as an escape.
    pub(super) fn unique_name(&mut self, name: &str) -> String {
        let first = if name.starts_with('_') { "x" } else { "" };
        let mut name = format!("{first}{name}");
        while !self.claim(&name) {
            name.push('_');
        }
        name
    }
}
