//! Values that a command line, or a file of another system, gives to parameters.

use crate::model::Type;
use serde_json::Value as Json;

/// The words for booleans in YAML 1.1, in lower case, as the files of ROS 2 have them.
const TRUE: [&str; 4] = ["y", "yes", "true", "on"];
const FALSE: [&str; 4] = ["n", "no", "false", "off"];

/// A value for a parameter whose type is not known yet.
#[derive(Clone, Debug, PartialEq)]
pub struct UntypedValue {
    /// The text, if a string needs no quotes.
    pub text: Option<String>,
    /// The value of the text.
    pub value: Json,
}

impl UntypedValue {
    /// A value of a command line, where strings need no quotes. Anything else is JSON.
    pub fn of_text(text: &str) -> Self {
        Self {
            text: Some(text.to_owned()),
            value: serde_json::from_str(text).unwrap_or_else(|_| Json::from(text)),
        }
    }

    /// The value for a parameter of this type, or for an array of it.
    pub(crate) fn json(&self, ty: Type, is_array: bool) -> Json {
        match (ty, &self.text, &self.value) {
            (Type::String | Type::Path, Some(text), value) if !is_array && !value.is_string() => {
                Json::from(text.as_str())
            }
            (Type::Bool, _, Json::Array(values)) => values.iter().map(boolean).collect(),
            (Type::Bool, _, value) => boolean(value),
            (_, _, value) => value.clone(),
        }
    }
}

fn boolean(value: &Json) -> Json {
    let is = |words: [&str; 4]| {
        let text = value.as_str().unwrap_or_default();
        words.iter().any(|word| word.eq_ignore_ascii_case(text))
    };
    match (is(TRUE), is(FALSE)) {
        (true, _) => Json::Bool(true),
        (_, true) => Json::Bool(false),
        _ => value.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_type_decides_what_a_text_is() {
        let given = |text: &str, value: Json| UntypedValue {
            text: Some(text.to_owned()),
            value,
        };
        assert_eq!(given("7", json!(7)).json(Type::String, false), json!("7"));
        assert_eq!(given("7", json!(7)).json(Type::Int, false), json!(7));
        assert_eq!(
            given("\"7\"", json!("7")).json(Type::String, false),
            json!("7")
        );
        assert_eq!(
            given("Yes", json!("Yes")).json(Type::Bool, false),
            json!(true)
        );
        assert_eq!(
            given("off", json!("off")).json(Type::String, false),
            json!("off")
        );
        let words = given("[on, no]", json!(["on", "no"]));
        assert_eq!(words.json(Type::Bool, true), json!([true, false]));
        assert_eq!(words.json(Type::String, true), json!(["on", "no"]));
    }
}
