//! The parameters of a whole network as one TOML file: a table for each component, a line for each
//! parameter.

use crate::params::{list, text};
use crate::{Error, status};
use rc_management::component::{ParameterStatus, Parameters};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// The values of parameters by component and path.
pub type NetworkValues = BTreeMap<String, Map<String, Value>>;

/// The parameters of all components, and why some components did not name theirs.
pub fn list_all(network: &str) -> Result<(Vec<(String, Parameters)>, Vec<Error>), Error> {
    let report = status::report(network)?;
    let (mut all, mut missing) = (Vec::new(), Vec::new());
    for component in report.components().map(|c| c.name.clone()) {
        match list(network, &component, &[]) {
            Ok(listed) => all.push((component, listed)),
            Err(error) => missing.push(error),
        }
    }
    Ok((all, missing))
}

/// The file. A value that holds from the next start on is written in place of the present one; a
/// secret becomes a comment.
pub fn file(network: &str, all: &[(String, Parameters)]) -> String {
    let mut out = format!(
        "# The parameters of network {network}. `rcdeploy params load {network} FILE` sets them.\n"
    );
    for (name, listed) in all
        .iter()
        .filter(|(_, listed)| !listed.parameters.is_empty())
    {
        out.push_str(&format!("\n[{}]\n", key(name)));
        for parameter in &listed.parameters {
            let path = key(&parameter.path);
            if parameter.secret {
                out.push_str(&format!("# {path} is a secret\n"));
                continue;
            }
            out.push_str(&format!("{path} = {}\n", text(next_value(parameter))));
        }
    }
    // JSON does not escape the last control character of ASCII, which TOML forbids.
    out.replace('\u{7f}', "\\u007F")
}

/// A key of TOML: a name, or a text in quotes. A dotted path is one key, too.
fn key(path: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if path.chars().all(is_bare) && !path.is_empty() {
        path.to_owned()
    } else {
        Value::from(path).to_string()
    }
}

/// The value of the next start.
fn next_value(parameter: &ParameterStatus) -> &Value {
    parameter.pending.as_ref().unwrap_or(&parameter.value)
}

/// Reads a file. Groups and lists may also be tables, as in a configuration.
///
/// # Errors
/// The text is not TOML, or something is not in the table of a component.
pub fn read(text: &str) -> Result<NetworkValues, String> {
    let mut all = NetworkValues::new();
    for (component, table) in rc_configuration::parse_document(text)? {
        let Value::Object(table) = table else {
            return Err(format!(
                "`{component}` is a value; expected a table for each component, as in `[avoider]`"
            ));
        };
        let values = all.entry(component).or_default();
        for (path, value) in table {
            flatten(&path, value, values);
        }
    }
    Ok(all)
}

fn flatten(path: &str, value: Value, values: &mut Map<String, Value>) {
    let is_list = |items: &[Value]| !items.is_empty() && items.iter().all(Value::is_object);
    match value {
        Value::Object(group) => {
            for (name, value) in group {
                flatten(&format!("{path}.{name}"), value, values);
            }
        }
        Value::Array(items) if is_list(&items) => {
            for (at, value) in items.into_iter().enumerate() {
                flatten(&format!("{path}[{at}]"), value, values);
            }
        }
        value => drop(values.insert(path.to_owned(), value)),
    }
}

/// Leaves out the values that the parameters of a running network have already.
///
/// # Errors
/// A component does not run, or does not reply.
pub fn only_changes(network: &str, wanted: NetworkValues) -> Result<NetworkValues, Error> {
    let mut changes = NetworkValues::new();
    for (component, mut values) in wanted {
        let listed = list(network, &component, &[])?.parameters;
        // The component refuses a path that it does not have.
        values.retain(|path, value| {
            let known = listed.iter().find(|one| one.path == *path);
            known.is_none_or(|one| one.secret || !is_equal(next_value(one), value))
        });
        if !values.is_empty() {
            changes.insert(component, values);
        }
    }
    Ok(changes)
}

/// Whether two values are equal: 5 is 5.0, as in a configuration.
fn is_equal(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_equal(a, b))
        }
        (Value::Number(a), Value::Number(b)) if a.is_f64() != b.is_f64() => {
            a.as_f64() == b.as_f64()
        }
        _ => a == b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn parameter(path: &str, value: impl Into<Value>) -> Value {
        let value: Value = value.into();
        json!({ "path": path, "value": value, "allowed": "", "editable": true, "restart": false, "secret": false })
    }

    #[test]
    fn a_file_has_what_it_is_read_as() {
        let mut secret = parameter("token", "***");
        secret["secret"] = true.into();
        let mut pending = parameter("device", "/dev/a");
        pending["pending"] = "/dev/\u{7f}\"b\"\n".into();
        let motor = json!({ "file": null, "parameters": [
            parameter("motors[0].max", json!(1.25)), parameter("gains", json!([1, 2])),
            parameter("names", json!([])), parameter("sine.amplitude", json!("inf")), pending, secret,
        ]});
        let empty = json!({ "file": null, "parameters": [] });
        let parsed = |json| serde_json::from_value(json).expect("parameters");
        let all = [
            ("arm.left".to_owned(), parsed(motor)),
            ("camera".to_owned(), parsed(empty)),
        ];
        let text = file("arm", &all);
        assert!(
            text.contains("\n[\"arm.left\"]\n\"motors[0].max\" = 1.25\ngains = [1, 2]\n"),
            "{text}"
        );
        assert!(
            text.ends_with("# token is a secret\n") && !text.contains("***"),
            "{text}"
        );
        let read = read(&text).expect("a file");
        let values = json!({
            "motors[0].max": 1.25, "gains": [1, 2], "names": [], "sine.amplitude": "inf",
            "device": "/dev/\u{7f}\"b\"\n",
        });
        assert_eq!(read.len(), 1);
        assert_eq!(Value::from(read["arm.left"].clone()), values);
    }

    #[test]
    fn tables_are_groups_and_lists_and_other_texts_are_errors() {
        let text = "[bus]\nrate = 5\nsine.amplitude = 1\n[bus.limits]\nspeed = 2\n[[bus.motors]]\nmax = 1\n[[bus.motors]]\nmax = 2\n";
        let values = json!({
            "rate": 5, "sine.amplitude": 1, "limits.speed": 2, "motors[0].max": 1, "motors[1].max": 2,
        });
        let found = read(text).expect("a file");
        assert_eq!(Value::from(found["bus"].clone()), values);
        let error = read("rate = 5\n").expect_err("no component");
        assert!(error.contains("`rate` is a value"), "{error}");
        let error = read("[bus]\nrate = \n").expect_err("no TOML");
        assert!(error.contains("line 2, column 8"), "{error}");
        assert!(is_equal(&json!([5, "a"]), &json!([5.0, "a"])));
        assert!(!is_equal(&json!(5), &json!("5")) && !is_equal(&json!(5), &json!(5.5)));
    }
}
