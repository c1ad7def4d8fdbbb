//! The page about all parameters, in Markdown.

use rc_configuration::model::{Kind, Parameter, Parameters, Rule, Value};
use serde::Serialize;

/// The page.
#[derive(Debug, Serialize)]
pub struct Page {
    /// A section for `[parameters]` and for every group and list, in the order of the text.
    pub sections: Vec<Section>,
}

/// The parameters of one table.
#[derive(Debug, Serialize)]
pub struct Section {
    /// The head of the table in a configuration.
    pub heading: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// What kind of table it is; empty where there is nothing to say.
    pub about: String,
    /// A row for each value.
    pub rows: Vec<Row>,
    /// What must hold between the values.
    pub rules: Vec<String>,
}

/// One value. Texts are as a cell of a table needs them.
#[derive(Debug, Serialize)]
pub struct Row {
    /// Its name.
    pub name: String,
    /// Its type, with the length of an array.
    pub ty: String,
    /// Its range or choices.
    pub allowed: String,
    /// Its unit.
    pub unit: String,
    /// Its default, or that it must be set.
    pub default: String,
    /// When a change takes effect.
    pub change: String,
    /// What it means.
    pub doc: String,
}

pub(super) fn of(parameters: &Parameters) -> Page {
    let mut sections = Vec::new();
    let top = Section {
        heading: code("[parameters]"),
        doc: parameters.doc.clone(),
        about: String::new(),
        rows: Vec::new(),
        rules: Vec::new(),
    };
    let rules = &parameters.rules;
    add(
        top,
        &parameters.parameters,
        rules,
        &mut Vec::new(),
        &mut sections,
    );
    Page { sections }
}

/// The section of a table, then those of the tables in it.
fn add<'a>(
    mut section: Section,
    parameters: &'a [Parameter],
    rules: &[Rule],
    scope: &mut Vec<&'a str>,
    out: &mut Vec<Section>,
) {
    section.rows = parameters.iter().filter_map(row).collect();
    let own = rules.iter().filter(|rule| rule.scope == *scope);
    section.rules = own
        .map(|rule| format!("{}: {}", code(&rule.text), line(&rule.message)))
        .collect();
    out.push(section);
    for parameter in parameters {
        scope.push(&parameter.name);
        let path = format!("parameters.{}", scope.join("."));
        let section = |heading: String, about: String| Section {
            heading: code(&heading),
            doc: parameter.doc.clone(),
            about,
            rows: Vec::new(),
            rules: Vec::new(),
        };
        match &parameter.kind {
            Kind::Scalar { .. } => {}
            Kind::Group(members) => {
                let section = section(format!("[{path}]"), String::new());
                add(section, members, rules, scope, out);
            }
            Kind::List { length, parameters } => {
                let about = format!(
                    "A list, {}; each has a head of its own.",
                    length.described()
                );
                let section = section(format!("[[{path}]]"), about);
                add(section, parameters, rules, scope, out);
            }
        }
        scope.pop();
    }
}

fn row(parameter: &Parameter) -> Option<Row> {
    let Kind::Scalar { ty, array } = &parameter.kind else {
        return None;
    };
    let ty = match array {
        None => ty.word().to_owned(),
        Some(length) => format!("array of {}, {}", ty.word(), length.described()),
    };
    let range = parameter.range.as_ref();
    let allowed = if parameter.choices.is_empty() {
        range.map_or(String::new(), |range| cell(&range.described()))
    } else {
        list(&parameter.choices)
    };
    let default = match &parameter.default {
        None => "must be set".to_owned(),
        Some(_) if parameter.secret => "not shown".to_owned(),
        Some(default) => cell(&code(&default.to_toml())),
    };
    let secret = if parameter.secret { "; secret" } else { "" };
    Some(Row {
        name: code(&parameter.name),
        ty,
        allowed,
        unit: cell(parameter.unit.as_deref().unwrap_or_default()),
        default,
        change: parameter
            .change()
            .unwrap_or("fixed at the start")
            .to_owned()
            + secret,
        doc: cell(&parameter.doc.join(" ")),
    })
}

fn list(values: &[Value]) -> String {
    let values: Vec<String> = values.iter().map(|v| cell(&code(&v.to_toml()))).collect();
    values.join(", ")
}

/// Text that is shown as it is, whatever ticks are in it.
fn code(text: &str) -> String {
    let text = line(text);
    if text.contains('`') {
        format!("`` {text} ``")
    } else {
        format!("`{text}`")
    }
}

/// On one line.
fn line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

/// As a cell of a table, in code, too.
fn cell(text: &str) -> String {
    line(text).replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_ends_neither_its_row_nor_its_code() {
        assert_eq!(cell(&code("a|b")), "`a\\|b`");
        assert_eq!(code("tick ` tick"), "`` tick ` tick ``");
        assert_eq!(cell("two\nlines"), "two lines");
    }
}
