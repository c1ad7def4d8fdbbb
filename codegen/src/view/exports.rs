//! Which names the generated crate exports more than once: such a thing is written with its whole path in the
//! user's file, where everything else is imported by its bare name.

use super::operation_names::{answer_name, error_name};
use crate::names;
use rc_cdsl::Component;
use rc_cdsl::model::Role;
use rc_idsl::Library;
use rc_idsl::model::TypeId;
use std::collections::BTreeSet;

/// What `lib.rs` exports by name, whatever the component is.
const OWN: [&str; 9] = [
    "CallError",
    "Context",
    "Embedded",
    "InPlace",
    "Params",
    "SendError",
    "State",
    "Worker",
    "WorkerError",
];

/// The trait of a slot.
pub(super) fn trait_name(slot: &str) -> String {
    let name = names::ty(slot);
    if OWN.contains(&name.as_str()) {
        name + "_"
    } else {
        name
    }
}

pub(super) struct Exports {
    krate: String,
    repeated: BTreeSet<String>,
}

impl Exports {
    pub(super) fn of(component: &Component) -> Self {
        let library = &component.library;
        let mut names: Vec<String> = OWN.map(str::to_owned).to_vec();
        names.extend(library.types.iter().map(|t| names::ty(&t.name.text)));
        let in_place = super::in_place::needed(component);
        names.extend(
            in_place
                .iter()
                .map(|id| super::in_place::name(library, *id)),
        );
        let consts = library.modules.iter().flat_map(|m| &m.consts);
        names.extend(consts.map(|c| names::shout(&c.name.text)));
        let mut interfaces: Vec<_> = component.slots.iter().map(|s| s.interface).collect();
        interfaces.sort();
        interfaces.dedup();
        for interface in interfaces.into_iter().map(|id| library.interface(id)) {
            let base = names::camel(&interface.name.text);
            names.extend(["Client", "Publisher"].map(|end| format!("{base}{end}")));
            for operation in &interface.operations {
                names.extend([error_name(operation), answer_name(operation)]);
            }
        }
        let receiving = [Role::Implements, Role::SubscribesTo];
        let slots = component.slots.iter();
        let slots = slots.filter(|s| receiving.contains(&s.role));
        names.extend(slots.map(|s| trait_name(&s.name)));
        names.sort();
        let repeated = names.windows(2).filter(|pair| pair[0] == pair[1]);
        Self {
            krate: format!("{}_generated", names::package(&component.name.text)),
            repeated: repeated.map(|pair| pair[0].clone()).collect(),
        }
    }

    /// Whether a name is exported more than once.
    pub(super) fn repeats(&self) -> bool {
        !self.repeated.is_empty()
    }

    /// Whether the user's file may import this name.
    pub(super) fn is_unique(&self, name: &str) -> bool {
        !self.repeated.contains(name)
    }

    /// A type as the user's file writes it.
    pub(super) fn ty(&self, library: &Library, id: TypeId) -> String {
        let decl = library.ty(id);
        let module = format!("types::{}", super::type_module(library, decl.module));
        self.named(&module, &names::ty(&decl.name.text))
    }

    /// The structure of a type in place as the user's file writes it.
    pub(super) fn in_place(&self, library: &Library, id: TypeId) -> String {
        let module = super::type_module(library, library.ty(id).module);
        self.named(
            &format!("types::{module}"),
            &super::in_place::name(library, id),
        )
    }

    /// The error or the answer of an operation as the user's file writes it; `module` is its interface's.
    pub(super) fn of_interface(&self, module: &str, name: &str) -> String {
        self.named(&format!("interfaces::{module}"), name)
    }

    fn named(&self, module: &str, name: &str) -> String {
        if self.is_unique(name) {
            name.to_owned()
        } else {
            format!("{}::{module}::{name}", self.krate)
        }
    }
}
