//! JSON-RPC 2.0, one object a line.
//!
//! The messages of one direction are an enum. The name of a variant in snake case is the method;
//! its fields are the parameters. A variant without fields has the parameters `{}` and accepts any.

use crate::lines;
use rc_diagnostics::foreign::clean;
use rc_vocabulary::foreign;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::fmt;

const VERSION: &str = "2.0";

/// Why a request failed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[error("{message}")]
pub struct Error {
    /// One of the constants of this type.
    pub code: i64,
    /// Which diagnostics led to the error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub data: Option<ErrorData>,
    /// The reason, for people.
    #[serde(deserialize_with = "foreign::lines")]
    pub message: String,
}

/// The details of an [`Error`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorData {
    /// The diagnostics of the configuration checker.
    #[serde(default)]
    pub findings: Vec<Finding>,
}

/// One diagnostic of the configuration checker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Code, in kebab case.
    #[serde(deserialize_with = "foreign::text")]
    pub code: String,
    /// How to fix it.
    #[serde(default)]
    #[serde(deserialize_with = "foreign::optional")]
    pub help: Option<String>,
    /// Reason, for a person to read.
    #[serde(deserialize_with = "foreign::text")]
    pub message: String,
}

impl Error {
    /// The line is not JSON.
    pub const PARSE: i64 = -32700;
    /// There is no such method.
    pub const UNKNOWN_METHOD: i64 = -32601;
    /// The parameters are malformed, or the configuration checker refuses them.
    pub const INVALID_PARAMS: i64 = -32602;
    /// The worker refuses a change of parameters.
    pub const WORKER_REFUSES: i64 = -32001;
    /// The worker does not decide in time.
    pub const WORKER_TIMEOUT: i64 = -32002;
    /// The configuration file cannot be updated as it is.
    pub const FILE: i64 = -32003;
    /// The system refuses.
    pub const SYSTEM: i64 = -32004;
    /// A rule of the network reads one of the parameters: only the supervisor changes it.
    pub const RULED: i64 = -32005;

    /// An error without details.
    pub fn new(code: i64, message: impl Into<String>) -> Self {
        Self {
            code,
            data: None,
            message: message.into(),
        }
    }

    /// Whether the requested change itself is at fault, rather than the component or the system.
    pub fn is_input(&self) -> bool {
        matches!(
            self.code,
            Self::INVALID_PARAMS | Self::WORKER_REFUSES | Self::FILE
        )
    }

    /// The reason for people; each finding begins on a line of its own.
    pub fn reason(&self) -> String {
        let findings = self.data.iter().flat_map(|data| &data.findings);
        let lines: Vec<String> = findings.map(ToString::to_string).collect();
        if lines.is_empty() {
            return self.message.clone();
        }
        format!("\n  {}", lines.join("\n  "))
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error[{}]: {}", self.code, self.message)?;
        match &self.help {
            Some(help) => write!(f, " ({help})"),
            None => Ok(()),
        }
    }
}

/// A request or notification, as received.
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    /// Identifies the request; a notification has none and gets no answer.
    pub id: Option<Value>,
    /// The method; empty if the object has none.
    pub method: String,
    /// The parameters; null if the object has none.
    pub params: Value,
}

impl Call {
    /// Reads one line.
    pub fn parse(line: &[u8]) -> Result<Self, Error> {
        let mut message: Value = serde_json::from_slice(line)
            .map_err(|_| Error::new(Error::PARSE, "this is not JSON"))?;
        Ok(Self {
            id: message.get("id").cloned(),
            method: clean(message["method"].as_str().unwrap_or_default()),
            params: message
                .get_mut("params")
                .map(Value::take)
                .unwrap_or_default(),
        })
    }

    /// Decodes the request. `methods` pairs each method with a text of its parameters, for error
    /// messages; `is_valid` checks what the types do not express.
    pub(crate) fn decode<T: DeserializeOwned>(
        self,
        methods: &[(&str, &str)],
        is_valid: impl FnOnce(&T) -> bool,
    ) -> Result<T, Error> {
        let Self { method, params, .. } = self;
        let Some((_, usage)) = methods.iter().find(|(name, _)| *name == method) else {
            let names: Vec<String> = methods
                .iter()
                .map(|(name, _)| format!("`{name}`"))
                .collect();
            let text = format!("unknown method `{method}`; there are {}", names.join(", "));
            return Err(Error::new(Error::UNKNOWN_METHOD, text));
        };
        message(&method, params)
            .ok()
            .filter(is_valid)
            .ok_or_else(|| Error::new(Error::INVALID_PARAMS, format!("`{method}` takes {usage}")))
    }
}

/// Decodes the message of `method` and `params`.
pub fn message<T: DeserializeOwned>(method: &str, params: Value) -> Result<T, serde_json::Error> {
    // A variant without fields is a text to serde, one with fields is a map of one entry.
    if let Ok(message) = T::deserialize(Value::from(method)) {
        return Ok(message);
    }
    let params = if params.is_null() {
        Value::Object(Map::new())
    } else {
        params
    };
    T::deserialize(Value::Object(Map::from_iter([(method.to_owned(), params)])))
}

/// The method and the parameters of a message.
fn parts(message: &impl Serialize) -> (String, Value) {
    match serde_json::to_value(message) {
        Ok(Value::Object(entries)) => entries.into_iter().next().unwrap_or_default(),
        Ok(Value::String(method)) => (method, Value::Object(Map::new())),
        // Messages are enums, which serialise to one of the above.
        _ => Default::default(),
    }
}

// Fields are in alphabetical order, as they are within results and parameters.

#[derive(Serialize)]
struct Request<'m> {
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<u64>,
    jsonrpc: &'m str,
    method: &'m str,
    params: &'m Value,
}

#[derive(Serialize)]
struct Answer<'m> {
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<Error>,
    id: &'m Value,
    jsonrpc: &'m str,
    #[serde(skip_serializing_if = "Option::is_none")]
    result: Option<Value>,
}

/// The line of a request with this identifier.
///
/// ```
/// use rc_management::{component, rpc};
///
/// let line = rpc::request(1, &component::Request::Emergency { active: true });
/// assert_eq!(
///     line,
///     b"{\"id\":1,\"jsonrpc\":\"2.0\",\"method\":\"emergency\",\"params\":{\"active\":true}}\n"
/// );
/// ```
pub fn request(id: u64, message: &impl Serialize) -> Vec<u8> {
    line(Some(id), message)
}

/// The line of a notification.
pub fn notification(message: &impl Serialize) -> Vec<u8> {
    line(None, message)
}

fn line(id: Option<u64>, message: &impl Serialize) -> Vec<u8> {
    let (method, params) = parts(message);
    lines::encode(&Request {
        id,
        jsonrpc: VERSION,
        method: &method,
        params: &params,
    })
}

/// A result in the form of an answer.
pub fn result(result: &impl Serialize) -> Result<Value, Error> {
    serde_json::to_value(result).map_err(|error| Error::new(Error::SYSTEM, error.to_string()))
}

/// The line of an answer to the request with this identifier.
pub fn answer(id: &Value, result: Result<Value, Error>) -> Vec<u8> {
    let (result, error) = match result {
        Ok(result) => (Some(result), None),
        Err(error) => (None, Some(error)),
    };
    lines::encode(&Answer {
        error,
        id,
        jsonrpc: VERSION,
        result,
    })
}
