//! The JSON Schema of configurations, for editors that complete and check TOML.
//!
//! The schema never refuses a configuration that the checker accepts. It does not express rules,
//! ranges of durations that are strings, and the limits of floating-point numbers. It follows
//! draft 7, which editors support.

use crate::check::{COMPONENT, LEVELS, SHORTEST_PERIOD};
use crate::model::{Kind, Length, Parameter, Parameters, Rule, Type, Value};
use rc_vocabulary::duration as time;
use rc_vocabulary::qos::{PolicyName, Values};
use rc_vocabulary::{Key, Kind as Takes, Middleware, Value as Setting};
use serde_json::{Map, Value as Json, json};
use std::time::Duration;

/// The longest line of a schema, in bytes, unless a single value is longer.
const LINE: usize = 140;
/// The format of a duration, as `rc_vocabulary::duration::parse` reads it.
const DURATION: &str = r"^\s*\+?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*(us|ms|s|min|h)\s*$";
/// The format of the address of a slot: names with `/` between them.
const ADDRESS: &str = "^[A-Za-z0-9_-]+(/[A-Za-z0-9_-]+)*$";
/// The formats of a namespace of ROS 2, of the name of a node, and of rules.
const NAMESPACE: &str = "^/([A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?$";
const NODE: &str = "^[A-Za-z_][A-Za-z0-9_]*$";
const QOS: &str = "^[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*){0,2}\\.[a-z]+:=[a-z0-9._]+$";
const REMAPPING: &str = "^[A-Za-z0-9_/~]+:=[A-Za-z0-9_/~]+$";

/// A slot of the component, with its description.
pub struct Slot<'a> {
    /// The name, as in `[bindings]`.
    pub name: &'a str,
    /// Whether it is an array, whose members have addresses.
    pub is_array: bool,
    /// The description: "requires `Laser`".
    pub what: String,
}

/// The schema of the configurations of a component, as JSON.
pub fn schema(
    component_name: &str,
    period: Duration,
    slots: &[Slot<'_>],
    parameters: Option<&Parameters>,
) -> String {
    let mut component = duration(
        json!({ "minimum": SHORTEST_PERIOD as f64 / 1e6 }),
        json!(time::text_of(period)),
    );
    describe(&mut component, "How often it computes.".to_owned());
    let log = json!({ "description": "The least severe messages that are logged.", "enum": LEVELS, "default": "info" });
    let component = COMPONENT.into_iter().zip([component, log]);
    let bindings = slots.iter().map(|slot| {
        let what = format!("The address of the slot `{}`: {}.", slot.name, slot.what);
        let address = json!({ "description": what, "type": "string", "pattern": ADDRESS });
        let members = json!({ "type": "object", "additionalProperties": address });
        (slot.name, if slot.is_array { members } else { address })
    });
    // `lasers.front = "…"` is a table; `"lasers.front" = "…"` is one key.
    let arrays = slots.iter().filter(|slot| slot.is_array).map(|slot| {
        let address = json!({ "type": "string", "pattern": ADDRESS });
        (format!("^{}\\.", slot.name), address)
    });
    let arrays: Map<String, Json> = arrays.collect();
    let mut declared = table(
        parameters.map_or(&[][..], |model| &model.parameters),
        parameters.map_or(&[][..], |model| &model.rules),
        &mut Vec::new(),
        parameters.map_or(&[][..], |model| &model.doc),
    );
    let required = declared.get("required").map(|_| ["parameters"]);
    if parameters.is_none() {
        describe(
            &mut declared,
            "This component has no parameters.".to_owned(),
        );
    }
    let mut root = object([
        ("component", {
            let mut table = object(component);
            describe(&mut table, "How the component runs.".to_owned());
            table
        }),
        ("bindings", {
            let mut table = object(bindings);
            if !arrays.is_empty() {
                set(&mut table, "patternProperties", Json::Object(arrays));
            }
            describe(
                &mut table,
                "The address of the peers of each slot.".to_owned(),
            );
            table
        }),
        ("middleware", {
            let mut tables = object(
                Middleware::ALL.map(|one| (one.word(), settings(one.word(), one.can().keys))),
            );
            describe(
                &mut tables,
                "The settings of middlewares, one table each.".to_owned(),
            );
            tables
        }),
        ("parameters", declared),
    ]);
    set(
        &mut root,
        "$schema",
        json!("http://json-schema.org/draft-07/schema#"),
    );
    let text = json!({ "type": "string", "pattern": DURATION });
    set(&mut root, "definitions", json!({ "duration": text }));
    set(
        &mut root,
        "title",
        json!(format!("The configuration of {component_name}")),
    );
    if let Some(required) = required {
        set(&mut root, "required", json!(required));
    }
    let mut text = String::new();
    print(&root, 0, 2 * KEY, &SAME, &mut text);
    text + "\n"
}

/// How deep a key of a table lies in the schema: in the properties of a property.
const KEY: usize = 4;

/// JSON of a generated file, indented by two spaces. A value is printed on one line if it fits, if
/// it has few nested tables, or if it is `rows` tables and lists deep: at that depth it is one
/// setting, slot or type, and line-based differences show which one changed.
pub fn json_text(value: &Json, rows: usize) -> String {
    let mut text = String::new();
    print(value, 0, 2 * rows, &[], &mut text);
    text + "\n"
}

/// The blocks of a configuration that are nearly equal for all components. Each is printed on one
/// line, because nobody reads them for differences.
const SAME: [&str; 3] = ["bindings", "component", "middleware"];
/// The indentation of the blocks of a configuration.
const BLOCK: usize = 4;

/// The greatest nesting of tables and lists in a value that is printed on one line.
const DEEPEST: usize = 3;

/// The nesting depth of tables and lists. A table of declared keys counts as deep.
fn depth(value: &Json) -> usize {
    let deepest = |parts: &mut dyn Iterator<Item = &Json>| parts.map(depth).max().unwrap_or(0);
    match value {
        Json::Object(entries) if entries.get("properties").is_some_and(|p| depth(p) > 1) => {
            DEEPEST + 1
        }
        Json::Object(entries) => 1 + deepest(&mut entries.values()),
        Json::Array(items) => 1 + deepest(&mut items.iter()),
        _ => 0,
    }
}

/// `whole`: the blocks of a configuration that are printed on one line.
fn print(value: &Json, indent: usize, deepest: usize, whole: &[&str], out: &mut String) {
    let line = value.to_string();
    if indent + line.len() <= LINE || depth(value) <= DEEPEST || indent >= deepest {
        out.push_str(&line);
        return;
    }
    let inside = indent + 2;
    let begin = |first: bool, out: &mut String| {
        out.push_str(if first { "\n" } else { ",\n" });
        out.push_str(&" ".repeat(inside));
    };
    let end = match value {
        Json::Object(entries) if !entries.is_empty() => {
            out.push('{');
            for (at, (key, value)) in entries.iter().enumerate() {
                begin(at == 0, out);
                out.push_str(&Json::from(key.as_str()).to_string());
                out.push_str(": ");
                if inside == BLOCK && whole.contains(&key.as_str()) {
                    out.push_str(&value.to_string());
                } else {
                    print(value, inside, deepest, whole, out);
                }
            }
            '}'
        }
        Json::Array(items) if !items.is_empty() => {
            out.push('[');
            for (at, item) in items.iter().enumerate() {
                begin(at == 0, out);
                print(item, inside, deepest, whole, out);
            }
            ']'
        }
        _ => {
            out.push_str(&line);
            return;
        }
    };
    out.push('\n');
    out.push_str(&" ".repeat(indent));
    out.push(end);
}

/// The settings of a middleware.
fn settings(middleware: &str, keys: &[Key]) -> Json {
    let mut table = object(keys.iter().map(|key| (key.name, setting(key))));
    describe(
        &mut table,
        if keys.is_empty() {
            format!("There are no settings of {middleware} yet.")
        } else {
            format!("The settings of {middleware}.")
        },
    );
    table
}

fn setting(key: &Key) -> Json {
    let mut schema = match &key.kind {
        Takes::Int(range) => {
            json!({ "type": "integer", "minimum": range.start(), "maximum": range.end() })
        }
        Takes::Bool => json!({ "type": "boolean" }),
        Takes::Duration(range) => {
            let milliseconds = |limit: &Duration| limit.as_nanos() as f64 / 1e6;
            let (minimum, maximum) = (milliseconds(range.start()), milliseconds(range.end()));
            duration(
                json!({ "minimum": minimum, "maximum": maximum }),
                Json::Null,
            )
        }
        Takes::Interfaces | Takes::Peers => {
            json!({ "type": "array", "items": { "type": "string" } })
        }
        Takes::Namespace => json!({ "type": "string", "pattern": NAMESPACE }),
        Takes::Node => json!({ "type": "string", "pattern": NODE }),
        Takes::Remappings => json!({ "anyOf": [
            { "type": "array", "items": { "type": "string", "pattern": REMAPPING } },
            { "type": "object", "additionalProperties": { "type": "string" } },
        ] }),
        Takes::Qos => json!({ "anyOf": [
            { "type": "array", "items": { "type": "string", "pattern": QOS } },
            { "type": "object", "additionalProperties": policies() },
        ] }),
    };
    if let Some(default) = &key.default {
        let default = match default {
            Setting::Bool(value) => Json::from(*value),
            Setting::Int(value) => Json::from(*value),
            other => Json::from(other.to_string()),
        };
        set(&mut schema, "default", default);
    }
    describe(&mut schema, key.doc.to_owned());
    schema
}

/// The policies of the quality of service of a topic.
fn policies() -> Json {
    let time = || {
        let mut time = duration(json!({ "exclusiveMinimum": 0 }), Json::Null);
        if let Some(either) = time.get_mut("anyOf").and_then(Json::as_array_mut) {
            either.push(json!({ "const": "none" }));
        }
        time
    };
    object(PolicyName::of_topics().map(|policy| {
        let schema = match policy.values() {
            Values::Words(words) => json!({ "enum": words }),
            Values::Count(range) => {
                json!({ "type": "integer", "minimum": range.start(), "maximum": range.end() })
            }
            Values::Limit | Values::Time | Values::Within(_) => time(),
        };
        (policy.word(), schema)
    }))
}

/// A table with these keys and no others.
fn object<'a>(properties: impl IntoIterator<Item = (&'a str, Json)>) -> Json {
    let properties: Map<String, Json> = properties
        .into_iter()
        .map(|(name, schema)| (name.to_owned(), schema))
        .collect();
    json!({ "type": "object", "properties": properties, "additionalProperties": false })
}

fn set(schema: &mut Json, key: &str, value: Json) {
    if let Some(schema) = schema.as_object_mut() {
        schema.insert(key.to_owned(), value);
    }
}

fn describe(schema: &mut Json, text: String) {
    if !text.is_empty() {
        set(schema, "description", Json::from(text));
    }
}

/// The table of a block, with the rules of `scope`.
fn table<'a>(
    parameters: &'a [Parameter],
    rules: &[Rule],
    scope: &mut Vec<&'a str>,
    doc: &[String],
) -> Json {
    let mut properties = Vec::new();
    for parameter in parameters {
        scope.push(&parameter.name);
        properties.push((parameter.name.as_str(), of(parameter, rules, scope)));
        scope.pop();
    }
    let mut table = object(properties);
    let required = parameters.iter().filter(|p| p.is_required());
    let required: Vec<&str> = required.map(|p| p.name.as_str()).collect();
    if !required.is_empty() {
        set(&mut table, "required", json!(required));
    }
    let mut text = doc.to_vec();
    let own = rules.iter().filter(|rule| rule.scope == *scope);
    text.extend(own.map(|rule| format!("Rule: {} ({}).", rule.message, rule.text)));
    describe(&mut table, text.join("\n"));
    table
}

fn of<'a>(parameter: &'a Parameter, rules: &[Rule], scope: &mut Vec<&'a str>) -> Json {
    match &parameter.kind {
        Kind::Group(members) => table(members, rules, scope, &parameter.doc),
        Kind::List { length, parameters } => {
            let mut list = elements(table(parameters, rules, scope, &[]), *length);
            describe(&mut list, description(parameter));
            list
        }
        Kind::Scalar { ty, array } => {
            // An editor must not show secrets.
            let default = parameter.default.as_ref().filter(|_| !parameter.secret);
            let default = default.and_then(json_of);
            let mut schema = match array {
                None => scalar(parameter, *ty),
                Some(length) => elements(scalar(parameter, *ty), *length),
            };
            if let Some(default) = default {
                set(&mut schema, "default", default);
            }
            describe(&mut schema, description(parameter));
            schema
        }
    }
}

fn elements(items: Json, length: Length) -> Json {
    let mut schema = json!({ "type": "array" });
    set(&mut schema, "items", items);
    if length.min > 0 {
        set(&mut schema, "minItems", json!(length.min));
    }
    if let Some(max) = length.max {
        set(&mut schema, "maxItems", json!(max));
    }
    schema
}

/// The documentation, and the facts that no other part of the schema expresses.
fn description(parameter: &Parameter) -> String {
    let mut lines = parameter.doc.clone();
    let mut facts = vec![format!("{}.", parameter.summary())];
    if let Some(change) = parameter.change() {
        facts.push(format!("{}.", sentence(change)));
    }
    if parameter.secret {
        facts.push("Secret: tools never show its value.".to_owned());
    }
    lines.push(facts.join(" "));
    lines.join("\n")
}

/// Capitalises the first letter.
fn sentence(text: &str) -> String {
    let mut chars = text.chars();
    let first = chars.next().map(|c| c.to_ascii_uppercase());
    first.into_iter().chain(chars).collect()
}

/// The schema of one value.
fn scalar(parameter: &Parameter, ty: Type) -> Json {
    if !parameter.choices.is_empty() && ty != Type::Duration {
        let choices: Vec<Json> = parameter.choices.iter().filter_map(json_of).collect();
        return json!({ "enum": choices });
    }
    let range = parameter.range.as_ref();
    let min = range.and_then(|r| r.min.as_ref()).and_then(number);
    let max = range.and_then(|r| r.max.as_ref()).and_then(number);
    let word = match ty {
        Type::Bool => "boolean",
        Type::Int | Type::Long => "integer",
        Type::Float | Type::Double => "number",
        Type::String | Type::Path => "string",
        Type::Duration => {
            let mut limits = json!({ "minimum": 0 });
            set_limits(&mut limits, min, max);
            return duration(limits, Json::Null);
        }
    };
    let mut schema = json!({ "type": word });
    let (least, most) = match ty {
        Type::Int => (Some(json!(i32::MIN)), Some(json!(i32::MAX))),
        _ => (None, None),
    };
    set_limits(&mut schema, min.or(least), max.or(most));
    schema
}

fn set_limits(schema: &mut Json, min: Option<Json>, max: Option<Json>) {
    for (key, limit) in [("minimum", min), ("maximum", max)] {
        if let Some(limit) = limit {
            set(schema, key, limit);
        }
    }
}

/// A string with a unit, which `definitions` describes, or a number of milliseconds within
/// `limits`.
fn duration(mut limits: Json, default: Json) -> Json {
    set(&mut limits, "type", json!("number"));
    let mut schema = json!({ "anyOf": [{ "$ref": "#/definitions/duration" }, limits] });
    if !default.is_null() {
        set(&mut schema, "default", default);
    }
    schema
}

/// The limit of a range; of a duration in milliseconds. An infinite limit is none.
fn number(value: &Value) -> Option<Json> {
    match value {
        Value::Duration(ns) => Some(json!(*ns as f64 / 1e6)),
        other => json_of(other),
    }
}

/// The value in a configuration, if JSON can express it.
fn json_of(value: &Value) -> Option<Json> {
    Some(match value {
        Value::Bool(value) => Json::from(*value),
        Value::Int(value) => Json::from(*value),
        Value::Float(value) => serde_json::Number::from_f64(*value)?.into(),
        Value::Text(value) => Json::from(value.as_str()),
        Value::Duration(value) => Json::from(time::text(*value)),
        Value::Array(values) => values.iter().map(json_of).collect::<Option<_>>()?,
    })
}
