//! Documentation of members and operations, with units and ranges, for every language.

use super::library::Operation;
use super::members::Member;

/// The documentation of a member with its unit and its range.
pub(crate) fn of_member(member: &Member) -> Vec<String> {
    let unit = member.unit.iter().map(|unit| format!("Unit: {unit}."));
    let range = member.range.iter().map(|range| format!("Range: {range}."));
    let facts: Vec<String> = unit.chain(range).collect();
    let mut doc = member.doc.clone();
    if !facts.is_empty() {
        if !doc.is_empty() {
            doc.push(String::new());
        }
        doc.push(facts.join(" "));
    }
    doc
}

/// The documentation of an operation with the units and ranges of its parameters, which the language
/// calls `parameter`.
pub(crate) fn of_operation(
    operation: &Operation,
    parameter: impl Fn(&str) -> String,
) -> Vec<String> {
    let mut doc = operation.doc.clone();
    let mut facts = Vec::new();
    for member in operation.inputs.iter().chain(&operation.outputs) {
        let unit = member.unit.iter().map(|unit| format!("in {unit}"));
        let about: Vec<String> = unit.chain(member.range.clone()).collect();
        if !about.is_empty() {
            let name = parameter(&member.name);
            facts.push(format!("- `{name}`: {}", about.join(", ")));
        }
    }
    if !facts.is_empty() && !doc.is_empty() {
        doc.push(String::new());
    }
    doc.extend(facts);
    doc
}
