//! The names of declarations in OMG IDL, and the notation of types.

use super::rpc_names;
use super::scope::{Scope, escaped};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::Library;
use rc_idsl::model::{Enumerator, Module, ModuleId, Type, TypeDeclKind, TypeId};
use rc_syntax::Name;
use std::collections::HashMap;

/// The names of all declarations in all modules, not yet escaped.
pub(super) struct Names {
    pub(super) types: HashMap<TypeId, String>,
    /// The structs of the entries of dictionaries.
    pub(super) entries: HashMap<TypeId, String>,
    pub(super) enumerators: HashMap<TypeId, Vec<String>>,
    pub(super) consts: HashMap<(ModuleId, usize), String>,
    /// The scope of each module, for names that are added later.
    pub(super) scopes: Vec<Scope>,
}

impl Names {
    pub(super) fn new(library: &Library, found: &mut Diagnostics) -> Self {
        let mut names = Self {
            types: HashMap::new(),
            entries: HashMap::new(),
            enumerators: HashMap::new(),
            consts: HashMap::new(),
            scopes: Vec::new(),
        };
        for (at, module) in library.modules.iter().enumerate() {
            let scope = names.in_module(library, ModuleId(at), module, found);
            names.scopes.push(scope);
        }
        names
    }

    fn in_module(
        &mut self,
        library: &Library,
        id: ModuleId,
        module: &Module,
        found: &mut Diagnostics,
    ) -> Scope {
        let mut scope = Scope::module(&module.name.text);
        for ty in &module.types {
            let name = scope.unique_name(&library.ty(*ty).name.text);
            self.types.insert(*ty, name);
        }
        for (at, one) in module.consts.iter().enumerate() {
            let name = scope.unique_name(&one.name.text);
            self.consts.insert((id, at), name);
        }
        // Other programs rely on these names, so they cannot be changed.
        let mut unwritable = Vec::new();
        let mut fixed = |name: String, at: &Name| {
            if !scope.claim(&name) {
                let message = format!(
                    "the name `{name}` of `{}` in OMG IDL is already in use",
                    at.text
                );
                let help = "rename one of the declarations: OMG IDL ignores case";
                found.push(Diagnostic::error("export-name", at.span, message).help(help));
            }
        };
        for ty in &module.types {
            let decl = library.ty(*ty);
            if matches!(decl.kind, TypeDeclKind::Exception(_)) {
                fixed(rpc_names::exception_hash(&self.types[ty]), &decl.name);
            }
        }
        for interface in &module.interfaces {
            let interface = library.interface(*interface);
            if interface.name.text.starts_with('_') {
                unwritable.push(&interface.name);
                continue;
            }
            rpc_names::names(interface)
                .into_iter()
                .for_each(|(name, at)| fixed(name, at));
        }
        for name in unwritable {
            let message = format!(
                "`{}` is not valid in OMG IDL: it begins with `_`",
                name.text
            );
            found.push(Diagnostic::error("export-name", name.span, message));
        }
        rpc_names::exceptions_collide(library, module, found);
        for ty in &module.types {
            let own = &self.types[ty];
            if matches!(
                library.ty(*ty).kind,
                TypeDeclKind::Alias(Type::Dictionary { .. })
            ) {
                self.entries
                    .insert(*ty, scope.unique_name(&format!("{own}_Entry")));
            }
        }
        self.enumerators(library, module, &mut scope);
        scope
    }

    /// Names the enumerators, which are in the scope of the module in OMG IDL. If one of them is
    /// already in use, all enumerators of the enum get its name as a prefix.
    fn enumerators(&mut self, library: &Library, module: &Module, scope: &mut Scope) {
        let enums = module
            .types
            .iter()
            .filter_map(|ty| match &library.ty(*ty).kind {
                TypeDeclKind::Enum(values) => Some((*ty, values)),
                TypeDeclKind::Struct(_) | TypeDeclKind::Exception(_) | TypeDeclKind::Alias(_) => {
                    None
                }
            });
        let enums: Vec<(TypeId, &Vec<Enumerator>)> = enums.collect();
        let (mut once, mut repeated) = (Scope::default(), Scope::default());
        for value in enums.iter().flat_map(|(_, values)| *values) {
            if scope.contains(&value.name.text) || !once.claim(&value.name.text) {
                repeated.claim(&value.name.text);
            }
        }
        for (ty, values) in enums {
            let long = values.iter().any(|v| repeated.contains(&v.name.text));
            let own = &self.types[&ty];
            let prefix = if long {
                format!("{own}_")
            } else {
                String::new()
            };
            let names = values
                .iter()
                .map(|v| scope.unique_name(&format!("{prefix}{}", v.name.text)));
            self.enumerators.insert(ty, names.collect());
        }
    }

    /// The absolute path `::Module::Name`, which inner scopes cannot hide.
    pub(super) fn path(&self, library: &Library, id: TypeId) -> String {
        let module = &library.module(library.ty(id).module).name.text;
        format!("::{}::{}", escaped(module), escaped(&self.types[&id]))
    }

    /// The notation of a type, and the array sizes after the name of its member.
    pub(super) fn ty(&self, library: &Library, ty: &Type) -> (String, String) {
        match ty {
            Type::Primitive(primitive) => (primitive.idl().to_owned(), String::new()),
            Type::Text { bound: None } => ("string".to_owned(), String::new()),
            Type::Text { bound: Some(bound) } => (format!("string<{bound}>"), String::new()),
            Type::Sequence { element, bound } => {
                let element = self.ty(library, element).0;
                (sequence(&element, *bound), String::new())
            }
            Type::Array {
                element,
                length: size,
            } => {
                let (element, inner) = self.ty(library, element);
                (element, format!("[{size}]{inner}"))
            }
            // Only an alias can be a dictionary. It has a struct for its entries.
            Type::Dictionary { value, .. } => self.ty(library, value),
            Type::Named(id) => (self.path(library, *id), String::new()),
        }
    }
}

/// A sequence, without `<:` and `>>`, which are single tokens for a preprocessor.
pub(super) fn sequence(element: &str, bound: Option<u32>) -> String {
    let space = if element.starts_with(':') { " " } else { "" };
    match bound {
        Some(bound) => format!("sequence<{space}{element}, {bound}>"),
        None if element.ends_with('>') => format!("sequence<{space}{element} >"),
        None => format!("sequence<{space}{element}>"),
    }
}
