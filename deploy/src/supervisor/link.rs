//! What a component says to its supervisor: JSON-RPC 2.0 notifications on its standard input's socket, one a line.

use crate::client::status::State;
use serde::Deserialize;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::time::Duration;

/// How old the last turn of a component's loop, or the last heartbeat, may be.
pub(crate) const HEARTBEAT_LIMIT: Duration = Duration::from_secs(2);

/// One notification.
#[derive(Debug, PartialEq)]
pub(crate) enum Message {
    /// The life cycle went on.
    State(State),
    /// The component has started.
    Ready,
    /// Which parameters were changed and are in no file.
    Parameters {
        /// Their values, by path.
        changed: Map<String, Value>,
        /// The paths of those whose values are not told: they are secret, or too long.
        unkept: Vec<String>,
    },
    /// What an earlier run had changed was set again, or why not.
    Restored(Result<(), String>),
    /// The component is there, and how it is.
    Heartbeat(Beat),
}

/// How a component is. What it has not noticed may be left out.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Beat {
    /// How long ago its loop turned last.
    pub(crate) age: Duration,
    /// How many values its slots have lost, in all.
    pub(crate) lost: BTreeMap<String, u64>,
    /// How many ends there are at the other side of those slots that need one.
    pub(crate) peers: BTreeMap<String, usize>,
    /// What took longer than the period since the last heartbeat.
    pub(crate) overruns: Option<Overruns>,
    /// Topics that were silent for longer than their deadline since then, and for how many milliseconds.
    pub(crate) silent: BTreeMap<String, u64>,
    /// Ends that were found since then and do not fit.
    pub(crate) mismatches: Vec<String>,
}

/// The longest of the times that were longer than the period.
#[derive(Debug, PartialEq, Deserialize)]
pub(crate) struct Overruns {
    /// `compute()`, a handler.
    pub(crate) what: String,
    pub(crate) ms: f64,
    pub(crate) period_ms: f64,
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
    changed: Map<String, Value>,
    unkept: Vec<String>,
    refused: Option<String>,
    peers: BTreeMap<String, usize>,
    overruns: Option<Overruns>,
    silent: BTreeMap<String, u64>,
    mismatches: Vec<String>,
}

/// Reads one line; the error says what is wrong with it.
pub(crate) fn parse(line: &str) -> Result<Message, String> {
    let notification: Notification =
        serde_json::from_str(line).map_err(|error| format!("no notification: {error}"))?;
    let params = notification.params;
    match notification.method.as_str() {
        "ready" => Ok(Message::Ready),
        "parameters" => Ok(Message::Parameters {
            changed: params.changed,
            unkept: params.unkept,
        }),
        "restored" => Ok(Message::Restored(params.refused.map_or(Ok(()), Err))),
        "heartbeat" => match params.age_ms {
            Some(age) => Ok(Message::Heartbeat(Beat {
                age: Duration::from_millis(age),
                lost: params.lost,
                peers: params.peers,
                overruns: params.overruns,
                silent: params.silent,
                mismatches: params.mismatches,
            })),
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
        let expected = Beat {
            age,
            ..Beat::default()
        };
        let beat = r#"{"jsonrpc":"2.0","method":"heartbeat","params":{"age_ms":7}}"#;
        assert_eq!(parse(beat), Ok(Message::Heartbeat(expected)));
        let beat = r#"{"method":"heartbeat","params":{"age_ms":7,"lost":{"Laser":3},"peers":{"Laser":1},
            "overruns":{"count":3,"what":"compute()","ms":7.5,"period_ms":5},"silent":{"Pose":80},"mismatches":["no"]}}"#;
        let laser = "Laser".to_owned();
        let expected = Beat {
            age,
            lost: BTreeMap::from([(laser.clone(), 3)]),
            peers: BTreeMap::from([(laser, 1)]),
            overruns: Some(Overruns {
                what: "compute()".to_owned(),
                ms: 7.5,
                period_ms: 5.0,
            }),
            silent: BTreeMap::from([("Pose".to_owned(), 80)]),
            mismatches: vec!["no".to_owned()],
        };
        assert_eq!(parse(beat), Ok(Message::Heartbeat(expected)));
    }

    #[test]
    fn what_is_unsaved_is_told() {
        let line =
            r#"{"method":"parameters","params":{"changed":{"a[1].b":[1,"x"]},"unkept":["c"]}}"#;
        let changed = Map::from_iter([("a[1].b".to_owned(), serde_json::json!([1, "x"]))]);
        let unkept = vec!["c".to_owned()];
        assert_eq!(parse(line), Ok(Message::Parameters { changed, unkept }));
        let restored = r#"{"method":"restored","params":{}}"#;
        assert_eq!(parse(restored), Ok(Message::Restored(Ok(()))));
        let refused = r#"{"method":"restored","params":{"refused":"no"}}"#;
        assert_eq!(parse(refused), Ok(Message::Restored(Err("no".to_owned()))));
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
