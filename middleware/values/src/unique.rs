//! JSON that a person wrote, in which a duplicate key is a mistake.

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value as Json};
use std::fmt;

/// Reads JSON, and refuses an object with the same key twice. `serde_json` keeps the last one.
///
/// # Errors
/// They say at which line and column.
///
/// ```
/// use rc_values::json_of_person;
///
/// assert_eq!(json_of_person(r#"{"a": [1]}"#)?, serde_json::json!({"a": [1]}));
/// let twice = json_of_person(r#"{"a": {"b": 1, "b": 2}}"#).unwrap_err();
/// assert!(twice.to_string().starts_with("the key `b` occurs twice at line 1"));
/// # Ok::<(), serde_json::Error>(())
/// ```
pub fn json_of_person(text: &str) -> Result<Json, serde_json::Error> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let json = Unique.deserialize(&mut reader)?;
    reader.end()?;
    Ok(json)
}

struct Unique;

impl<'de> DeserializeSeed<'de> for Unique {
    type Value = Json;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Json, D::Error> {
        from.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Unique {
    type Value = Json;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Json, E> {
        Ok(Json::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Json, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Json, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Json, E> {
        Ok(value.into())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Json, E> {
        let number = Number::from_f64(value).map(Json::Number);
        number.ok_or_else(|| E::custom("the number is too large"))
    }

    fn visit_str<E>(self, value: &str) -> Result<Json, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Json, A::Error> {
        let mut all = Vec::new();
        while let Some(item) = items.next_element_seed(Self)? {
            all.push(item);
        }
        Ok(Json::Array(all))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Json, A::Error> {
        let mut all = Map::new();
        while let Some(key) = entries.next_key::<String>()? {
            if all.contains_key(&key) {
                let key = rc_diagnostics::foreign::clean(&key);
                return Err(A::Error::custom(format!("the key `{key}` occurs twice")));
            }
            all.insert(key, entries.next_value_seed(Self)?);
        }
        Ok(Json::Object(all))
    }
}
