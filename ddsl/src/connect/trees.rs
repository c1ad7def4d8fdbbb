//! The slots that know where frames are: `convert { frames SLOT; }`.

use super::{Connection, Connector};
use crate::endpoint::Endpoint;
use rc_cdsl::model::Role;
use rc_conversion::{QUERY, TREE};
use rc_diagnostics::Diagnostic;
use rc_idsl::canonical::operation_hash;

impl Connector<'_> {
    /// Refuses names that are no connected slots for the tree of frames.
    pub(super) fn check_trees(&mut self) {
        for (connection, name) in std::mem::take(&mut self.trees) {
            let Connection { consumer, provider } = connection;
            let Some(component) = self.components[consumer.instance] else {
                continue;
            };
            let mut slots = component.slots.iter();
            let Some(at) = slots.position(|slot| slot.name == name.text) else {
                let known = component.slots.iter().map(|slot| slot.name.as_str());
                let path = &self.instance(consumer).path;
                let message = format!("`{path}` has no slot `{}`", name.text);
                let error = Diagnostic::error("unknown-slot", name.span, message)
                    .label(component.name.span, "its component")
                    .suggest(&name.text, known);
                self.report(consumer, Some(provider), error);
                continue;
            };
            let tree = Endpoint {
                instance: consumer.instance,
                slot: at,
            };
            let slot = &component.slots[at];
            let library = &component.library;
            let mut operations = library.interface(slot.interface).operations.iter();
            let is_known = operations.any(|own| {
                let hash = || operation_hash(library, slot.interface, own);
                own.name.text == QUERY.0 && hash() == QUERY.1
            });
            let is_connected = self.connections.iter().any(|made| made.consumer == tree)
                || self.externals.contains_key(&tree);
            let (reason, help) =
                if slot.role != Role::Requires || self.interface(tree) != TREE || slot.is_array {
                    (
                        format!("`{}` does not know where frames are", self.name(tree)),
                        "name a slot that requires `RcInnerModel::InnerModel`, and is no array",
                    )
                } else if !is_known {
                    (
                        format!(
                            "`{}` has no `{}` as this framework asks it",
                            self.name(tree),
                            QUERY.0
                        ),
                        "import the framework's `InnerModel.idsl`",
                    )
                } else if !is_connected {
                    (
                        format!(
                            "`{}` is not connected, so nothing knows where frames are",
                            self.name(tree)
                        ),
                        "bind it to a component that serves the tree, such as `inner_model`",
                    )
                } else {
                    continue;
                };
            let error = Diagnostic::error("wrong-frames", name.span, reason);
            let error = error.label(slot.span, "declared here").help(help);
            self.report(consumer, Some(provider), error);
        }
    }
}
