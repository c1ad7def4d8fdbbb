//! What a component says to its supervisor: JSON-RPC 2.0 notifications on its standard input's socket, one a line.

use crate::status::State;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::time::Duration;

/// How old the last turn of a component's loop, or the last heartbeat, may be.
pub(crate) const HEARTBEAT_LIMIT: Duration = Duration::from_secs(2);

/// One notification.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Message {
    /// The life cycle went on.
    State(State),
    /// The component has started.
    Ready,
    /// The component is there.
    Heartbeat {
        /// How long ago its loop turned last.
        age: Duration,
        /// How many values its slots have lost; those that lost none may be left out.
        lost: BTreeMap<String, u64>,
    },
}

#[derive(Deserialize)]
struct Notification {
    method: String,
    #[serde(default)]
    params: Params,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Params {
    state: Option<State>,
    age_ms: Option<u64>,
    lost: BTreeMap<String, u64>,
}

/// Reads one line; the error says what is wrong with it.
pub(crate) fn parse(line: &str) -> Result<Message, String> {
    let notification: Notification =
        serde_json::from_str(line).map_err(|error| format!("no notification: {error}"))?;
    let params = notification.params;
    match notification.method.as_str() {
        "ready" => Ok(Message::Ready),
        "heartbeat" => match params.age_ms {
            Some(age) => Ok(Message::Heartbeat {
                age: Duration::from_millis(age),
                lost: params.lost,
            }),
            None => Err("a heartbeat without age_ms".to_owned()),
        },
        "state" => match params.state {
            Some(
                state @ (State::Starting | State::Running | State::Emergency | State::Stopping),
            ) => Ok(Message::State(state)),
            _ => Err("a state that a component cannot be in".to_owned()),
        },
        other => Err(format!("unknown method {other}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notifications_are_read() {
        let state = r#"{"jsonrpc":"2.0","method":"state","params":{"state":"emergency"}}"#;
        assert_eq!(parse(state), Ok(Message::State(State::Emergency)));
        let ready = r#"{"jsonrpc":"2.0","method":"ready","params":{}}"#;
        assert_eq!(parse(ready), Ok(Message::Ready));
        let age = Duration::from_millis(7);
        let lost = BTreeMap::new();
        let beat = r#"{"jsonrpc":"2.0","method":"heartbeat","params":{"age_ms":7}}"#;
        assert_eq!(parse(beat), Ok(Message::Heartbeat { age, lost }));
        let lost = BTreeMap::from([("Laser".to_owned(), 3)]);
        let beat = r#"{"method":"heartbeat","params":{"age_ms":7,"lost":{"Laser":3}}}"#;
        assert_eq!(parse(beat), Ok(Message::Heartbeat { age, lost }));
    }

    #[test]
    fn garbage_is_named() {
        for garbage in [
            "",
            "hello",
            "[]",
            r#"{"method":"dance"}"#,
            r#"{"method":"heartbeat"}"#,
            r#"{"method":"heartbeat","params":{"age_ms":7,"lost":{"Laser":-3}}}"#,
            r#"{"method":"state","params":{"state":"failed"}}"#,
            r#"{"method":"state","params":{"state":"happy"}}"#,
        ] {
            assert!(parse(garbage).is_err(), "{garbage}");
        }
    }
}
