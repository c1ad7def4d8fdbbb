//! Checks the schema with an independent validator: the Python package `jsonschema`.

use serde_json::{Value as Json, json};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use toml_edit::{Document, Item, TableLike, Value};

/// Prints a line for each wrong verdict, then `done`.
const PROGRAM: &str = r#"
import json, sys
from jsonschema import Draft7Validator
for line in sys.stdin:
    case = json.loads(line)
    Draft7Validator.check_schema(case["schema"])
    validator = Draft7Validator(case["schema"])
    for instance, right in case["instances"]:
        if validator.is_valid(instance) != right:
            print("should be", right, json.dumps(instance), json.dumps(case["schema"]))
print("done")
"#;
pub(crate) const PACKAGE: &str = "jsonschema==4.23.0";

/// A schema, and documents with whether it must accept them.
pub(crate) struct Case {
    pub(crate) schema: String,
    pub(crate) instances: Vec<(Json, bool)>,
}

/// Checks the verdict on every document.
pub(crate) fn judge(python: &Path, cases: &[Case]) {
    let lines: String = cases
        .iter()
        .map(|case| {
            let schema: Json = serde_json::from_str(&case.schema).expect("a schema in JSON");
            format!(
                "{}\n",
                json!({ "schema": schema, "instances": case.instances })
            )
        })
        .collect();
    let mut child = Command::new(python)
        .args(["-c", PROGRAM])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("python");
    // The reply is short until a verdict is wrong, so the pipes cannot fill up and block.
    let mut stdin = child.stdin.take().expect("its input");
    let writer = std::thread::spawn(move || stdin.write_all(lines.as_bytes()));
    let output = child.wait_with_output().expect("a reply");
    let _ = writer.join();
    let printed = String::from_utf8_lossy(&output.stdout);
    assert_eq!(
        printed.lines().next(),
        Some("done"),
        "{printed}{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// A configuration as JSON, as editors validate it: a date is a string, NaN and infinities are
/// null.
pub(crate) fn json_of(toml: &str) -> Json {
    let document = Document::parse(toml).expect("TOML");
    table(document.as_table())
}

fn table(table: &dyn TableLike) -> Json {
    let entries = table.iter();
    Json::Object(
        entries
            .map(|(key, item)| (key.to_owned(), item_json(item)))
            .collect(),
    )
}

fn item_json(item: &Item) -> Json {
    match item {
        Item::None => Json::Null,
        Item::Value(of) => value(of),
        Item::Table(of) => table(of),
        Item::ArrayOfTables(tables) => tables.iter().map(|of| table(of)).collect(),
    }
}

fn value(of: &Value) -> Json {
    match of {
        Value::String(text) => Json::from(text.value().as_str()),
        Value::Integer(number) => Json::from(*number.value()),
        Value::Float(number) => Json::from(*number.value()),
        Value::Boolean(value) => Json::from(*value.value()),
        Value::Datetime(date) => Json::from(date.value().to_string()),
        Value::Array(values) => values.iter().map(value).collect(),
        Value::InlineTable(of) => table(of),
    }
}
