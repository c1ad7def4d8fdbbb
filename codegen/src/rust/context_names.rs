//! Names of slots and robots, which are fields of the context.

use super::names;
use rc_diagnostics::{Diagnostic, Diagnostics};

/// Slots whose names become one name of Rust, or one that generated code uses itself.
pub(crate) fn check(component: &rc_cdsl::Component, found: &mut Diagnostics) {
    const OWN: [&str; 3] = ["core", "params", "deref"];
    let name = &component.name;
    if let Err(reason) = names::component(&name.text) {
        let message = format!("a component cannot be called `{}`: {reason}", name.text);
        found.push(Diagnostic::error("name-collision", name.span, message));
    }
    let mut seen: Vec<(&str, String)> = Vec::new();
    for slot in component.slots.iter().filter(|slot| !slot.of_world) {
        let field = names::snake(&slot.name);
        if let Some((other, _)) = seen.iter().find(|(_, other)| *other == field) {
            let message = format!(
                "slots `{other}` and `{}` are both `{field}` in Rust",
                slot.name
            );
            let interface = component.library.interface(slot.interface);
            let help = format!("name one of them: `{} as other`", interface.name.text);
            found.push(Diagnostic::error("name-collision", slot.span, message).help(help));
        } else if OWN.contains(&field.as_str())
            || (field == "time" && component.simulates_time)
            || (["tree", "viewer"].contains(&&*field) && component.viewer.is_some())
            || (component.state_machine.is_some()
                && ["machine", "state_machine"].contains(&&*field))
        {
            let message = format!(
                "a slot cannot be called `{}`: generated code uses the name itself",
                slot.name
            );
            found.push(
                Diagnostic::error("name-collision", slot.span, message).help("name it with `as`"),
            );
        }
        seen.push((&slot.name, field));
    }
    let mut handlers: Vec<(&str, String)> = Vec::new();
    for collect in &component.collects {
        let (name, method) = (&collect.name, names::method(&collect.name.text));
        if let Some((other, _)) = handlers.iter().find(|(_, other)| *other == method) {
            let message = format!(
                "collections `{other}` and `{}` are both `{method}` in Rust",
                name.text
            );
            let error = Diagnostic::error("name-collision", name.span, message);
            found.push(error.help("write another name after `as`"));
        }
        handlers.push((&name.text, method));
    }
    let robots = component.kinematics.iter().map(|(_, name)| (name, "robot"));
    // The worker of a world of any schema has its slots, but no replica in its context.
    let world = component
        .world
        .iter()
        .filter(|world| world.schema.is_some());
    let world = world.map(|world| (&world.name, "world"));
    for (robot, what) in robots.chain(world) {
        let field = names::snake(&robot.text);
        let is_own = OWN.contains(&field.as_str())
            || ["time", "tree", "viewer", "machine", "state_machine"].contains(&field.as_str());
        if is_own || seen.iter().any(|(_, other)| *other == field) {
            let message = format!(
                "a {what} cannot be called `{}`: the context has `{field}` already",
                robot.text
            );
            let error = Diagnostic::error("name-collision", robot.span, message);
            found.push(error.help("write another name after `as`"));
        }
        seen.push((&robot.text, field));
    }
}
