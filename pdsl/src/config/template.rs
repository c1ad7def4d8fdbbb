//! The first configuration file of a component, which its user then owns.

use crate::model::{Kind, Parameter, Parameters};
use rc_diagnostics::duration_text;
use std::fmt::Write;
use std::time::Duration;

/// The text of `etc/config.toml`: every parameter with its documentation, what is allowed, and its default. A
/// parameter without default is a comment that says that it must be set. `period` is the component's own.
pub fn template(component_name: &str, period: Duration, parameters: Option<&Parameters>) -> String {
    let period = format!("period = \"{}\"", duration_text(period.as_nanos() as u64));
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
        comment(&mut out, &model.doc);
        out.push_str("[parameters]\n");
        block(&mut out, &model.parameters, "parameters");
    }
    out
}

/// The values of a table come before the tables in it, or TOML would take them for theirs.
fn block(out: &mut String, parameters: &[Parameter], path: &str) {
    for parameter in parameters
        .iter()
        .filter(|p| matches!(p.kind, Kind::Scalar { .. }))
    {
        scalar(out, parameter);
    }
    for parameter in parameters {
        let path = format!("{path}.{}", parameter.name);
        match &parameter.kind {
            Kind::Scalar { .. } => {}
            Kind::Group(inner) => {
                out.push('\n');
                comment(out, &parameter.doc);
                let _ = writeln!(out, "[{path}]");
                block(out, inner, &path);
            }
            Kind::List { length, parameters } => {
                out.push('\n');
                comment(out, &parameter.doc);
                let _ = writeln!(out, "# {}", parameter.summary());
                let mut element = format!("[[{path}]]\n");
                block(&mut element, parameters, &path);
                if length.min == 0 {
                    comment(out, &element.lines().map(str::to_owned).collect::<Vec<_>>());
                }
                (0..length.min).for_each(|_| out.push_str(&element));
            }
        }
    }
}

fn scalar(out: &mut String, parameter: &Parameter) {
    out.push('\n');
    comment(out, &parameter.doc);
    let mut allowed = parameter.summary();
    if let Some(change) = parameter.change() {
        let _ = write!(allowed, "; {change}");
    }
    comment(out, &[allowed]);
    let _ = match &parameter.default {
        Some(default) => writeln!(out, "{} = {}", parameter.name, default.to_toml()),
        None => writeln!(out, "# {} =     # must be set", parameter.name),
    };
}

fn comment(out: &mut String, lines: &[String]) {
    for line in lines {
        // A line feed in a unit or a documentation would end the comment.
        let line = line.replace(['\n', '\r'], " ");
        out.push_str(format!("# {line}").trim_end());
        out.push('\n');
    }
}
