//! Parameters as backends know them.

use rc_configuration::LiveParameter;
use rc_configuration::model::{Type, Value as UntypedValue};
use rc_middleware::parameters::{Parameter, ParameterValue};
use serde_json::{Value, json};

/// The parameters that backends may show: all but secret ones.
pub(crate) fn shown(all: &[LiveParameter]) -> Vec<Parameter> {
    let shown = all.iter().filter(|parameter| !parameter.status.secret);
    shown.map(parameter).collect()
}

fn parameter(parameter: &LiveParameter) -> Parameter {
    let LiveParameter { status, ty, range } = parameter;
    let limit = |limit: Option<&UntypedValue>, otherwise: ParameterValue| match limit {
        Some(UntypedValue::Int(number)) => ParameterValue::Int(*number),
        Some(UntypedValue::Float(number)) => ParameterValue::Float(*number),
        _ => otherwise,
    };
    let range = range.as_ref().and_then(|range| {
        let (least, most) = match (*ty)? {
            (Type::Int, _) => (
                ParameterValue::Int(i32::MIN.into()),
                ParameterValue::Int(i32::MAX.into()),
            ),
            (Type::Long, _) => (ParameterValue::Int(i64::MIN), ParameterValue::Int(i64::MAX)),
            (Type::Float | Type::Double, _) => (
                ParameterValue::Float(f64::NEG_INFINITY),
                ParameterValue::Float(f64::INFINITY),
            ),
            _ => return None,
        };
        Some((
            limit(range.min.as_ref(), least),
            limit(range.max.as_ref(), most),
        ))
    });
    Parameter {
        path: status.path.clone(),
        value: value(&status.value, *ty),
        doc: status.doc.join("\n"),
        allowed: status.allowed.clone(),
        editable: status.editable || status.restart,
        range,
    }
}

/// A number, which JSON holds as text if it is not finite.
fn float(value: &Value) -> Option<f64> {
    value
        .as_f64()
        .or_else(|| value.as_str().and_then(|text| text.parse().ok()))
}

fn value(value: &Value, ty: Option<(Type, bool)>) -> ParameterValue {
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let Some((ty, is_array)) = ty else {
        return ParameterValue::None;
    };
    let items = value.as_array().filter(|_| is_array);
    let Some(items) = items else {
        return match ty {
            Type::Bool => value.as_bool().map(ParameterValue::Bool),
            Type::Int | Type::Long => value.as_i64().map(ParameterValue::Int),
            Type::Float | Type::Double => float(value).map(ParameterValue::Float),
            Type::String | Type::Duration | Type::Path => text(value).map(ParameterValue::Text),
        }
        .unwrap_or(ParameterValue::None);
    };
    let items = items.iter();
    match ty {
        Type::Bool => ParameterValue::Bools(items.filter_map(Value::as_bool).collect()),
        Type::Int | Type::Long => ParameterValue::Ints(items.filter_map(Value::as_i64).collect()),
        Type::Float | Type::Double => ParameterValue::Floats(items.filter_map(float).collect()),
        Type::String | Type::Duration | Type::Path => {
            ParameterValue::Texts(items.filter_map(text).collect())
        }
    }
}

/// A value as the configuration checker takes it.
pub(crate) fn json(value: &ParameterValue) -> Value {
    let float = |number: f64| match serde_json::Number::from_f64(number) {
        Some(number) => Value::Number(number),
        None if number.is_nan() => json!("nan"),
        None if number > 0.0 => json!("inf"),
        None => json!("-inf"),
    };
    match value {
        ParameterValue::None => Value::Null,
        ParameterValue::Bool(value) => json!(value),
        ParameterValue::Int(value) => json!(value),
        ParameterValue::Float(value) => float(*value),
        ParameterValue::Text(value) => json!(value),
        ParameterValue::Bools(values) => json!(values),
        ParameterValue::Ints(values) => json!(values),
        ParameterValue::Floats(values) => values.iter().copied().map(float).collect(),
        ParameterValue::Texts(values) => json!(values),
    }
}
