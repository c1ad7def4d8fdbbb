//! The slots that know where frames are: `convert { frames SLOT; }`.

use super::{Connection, Connector};
use crate::endpoint::Endpoint;
use rc_cdsl::Component;
use rc_cdsl::model::{Role, Slot};
use rc_conversion::{QUERY, TF, TRANSFORMS, TREE};
use rc_diagnostics::Diagnostic;
use rc_idsl::canonical::operation_hash;
use rc_syntax::Name;

/// The remedy for a connection that would ask the tree of the component itself.
const OWN_TREE: &str = "a connection does not ask the tree that the component itself holds: let it require `RcInnerModel::InnerModel`, and bind this slot to a component that serves the tree, such as `inner_model`";

/// Why a slot does not know where frames are, and what to do.
type TreeProblem = (String, &'static str);

impl Connector<'_> {
    /// Refuses names that are not connected slots for the tree of frames.
    pub(super) fn check_trees(&mut self) {
        for (connection, names) in std::mem::take(&mut self.trees) {
            let is_one = names.len() == 1;
            for name in names {
                self.check_tree(connection, &name, is_one);
            }
        }
    }

    /// Checks one slot. `is_one`: the only one of its connection.
    fn check_tree(&mut self, connection: Connection, name: &Name, is_one: bool) {
        let Connection { consumer, provider } = connection;
        let Some(component) = self.components[consumer.instance] else {
            return;
        };
        let mut slots = component.slots.iter();
        let Some(at) = slots.position(|slot| slot.name == name.text) else {
            let known = component.slots.iter().map(|slot| slot.name.as_str());
            let path = &self.instance(consumer).path;
            let message = format!("`{path}` has no slot `{}`", name.text);
            let error = Diagnostic::error("unknown-slot", name.span, message)
                .label(component.name.span, "its component");
            let is_near = rc_diagnostics::nearest(&name.text, known.clone()).is_some();
            // `ctx.tree` of the worker is not a slot.
            let error = match component.viewer.filter(|_| !is_near) {
                Some(_) => error.help(OWN_TREE),
                None => error.suggest(&name.text, known),
            };
            self.report(consumer, Some(provider), error);
            return;
        };
        let tree = Endpoint {
            instance: consumer.instance,
            slot: at,
        };
        let slot = &component.slots[at];
        if let Err((reason, help)) = self.check_tree_slot(tree, (component, slot), is_one) {
            let error = Diagnostic::error("wrong-frames", name.span, reason);
            let error = error.label(slot.span, "declared here").help(help);
            self.report(consumer, Some(provider), error);
        }
    }

    fn check_tree_slot(
        &self,
        tree: Endpoint,
        (component, slot): (&Component, &Slot),
        is_one: bool,
    ) -> Result<(), TreeProblem> {
        let name = self.name(tree);
        let interface = self.interface(tree);
        let mut world = component.world.iter();
        if slot.of_world && world.any(|world| world.name.text == slot.name) {
            return if is_one {
                Ok(())
            } else {
                Err((
                    format!("`{name}` is one of several slots"),
                    "a world knows all its frames: name it alone",
                ))
            };
        }
        let (asked, import) = match (slot.role, interface.as_str()) {
            (Role::Requires, TREE) if !slot.is_array => {
                (QUERY, "import the framework's `InnerModel.idsl`")
            }
            (Role::SubscribesTo, TF) if !slot.is_array => {
                (TRANSFORMS, "import the framework's `TransformPub.idsl`")
            }
            _ => {
                return Err((
                    format!("`{name}` does not know where frames are"),
                    "name the component's world, or a slot that requires `RcInnerModel::InnerModel` or subscribes to `Transforms::TransformPub`, and is not an array",
                ));
            }
        };
        if slot.role == Role::Requires && !is_one {
            return Err((
                format!("`{name}` is one of several slots"),
                "name one slot for a tree, or several ones that subscribe to `Transforms::TransformPub`",
            ));
        }
        let library = &component.library;
        let mut operations = library.interface(slot.interface).operations.iter();
        let is_known = operations.any(|own| {
            let hash = || operation_hash(library, slot.interface, own);
            own.name.text == asked.0 && hash() == asked.1
        });
        if !is_known {
            return Err((
                format!("`{name}` has no `{}` as this framework knows it", asked.0),
                import,
            ));
        }
        let is_connected = self.connections.iter().any(|made| made.consumer == tree)
            || self.externals.contains_key(&tree);
        if !is_connected {
            return Err((
                format!("`{name}` is not connected, so nothing knows where frames are"),
                "bind it to a component that serves the tree, such as `inner_model`, or that publishes transforms",
            ));
        }
        Ok(())
    }
}
