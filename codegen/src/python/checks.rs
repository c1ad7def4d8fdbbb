//! Names of a component that become one name of Python, and what components in Python do not have.

use super::{handlers, names};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_vocabulary::Role;
use std::collections::BTreeSet;

/// Reports names that become one name of Python, or one that generated code uses itself.
pub(crate) fn check(component: &rc_cdsl::Component, found: &mut Diagnostics) {
    let name = &component.name;
    if let Err(reason) = names::component(&name.text) {
        let message = format!(
            "a component in Python cannot be called `{}`: {reason}",
            name.text
        );
        found.push(Diagnostic::error("name-collision", name.span, message));
    }
    for slot in component.slots.iter().filter(|slot| slot.asynchronous) {
        let message = format!(
            "a component in Python cannot start queries of `{}`: it waits for each reply",
            slot.name
        );
        let error = Diagnostic::error("not-in-python", slot.span, message);
        found.push(error.help("remove `asynchronous true`, or write the component in Rust"));
    }
    let mut seen: Vec<(&str, String)> = Vec::new();
    let mut handlers: BTreeSet<String> = super::HOOKS.iter().map(|h| (*h).to_owned()).collect();
    for slot in &component.slots {
        let field = names::snake(&slot.name);
        let interface = component.library.interface(slot.interface);
        if let Some((other, _)) = seen.iter().find(|(_, other)| *other == field) {
            let message = format!(
                "slots `{other}` and `{}` are both `{field}` in Python",
                slot.name
            );
            let help = format!("name one of them: `{} as other`", interface.name.text);
            found.push(Diagnostic::error("name-collision", slot.span, message).help(help));
        } else if names::is_of_context(&field) {
            let message = format!(
                "a slot cannot be called `{}`: generated code uses the name itself",
                slot.name
            );
            found.push(
                Diagnostic::error("name-collision", slot.span, message).help("name it with `as`"),
            );
        }
        if matches!(slot.role, Role::Implements | Role::SubscribesTo) {
            for operation in &interface.operations {
                let handler = handlers::name(&slot.name, &operation.name.text);
                if !handlers.insert(handler.clone()) {
                    let message =
                        format!("two functions of the worker would be called `{handler}`");
                    found.push(
                        Diagnostic::error("name-collision", slot.span, message)
                            .help("name the slot with `as`"),
                    );
                }
            }
        }
        seen.push((&slot.name, field));
    }
    for collect in &component.collects {
        let handler = handlers::collection(&collect.name.text);
        if !handlers.insert(handler.clone()) {
            let message = format!("two functions of the worker would be called `{handler}`");
            let error = Diagnostic::error("name-collision", collect.name.span, message);
            found.push(error.help("give the collection another name"));
        }
    }
    if let Some(world) = &component.world
        && world.schema.is_none()
    {
        let message = "a component in Python has a world of one schema";
        let error = Diagnostic::error("not-in-python", world.span, message);
        found.push(
            error.help("name a schema: `world \"FILE.gdsl\" as g`, or write the component in Rust"),
        );
    } else if let Some(world) = &component.world {
        let field = names::snake(&world.name.text);
        if names::is_of_context(&field) {
            let message = format!(
                "a world cannot be called `{}`: the context has `{field}` already",
                world.name.text
            );
            let error = Diagnostic::error("name-collision", world.name.span, message);
            found.push(error.help("write another name after `as`"));
        }
    }
    for (_, robot) in &component.kinematics {
        let field = names::snake(&robot.text);
        if names::is_of_context(&field) || seen.iter().any(|(_, other)| *other == field) {
            let message = format!(
                "a robot cannot be called `{}`: the context has `{field}` already",
                robot.text
            );
            let error = Diagnostic::error("name-collision", robot.span, message);
            found.push(error.help("write another name after `as`"));
        }
        seen.push((&robot.text, field));
    }
}
