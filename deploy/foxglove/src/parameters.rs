//! Parameters, as the protocol has them.

use crate::offers::Offers;
use crate::protocol;
use serde_json::{Value as Json, json};
use std::collections::BTreeSet;

/// The values of parameters with these names, or of all.
pub(crate) fn values(offers: &Offers, names: &[String], id: Option<&str>) -> Json {
    let all = offers.parameters.iter();
    let names: BTreeSet<&String> = names.iter().collect();
    let wanted = all.filter(|(name, _)| names.is_empty() || names.contains(name));
    let wanted = wanted.map(|(name, one)| protocol::parameter(name, &one.value));
    let mut document = json!({"op": "parameterValues", "parameters": wanted.collect::<Vec<_>>()});
    if let Some(id) = id {
        document["id"] = json!(id);
    }
    document
}

/// A value as a number of the same type as another one: JavaScript has one type of numbers.
pub(crate) fn like(known: &Json, value: Json) -> Json {
    match (known, value) {
        (Json::Number(known), Json::Number(value)) => {
            if known.is_f64() {
                value
                    .as_f64()
                    .map_or(Json::Number(value), |float| json!(float))
            } else {
                let whole = value
                    .as_f64()
                    .filter(|v| v.fract() == 0.0 && v.abs() < 2e15);
                match whole {
                    Some(whole) if value.is_f64() => json!(whole as i64),
                    _ => Json::Number(value),
                }
            }
        }
        (Json::Array(known), Json::Array(values)) => {
            let first = known.first().cloned().unwrap_or_default();
            let each = values.into_iter().enumerate();
            let each = each.map(|(at, value)| like(known.get(at).unwrap_or(&first), value));
            Json::Array(each.collect())
        }
        (_, value) => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_get_the_type_of_their_parameter() {
        assert_eq!(like(&json!(1.5), json!(2)), json!(2.0));
        assert_eq!(like(&json!(1), json!(2.0)), json!(2));
        assert_eq!(like(&json!(1), json!(2.5)), json!(2.5));
        assert_eq!(like(&json!([1.0]), json!([2, 3])), json!([2.0, 3.0]));
        assert_eq!(like(&json!("a"), json!(3)), json!(3));
    }
}
