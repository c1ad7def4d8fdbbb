//! The messages of Foxglove's protocol over a WebSocket (`foxglove.sdk.v1`), as
//! <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md> describes them.

use rc_record::Schema;
use serde::Deserialize;
use serde_json::{Value as Json, json};

/// The supported versions. Their messages are equal.
pub(crate) const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// The encoding of messages and calls.
pub(crate) const ENCODING: &str = "cdr";

/// The code of a message, and of the reply to a call.
const MESSAGE: u8 = 1;
const TIME: u8 = 2;
const REPLY: u8 = 3;
/// The code of a call, from a client.
const CALL: u8 = 2;

/// Request of a client in text.
#[derive(Debug, PartialEq, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub(crate) enum Request {
    /// Wants the messages of channels.
    Subscribe { subscriptions: Vec<Subscription> },
    /// Wants them no longer.
    Unsubscribe { subscription_ids: Vec<u32> },
    /// Wants the values of parameters; without names, of all.
    GetParameters {
        parameter_names: Vec<String>,
        id: Option<String>,
    },
    /// Changes parameters.
    SetParameters {
        parameters: Vec<Parameter>,
        id: Option<String>,
    },
    /// Wants to know when parameters change; without names, all.
    SubscribeParameterUpdates { parameter_names: Vec<String> },
    /// Wants it no longer.
    UnsubscribeParameterUpdates { parameter_names: Vec<String> },
    /// Wants to know who publishes, subscribes and serves.
    SubscribeConnectionGraph,
    /// Wants it no longer.
    UnsubscribeConnectionGraph,
}

/// A client's name for a channel.
#[derive(Debug, PartialEq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Subscription {
    pub(crate) id: u32,
    pub(crate) channel_id: u64,
}

/// The value of a parameter. Without a value, the client wants to remove it.
#[derive(Debug, PartialEq, Deserialize)]
pub(crate) struct Parameter {
    pub(crate) name: String,
    pub(crate) value: Option<Json>,
}

/// A call of a service.
#[derive(Debug, PartialEq)]
pub(crate) struct Call<'m> {
    pub(crate) service: u32,
    pub(crate) number: u32,
    pub(crate) encoding: &'m [u8],
    pub(crate) body: &'m [u8],
}

impl<'m> Call<'m> {
    /// Reads a binary message. `None` if it is not a call, or shorter than it says.
    pub(crate) fn read(message: &'m [u8]) -> Option<Self> {
        let (&code, rest) = message.split_first()?;
        let (service, rest) = number(rest)?;
        let (call, rest) = number(rest)?;
        let (length, rest) = number(rest)?;
        let (encoding, body) = rest.split_at_checked(usize::try_from(length).ok()?)?;
        (code == CALL).then_some(Self {
            service,
            number: call,
            encoding,
            body,
        })
    }
}

fn number(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let (number, rest) = bytes.split_first_chunk()?;
    Some((u32::from_le_bytes(*number), rest))
}

/// A message of a channel, at a time in nanoseconds.
pub(crate) fn message(subscription: u32, time: u64, data: &[u8]) -> Vec<u8> {
    let mut message = Vec::with_capacity(13 + data.len());
    message.push(MESSAGE);
    message.extend(subscription.to_le_bytes());
    message.extend(time.to_le_bytes());
    message.extend(data);
    message
}

/// The time of the network, in nanoseconds.
pub(crate) fn time(time: u64) -> Vec<u8> {
    let mut message = vec![TIME];
    message.extend(time.to_le_bytes());
    message
}

/// The reply to a call.
pub(crate) fn reply(service: u32, call: u32, body: &[u8]) -> Vec<u8> {
    let mut message = Vec::with_capacity(16 + body.len());
    message.push(REPLY);
    message.extend(service.to_le_bytes());
    message.extend(call.to_le_bytes());
    message.extend((ENCODING.len() as u32).to_le_bytes());
    message.extend(ENCODING.as_bytes());
    message.extend(body);
    message
}

/// A call that failed, and why.
pub(crate) fn failure(service: u32, call: u32, reason: &str) -> Json {
    json!({"op": "serviceCallFailure", "serviceId": service, "callId": call, "message": reason})
}

/// Name and capabilities of this server.
pub(crate) fn server_info(network: &str, session: u64, capabilities: &[&str]) -> Json {
    json!({
        "op": "serverInfo",
        "name": network,
        "capabilities": capabilities,
        "supportedEncodings": [ENCODING],
        "sessionId": session.to_string(),
    })
}

/// A channel of an advertisement.
pub(crate) fn channel(id: u64, topic: &str, schema: &Schema) -> Json {
    json!({
        "id": id,
        "topic": topic,
        "encoding": ENCODING,
        "schemaName": schema.name,
        "schemaEncoding": schema.encoding,
        "schema": String::from_utf8_lossy(&schema.text),
    })
}

/// A service of an advertisement.
pub(crate) fn service(id: u32, name: &str, ty: &str, request: &Schema, reply: &Schema) -> Json {
    let side = |schema: &Schema| {
        json!({
            "encoding": ENCODING,
            "schemaName": schema.name,
            "schemaEncoding": schema.encoding,
            "schema": String::from_utf8_lossy(&schema.text),
        })
    };
    json!({
        "id": id, "name": name, "type": ty, "request": side(request), "response": side(reply),
    })
}

/// The value of a parameter. Whole numbers of a float type are marked, since JSON does not tell
/// them from integers.
pub(crate) fn parameter(name: &str, value: &Json) -> Json {
    let is_float = |value: &Json| value.is_f64();
    let mut parameter = json!({"name": name, "value": value});
    match value {
        Json::Number(_) if is_float(value) => parameter["type"] = json!("float64"),
        Json::Array(all) if !all.is_empty() && all.iter().all(is_float) => {
            parameter["type"] = json!("float64_array");
        }
        _ => {}
    }
    parameter
}

/// The severity of a status.
#[derive(Clone, Copy)]
pub(crate) enum Level {
    Warning = 1,
    Error = 2,
}

/// A text for the user of a client. A later one with the same id replaces it.
pub(crate) fn status(level: Level, message: &str, id: Option<&str>) -> Json {
    let mut status = json!({"op": "status", "level": level as u8, "message": message});
    if let Some(id) = id {
        status["id"] = json!(id);
    }
    status
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_read() {
        let read = |text: &str| serde_json::from_str::<Request>(text).ok();
        let subscriptions = vec![Subscription {
            id: 7,
            channel_id: 9,
        }];
        assert_eq!(
            read(r#"{"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 9}]}"#),
            Some(Request::Subscribe { subscriptions })
        );
        assert_eq!(
            read(
                r#"{"op": "setParameters", "parameters": [{"name": "a.b", "value": 1}, {"name": "c"}]}"#
            ),
            Some(Request::SetParameters {
                parameters: vec![
                    Parameter {
                        name: "a.b".to_owned(),
                        value: Some(json!(1))
                    },
                    Parameter {
                        name: "c".to_owned(),
                        value: None
                    },
                ],
                id: None,
            })
        );
        assert_eq!(
            read(r#"{"op": "subscribeConnectionGraph"}"#),
            Some(Request::SubscribeConnectionGraph)
        );
        assert_eq!(read(r#"{"op": "advertise", "channels": []}"#), None);
        assert_eq!(
            read(r#"{"op": "subscribe", "subscriptions": [{"id": -1}]}"#),
            None
        );
    }

    #[test]
    fn calls_are_read_and_cut_ones_are_none() {
        let mut bytes = vec![CALL];
        for number in [3_u32, 4, 3] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(b"cdr\x00\x01\x00\x00!");
        let call = Call::read(&bytes).expect("a call");
        assert_eq!(
            (call.service, call.number, call.encoding),
            (3, 4, &b"cdr"[..])
        );
        assert_eq!(call.body, [0, 1, 0, 0, b'!']);
        // A reply has the same form after its code.
        let back = reply(3, 4, call.body);
        assert_eq!((back[0], &back[1..]), (REPLY, &bytes[1..]));
        for length in 0..16 {
            assert_eq!(Call::read(&bytes[..length]), None, "{length}");
        }
        bytes[0] = 1;
        assert_eq!(Call::read(&bytes), None);
    }
}
