//! Values of parameters in CDR, in the order of the `.pdsl`, as the generated structures read them.

use rc_configuration::model::{Kind, Parameter, Type};
use rc_configuration::{Field, Parameters};
use rc_middleware::Writer;
use rc_runtime::{ParamChange, Value, Values};

/// All values. `schema` is that of the description.
pub(crate) fn encode(schema: Option<&Parameters>, values: &Values) -> Vec<u8> {
    let mut writer = Writer::default();
    if let Some(schema) = schema {
        group(&schema.parameters, values, &mut writer);
    }
    writer.into_bytes()
}

fn group(parameters: &[Parameter], values: &Values, writer: &mut Writer<'_>) {
    if parameters.is_empty() {
        // An empty structure holds one octet.
        writer.put(&0_u8);
    }
    for parameter in parameters {
        let mut fields = values.fields();
        let field = fields.find(|(name, _)| *name == parameter.name);
        match (&parameter.kind, field.map(|(_, field)| field)) {
            (Kind::Scalar { ty, array: None }, Some(Field::Value(value))) => {
                scalar(*ty, value, writer);
            }
            (Kind::Scalar { ty, .. }, Some(Field::Value(Value::Array(items)))) => {
                writer.length(items.len());
                for item in items {
                    scalar(*ty, item, writer);
                }
            }
            (Kind::Group(parameters), Some(Field::Group(values))) => {
                group(parameters, values, writer);
            }
            (Kind::List { parameters, .. }, Some(Field::List(list))) => {
                writer.length(list.len());
                for values in list {
                    group(parameters, values, writer);
                }
            }
            // The checker of configurations has refused everything else.
            _ => {}
        }
    }
}

fn scalar(ty: Type, value: &Value, writer: &mut Writer<'_>) {
    match (ty, value) {
        (Type::Int, Value::Int(value)) => {
            writer.put(&i32::try_from(*value).unwrap_or(if *value < 0 {
                i32::MIN
            } else {
                i32::MAX
            }));
        }
        (Type::Float, Value::Float(value)) => writer.put(&(*value as f32)),
        (_, Value::Bool(value)) => writer.put(value),
        (_, Value::Int(value)) => writer.put(value),
        (_, Value::Float(value)) => writer.put(value),
        (_, Value::Text(value)) => writer.put(value),
        (_, Value::Duration(value)) => {
            writer.put(&i64::try_from(*value).unwrap_or(i64::MAX));
        }
        (_, Value::Array(_)) => {}
    }
}

/// Changes: path, old value, new value, and whether they are secret. Values are texts of TOML.
pub(crate) fn changes(changes: &[ParamChange]) -> Vec<u8> {
    let mut writer = Writer::default();
    writer.length(changes.len());
    for change in changes {
        writer.put(&change.path);
        writer.put(&change.old.to_toml());
        writer.put(&change.new.to_toml());
        writer.put(&change.secret);
    }
    writer.into_bytes()
}
