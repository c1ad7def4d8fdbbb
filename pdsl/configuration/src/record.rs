//! Parameters in a recording of a component: exact, in order, and without secrets.
//!
//! The JSON of the management socket does not tell a duration from a string. Here a value is
//! `true`, `"text"`, `{"int": 3}`, `{"bits": 4607182418800017408}` (a floating-point number),
//! `{"ns": 5}` or a list; a group is `{"group": [[NAME, ENTRY], …]}`, a list of structures
//! `{"list": [[[NAME, ENTRY], …], …]}`, and a secret `null`.

use crate::change::ParamChange;
use crate::model::Value;
use crate::values::{Entry, Values};
use serde_json::{Value as Json, json};

impl Values {
    /// All values but those of secrets.
    pub fn to_record(&self) -> Json {
        let entries = self.entries().iter().map(|(name, entry)| {
            let entry = match entry {
                Entry::Value(_, true) => Json::Null,
                Entry::Value(value, false) => value_to_record(value),
                Entry::Group(values) => json!({ "group": values.to_record() }),
                Entry::List(list) => {
                    let list: Vec<Json> = list.iter().map(Values::to_record).collect();
                    json!({ "list": list })
                }
            };
            json!([name, entry])
        });
        entries.collect()
    }

    /// Reads what [`Values::to_record`] wrote. Secrets are taken from `secrets`, by their names;
    /// without it they are empty. An error describes the mistake.
    pub fn from_record(record: &Json, secrets: Option<&Values>) -> Result<Self, String> {
        let mut out = Self::default();
        for pair in array(record)? {
            let [name, entry] = array(pair)? else {
                return Err(format!("`{pair}` is not a pair of a name and a value"));
            };
            let name = name.as_str().ok_or("a name is not a string")?;
            let known = secrets.and_then(|secrets| secrets.entry(name));
            let entry = if entry.is_null() {
                match known {
                    Some(Entry::Value(value, true)) => Entry::Value(value.clone(), true),
                    _ => Entry::Value(Value::Text(String::new()), true),
                }
            } else if let Some(group) = entry.get("group") {
                let known = match known {
                    Some(Entry::Group(values)) => Some(values),
                    _ => None,
                };
                Entry::Group(Self::from_record(group, known)?)
            } else if let Some(list) = entry.get("list") {
                let known = match known {
                    Some(Entry::List(list)) => list.as_slice(),
                    _ => &[],
                };
                let items = array(list)?.iter().enumerate();
                let items = items.map(|(at, item)| Self::from_record(item, known.get(at)));
                Entry::List(items.collect::<Result<_, _>>()?)
            } else {
                Entry::Value(value_from_record(entry)?, false)
            };
            out.push(name.to_owned(), entry);
        }
        Ok(out)
    }
}

impl ParamChange {
    /// Changes for a recording. Secrets have no values.
    pub fn to_record(changes: &[Self]) -> Json {
        let changes = changes.iter().map(|change| {
            let value = |value: &Value| {
                if change.secret {
                    Json::Null
                } else {
                    value_to_record(value)
                }
            };
            json!([change.path, value(&change.old), value(&change.new)])
        });
        changes.collect()
    }

    /// Reads the output of [`ParamChange::to_record`]. An error describes the mistake.
    pub fn from_record(record: &Json) -> Result<Vec<Self>, String> {
        let changes = array(record)?.iter().map(|change| {
            let [path, old, new] = array(change)? else {
                return Err(format!("`{change}` is not a change"));
            };
            let secret = old.is_null();
            let value = |json: &Json| {
                if secret {
                    Ok(Value::Text(String::new()))
                } else {
                    value_from_record(json)
                }
            };
            Ok(Self {
                path: path.as_str().unwrap_or_default().to_owned(),
                old: value(old)?,
                new: value(new)?,
                secret,
            })
        });
        changes.collect()
    }
}

fn array(json: &Json) -> Result<&[Json], String> {
    let array = json.as_array().map(Vec::as_slice);
    array.ok_or_else(|| format!("`{json}` is not a list"))
}

fn value_to_record(value: &Value) -> Json {
    match value {
        Value::Bool(value) => json!(value),
        Value::Int(value) => json!({ "int": value }),
        Value::Float(value) => json!({ "bits": value.to_bits() }),
        Value::Text(value) => json!(value),
        Value::Duration(value) => json!({ "ns": value }),
        Value::Array(values) => values.iter().map(value_to_record).collect(),
    }
}

fn value_from_record(json: &Json) -> Result<Value, String> {
    let wrong = || format!("`{json}` is not a value");
    Ok(match json {
        Json::Bool(value) => Value::Bool(*value),
        Json::String(value) => Value::Text(value.clone()),
        Json::Array(values) => {
            let values = values.iter().map(value_from_record);
            Value::Array(values.collect::<Result<_, _>>()?)
        }
        Json::Object(one) => {
            let (kind, number) = one.iter().next().ok_or_else(wrong)?;
            match kind.as_str() {
                "int" => Value::Int(number.as_i64().ok_or_else(wrong)?),
                "bits" => Value::Float(f64::from_bits(number.as_u64().ok_or_else(wrong)?)),
                "ns" => Value::Duration(number.as_u64().ok_or_else(wrong)?),
                _ => return Err(wrong()),
            }
        }
        _ => return Err(wrong()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_exactly_and_without_secrets() {
        let mut inner = Values::default();
        inner.push(
            "f".to_owned(),
            Entry::Value(Value::Float(f64::INFINITY), false),
        );
        inner.push(
            "t".to_owned(),
            Entry::Value(Value::Duration(u64::MAX), false),
        );
        let mut values = Values::default();
        let array = Value::Array(vec![Value::Int(-3), Value::Bool(true)]);
        values.push("z".to_owned(), Entry::Value(array, false));
        values.push("a".to_owned(), Entry::Group(inner.clone()));
        values.push("l".to_owned(), Entry::List(vec![inner.clone(), inner]));
        let secret = Value::Text("hidden".to_owned());
        values.push("s".to_owned(), Entry::Value(secret, true));

        let record = values.to_record();
        assert!(!record.to_string().contains("hidden"));
        let text = record.to_string();
        let read: Json = serde_json::from_str(&text).expect("JSON");
        assert_eq!(
            Values::from_record(&read, Some(&values)),
            Ok(values.clone())
        );
        let without = Values::from_record(&read, None).expect("values");
        assert_eq!(without.text("s"), "");
        assert!(Values::from_record(&json!([["a"]]), None).is_err());
        assert!(Values::from_record(&json!([["a", {"int": 0.5}]]), None).is_err());
    }
}
