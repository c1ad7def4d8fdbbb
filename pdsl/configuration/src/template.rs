//! The initial configuration file of a component. It then belongs to the user.

use crate::model::{Kind, Parameter, Parameters};
use rc_vocabulary::duration;
use std::fmt::Write;
use std::time::Duration;

/// The text of `etc/config.toml`: each parameter with its documentation, its limits and its
/// default. A parameter without a default becomes a comment that requests a value. `period` is
/// the period in the `.cdsl`.
pub fn template(component_name: &str, period: Duration, parameters: Option<&Parameters>) -> String {
    let period = format!("period = \"{}\"", duration::text_of(period));
    let mut out = format!(
        "#:schema ../generated/config.schema.json\n\
         # The configuration of {component_name}. It was written once and is yours to change.\n\
         \n\
         # [component]\n\
         # {period:<20}  # how often it computes\n\
         # log = \"info\"          # error, warn, info, debug or trace\n"
    );
    if let Some(model) = parameters {
        out.push('\n');
        out.push_str(&root(model));
    }
    out
}

/// The table `[parameters]` with all its parameters.
pub(crate) fn root(model: &Parameters) -> String {
    let mut out = String::new();
    comment(&mut out, &model.doc);
    out.push_str("[parameters]\n");
    block(&mut out, &model.parameters, "parameters");
    out
}

/// The values of a table precede the tables in it, which TOML requires.
fn block(out: &mut String, parameters: &[Parameter], path: &str) {
    for parameter in parameters
        .iter()
        .filter(|p| matches!(p.kind, Kind::Scalar { .. }))
    {
        out.push('\n');
        out.push_str(&scalar(parameter, &parameter.name));
    }
    for parameter in parameters
        .iter()
        .filter(|p| !matches!(p.kind, Kind::Scalar { .. }))
    {
        out.push('\n');
        out.push_str(&table(parameter, &format!("{path}.{}", parameter.name)));
    }
}

/// A group or a list with the header `path`.
pub(crate) fn table(parameter: &Parameter, path: &str) -> String {
    let mut out = String::new();
    comment(&mut out, &parameter.doc);
    match &parameter.kind {
        Kind::Scalar { .. } => {}
        Kind::Group(inner) => {
            let _ = writeln!(out, "[{path}]");
            block(&mut out, inner, path);
        }
        Kind::List { length, parameters } => {
            let _ = writeln!(out, "# {}", parameter.summary());
            let mut element = format!("[[{path}]]\n");
            block(&mut element, parameters, path);
            if length.min == 0 {
                comment(
                    &mut out,
                    &element.lines().map(str::to_owned).collect::<Vec<_>>(),
                );
            }
            let elements = vec![element; length.min as usize];
            out.push_str(&elements.join("\n"));
        }
    }
    out
}

/// A value with the key `name`, and its comment.
pub(crate) fn scalar(parameter: &Parameter, name: &str) -> String {
    let mut out = String::new();
    comment(&mut out, &parameter.doc);
    let mut allowed = parameter.summary();
    if let Some(change) = parameter.change() {
        let _ = write!(allowed, "; {change}");
    }
    if parameter.secret {
        allowed.push_str("; secret");
    }
    comment(&mut out, &[allowed]);
    let _ = match &parameter.default {
        Some(default) => writeln!(out, "{name} = {}", default.to_toml()),
        None => writeln!(out, "# {name} =     # must be set"),
    };
    out
}

fn comment(out: &mut String, lines: &[String]) {
    for line in lines {
        // A line break in a unit or a documentation would end the comment.
        let line = line.replace(['\n', '\r'], " ");
        out.push_str(format!("# {line}").trim_end());
        out.push('\n');
    }
}
