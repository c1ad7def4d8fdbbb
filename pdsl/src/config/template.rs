//! The first configuration file of a component, which its user then owns.

use crate::model::{Kind, Parameter, Parameters};
use std::fmt::Write;

/// The text of `etc/config.toml`: every parameter with its documentation, what is allowed, and its default. A
/// parameter without default is a comment that says that it must be set.
pub fn template(component_name: &str, parameters: Option<&Parameters>) -> String {
    let mut out = format!(
        "# The configuration of {component_name}. It was written once and is yours to change.\n\
         \n\
         # [component]\n\
         # period = \"100ms\"    # how often it computes\n\
         # log = \"info\"        # error, warn, info, debug or trace\n"
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
    if parameter.editable {
        allowed.push_str("; may be changed while the component runs");
    }
    if parameter.restart {
        allowed.push_str("; a change takes effect at the next start");
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
