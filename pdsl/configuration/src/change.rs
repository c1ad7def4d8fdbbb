//! A changed parameter.

use crate::model::Value;
use crate::values::SECRET;
use rc_vocabulary::ParameterChange;
use serde_json::Value as Json;
use std::fmt;

/// A changed parameter. `Display` and `Debug` do not show secret values.
#[derive(Clone, PartialEq)]
pub struct ParamChange {
    /// The path, `motors[2].max`.
    pub path: String,
    /// The value before.
    pub old: Value,
    /// The value after.
    pub new: Value,
    /// Whether the values are never shown.
    pub secret: bool,
}

impl ParamChange {
    /// The change that restores the old value.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let mut back = self.clone();
        std::mem::swap(&mut back.old, &mut back.new);
        back
    }

    /// The change as tools get it, with `***` for secret values.
    pub fn shown(&self) -> ParameterChange {
        ParameterChange {
            path: self.path.clone(),
            old: shown(&self.old, self.secret),
            new: shown(&self.new, self.secret),
        }
    }
}

impl fmt::Display for ParamChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = |value: &Value| {
            if self.secret {
                SECRET.to_owned()
            } else {
                value.to_toml()
            }
        };
        write!(
            f,
            "{}: {} -> {}",
            self.path,
            text(&self.old),
            text(&self.new)
        )
    }
}

impl fmt::Debug for ParamChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ParamChange({self})")
    }
}

/// A value as tools get it.
pub(crate) fn shown(value: &Value, secret: bool) -> Json {
    if secret {
        Json::from(SECRET)
    } else {
        value.to_json()
    }
}
