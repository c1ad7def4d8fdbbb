//! The targets of rules: slots of a component, and their operations.

use rc_diagnostics::nearest;

/// Help for a rule whose target `name` is neither one of `slots` nor `SLOT/operation` of one of
/// them: the nearest name, else `allowed`. `None` if the target exists.
pub(crate) fn unknown_target_help(
    name: &str,
    slots: &[(&str, Vec<&str>)],
    allowed: &str,
) -> Option<String> {
    let operations = slots
        .iter()
        .flat_map(|(slot, operations)| operations.iter().map(move |o| format!("{slot}/{o}")));
    let own = slots.iter().map(|(slot, _)| (*slot).to_owned());
    let names: Vec<String> = own.chain(operations).collect();
    if names.iter().any(|known| known == name) {
        return None;
    }
    let near = nearest(name, names.iter().map(String::as_str));
    Some(near.map_or(allowed.to_owned(), |near| format!("did you mean `{near}`?")))
}
