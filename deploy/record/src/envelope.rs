//! Messages in a recording: samples, and requests and replies without their envelopes, as services
//! of ROS 2 have them.

use crate::ENCAPSULATION;
use rc_middleware::backend::Profile;
use rc_middleware::rpc::{self, ENVELOPE, ReplyKind, RequestId};
use rc_middleware::{Encoding, Reader, Writer};
use rc_observe::{Answer, Observed, Topic};
use rc_values::{
    Interface, Operation, Value, ValueError, decode_from, decode_image, default, encode,
};

/// Where an image follows the envelope of a reply.
const IMAGE: usize = rc_middleware::in_place::BEHIND_ENVELOPE;

/// A call that was read from its envelope.
#[derive(Debug)]
pub struct Opened<'i> {
    /// The operation.
    pub operation: &'i Operation,
    /// The identity of the call: a reply has that of its request.
    pub id: RequestId,
    /// The bytes for a recording, with their encapsulation.
    pub data: Vec<u8>,
}

/// The bytes of a sample, with their encapsulation. `None` if the sender has other types than the
/// description of the topic, or if the sample cannot be decoded.
pub fn sample(topic: &Topic, observed: &Observed<'_>) -> Option<Vec<u8>> {
    let (theirs, ours) = (observed.header.type_hash, topic.operation.hash);
    match observed.header.encoding {
        Encoding::Cdr if theirs != 0 && theirs != ours => None,
        Encoding::Cdr => Some(encapsulated(observed.body)),
        Encoding::Image => {
            let value = topic.decode(observed).ok()?;
            Some(encapsulated(&rc_values::encode_body(&value).ok()?))
        }
    }
}

/// The bytes of the result of a call, as those of its recorded reply. `None` if the operation does
/// not declare it.
pub fn answered(operation: &Operation, answer: &Answer) -> Option<Vec<u8>> {
    let (case, value) = match answer {
        Answer::Result(value) => (0, value),
        Answer::Exception(value) => {
            let Value::Struct(ty, _) = value else {
                return None;
            };
            let mut throws = operation.throws.iter();
            let exception = throws.find(|exception| exception.ty.name == ty.name)?;
            (exception.id, value)
        }
    };
    let mut writer = begin();
    write_reply(operation, case, value, &mut writer).ok()?;
    Some(end(writer))
}

/// The result of a recorded reply. `None` if it holds an exception, or cannot be decoded.
pub fn result(operation: &Operation, recorded: &[u8]) -> Option<Value> {
    let mut reader = Reader::new(recorded.get(ENCAPSULATION.len()..)?);
    if !operation.throws.is_empty() {
        let code: i32 = reader.get().ok()?;
        for exception in &operation.throws {
            decode_from(&exception.ty, &mut reader).ok()?;
        }
        if code != 0 {
            return None;
        }
    }
    decode_from(&operation.reply, &mut reader).ok()
}

fn encapsulated(body: &[u8]) -> Vec<u8> {
    let mut data = Vec::with_capacity(ENCAPSULATION.len() + body.len());
    data.extend(ENCAPSULATION);
    data.extend(body);
    data
}

fn begin() -> Writer<'static> {
    Writer::default()
}

fn end(writer: Writer<'static>) -> Vec<u8> {
    encapsulated(&writer.into_bytes())
}

/// Opens a request. `None` if its operation is unknown or its body cannot be decoded.
pub fn request<'i>(interface: &'i Interface, profile: Profile, body: &[u8]) -> Option<Opened<'i>> {
    let mut reader = Reader::new(body);
    let (id, number) = rpc::open_request(&mut reader).ok()?;
    let operation = interface.operations.iter().find(|o| o.id == number)?;
    if profile == Profile::Bare {
        return Some(opened(operation, id, body.get(ENVELOPE..)?));
    }
    let value = decode_from(&operation.request, &mut reader).ok()?;
    let mut writer = begin();
    members(&value, &mut writer).ok()?;
    Some(Opened {
        operation,
        id,
        data: end(writer),
    })
}

fn opened<'i>(operation: &'i Operation, id: RequestId, body: &[u8]) -> Opened<'i> {
    Opened {
        operation,
        id,
        data: encapsulated(body),
    }
}

/// A reply that was read from its envelope.
#[derive(Debug)]
pub enum Reply<'i> {
    /// A result or an exception.
    Opened(Opened<'i>),
    /// The server has refused the call, and why.
    Refused(String),
}

/// Opens a reply. `None` if its operation is unknown, or if its body cannot be decoded.
pub fn reply<'i>(
    interface: &'i Interface,
    profile: Profile,
    encoding: Encoding,
    body: &[u8],
) -> Option<Reply<'i>> {
    let mut refused = None;
    let found = interface.operations.iter().find_map(|operation| {
        let mut reader = Reader::new(body);
        match rpc::open_reply(&mut reader, operation.id).ok()? {
            (id, ReplyKind::Case(case)) => Some((operation, id, case, reader)),
            (_, ReplyKind::Refused(reason)) => {
                refused = Some(reason);
                None
            }
            (_, ReplyKind::Unavailable(state)) => {
                refused = Some(rpc::not_served_in(&state));
                None
            }
        }
    });
    if let Some(reason) = refused {
        return Some(Reply::Refused(reason));
    }
    let (operation, id, case, mut reader) = found?;
    if profile == Profile::Bare {
        return Some(Reply::Opened(opened(operation, id, body.get(ENVELOPE..)?)));
    }
    let value = match encoding {
        Encoding::Image => decode_image(&operation.reply, body.get(IMAGE..)?).ok()?,
        Encoding::Cdr => match exception(operation, case) {
            Some((at, _)) => decode_from(&operation.throws[at].ty, &mut reader).ok()?,
            None => decode_from(&operation.reply, &mut reader).ok()?,
        },
    };
    let mut writer = begin();
    write_reply(operation, case, &value, &mut writer).ok()?;
    Some(Reply::Opened(Opened {
        operation,
        id,
        data: end(writer),
    }))
}

fn exception(operation: &Operation, case: i32) -> Option<(usize, i32)> {
    let mut throws = operation.throws.iter().enumerate();
    throws
        .find(|(_, exception)| exception.id == case && case != 0)
        .map(|(at, exception)| (at, exception.id))
}

/// Writes the members of a structure; a byte if it has none, as ROS 2 does.
fn members(value: &Value, writer: &mut Writer<'_>) -> Result<(), ValueError> {
    if matches!(value, Value::Struct(_, values) if values.is_empty()) {
        writer.put(&0_u8);
        return Ok(());
    }
    encode(value, writer)
}

/// Writes code, exceptions and results, as ROS 2 orders them.
fn write_reply(
    operation: &Operation,
    case: i32,
    value: &Value,
    writer: &mut Writer<'_>,
) -> Result<(), ValueError> {
    let thrown = exception(operation, case).map(|(at, _)| at);
    if !operation.throws.is_empty() {
        writer.put(&thrown.map_or(0, |at| at as i32 + 1));
        for (at, exception) in operation.throws.iter().enumerate() {
            if thrown == Some(at) {
                members(value, writer)?;
            } else {
                members(&default(&exception.ty)?, writer)?;
            }
        }
    }
    let empty = operation.reply.members.is_empty();
    match thrown {
        _ if empty && !operation.throws.is_empty() => Ok(()),
        None => members(value, writer),
        Some(_) => members(&default(&operation.reply)?, writer),
    }
}

/// The reply to a request of the network, made of a recorded one.
pub fn answer(
    operation: &Operation,
    profile: Profile,
    id: RequestId,
    recorded: &[u8],
) -> Result<Vec<u8>, ValueError> {
    let body = recorded.get(ENCAPSULATION.len()..).unwrap_or_default();
    let mut reader = Reader::new(body);
    let mut writer = begin();
    if profile == Profile::Bare {
        // The recorded form is that of ROS 2.
        rpc::begin_reply(&mut writer, id, operation.id, 0);
        rpc::begin_body(&mut writer, profile);
        writer.raw(body);
        return Ok(writer.into_bytes());
    }
    let mut thrown = None;
    if !operation.throws.is_empty() {
        let code: i32 = reader.get()?;
        for (at, exception) in operation.throws.iter().enumerate() {
            let value = decode_from(&exception.ty, &mut reader)?;
            if code == at as i32 + 1 {
                thrown = Some((exception.id, value));
            }
        }
    }
    if let Some((case, value)) = thrown {
        rpc::begin_reply(&mut writer, id, operation.id, case);
        members(&value, &mut writer)?;
    } else {
        rpc::begin_reply(&mut writer, id, operation.id, 0);
        let value = decode_from(&operation.reply, &mut reader)?;
        members(&value, &mut writer)?;
    }
    Ok(writer.into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_values::Catalog;
    use rc_values::description::Module;
    use serde_json::json;

    fn interface() -> std::sync::Arc<Interface> {
        let module: Module = serde_json::from_value(json!({
            "module": "Arm",
            "types": [{"name": "Failed", "exception": [{"name": "why", "type": "string"}]}],
            "interfaces": [{"name": "Joint", "operations": [
                {"name": "turn", "id": 7, "hash": "0000000000000001", "pattern": "query",
                 "inputs": [{"name": "to", "type": "float64"}],
                 "outputs": [{"name": "at", "type": "float64"}], "result": "bool", "throws": [["Arm::Failed", 9]]},
                {"name": "stop", "id": 8, "hash": "0000000000000002", "pattern": "query"}
            ]}]
        }))
        .expect("a module");
        let catalog = Catalog::new(&[module]).expect("a catalog");
        catalog
            .interface("Arm::Joint")
            .expect("it is there")
            .clone()
    }

    #[test]
    fn calls_come_back_as_they_were() {
        let interface = interface();
        let id = RequestId {
            writer: [3; 16],
            sequence: 5,
        };
        let mut writer = Writer::default();
        rpc::begin_request(&mut writer, id, 7);
        writer.put(&1.5_f64);
        let asked = request(&interface, Profile::Rpc, &writer.into_bytes()).expect("a request");
        assert_eq!((asked.operation.name.as_str(), asked.id), ("turn", id));
        assert_eq!(asked.data[4..], 1.5_f64.to_le_bytes());

        let replies = [
            (0, json!({"at": 2.5, "return": true})),
            (9, json!({"why": "stuck"})),
        ];
        for (case, value) in replies {
            let operation = &interface.operations[0];
            let ty = if case == 0 {
                &operation.reply
            } else {
                &operation.throws[0].ty
            };
            let value = rc_values::from_json(ty, &value).expect("a value");
            let mut writer = Writer::default();
            rpc::begin_reply(&mut writer, id, 7, case);
            encode(&value, &mut writer).expect("to encode");
            let body = writer.into_bytes();
            let got = reply(&interface, Profile::Rpc, Encoding::Cdr, &body).expect("a reply");
            let Reply::Opened(got) = got else {
                panic!("{got:?}");
            };
            assert_eq!(got.id, id);
            let again = answer(operation, Profile::Rpc, id, &got.data);
            assert_eq!(again.expect("a reply"), body);

            // A client of ROS 2 gets the same bytes after an envelope of its own.
            let of_ros = answer(operation, Profile::Bare, id, &got.data).expect("a reply");
            assert_eq!(of_ros[ENVELOPE..], got.data[ENCAPSULATION.len()..]);
            let back = reply(&interface, Profile::Bare, Encoding::Cdr, &of_ros);
            assert!(matches!(back, Some(Reply::Opened(back)) if back.data == got.data));
        }
    }

    #[test]
    fn what_is_no_call_is_left_out() {
        let interface = interface();
        assert!(request(&interface, Profile::Rpc, &[1, 2, 3]).is_none());
        let mut writer = Writer::default();
        rpc::begin_request(&mut writer, RequestId::default(), 99);
        assert!(request(&interface, Profile::Rpc, &writer.into_bytes()).is_none());
        assert!(reply(&interface, Profile::Rpc, Encoding::Cdr, &[0; 40]).is_none());
        let mut writer = Writer::default();
        rpc::refuse_in(&mut writer, RequestId::default(), "idle");
        let refusal = writer.into_bytes();
        let refused = reply(&interface, Profile::Rpc, Encoding::Cdr, &refusal);
        assert!(matches!(refused, Some(Reply::Refused(why)) if why.contains("`idle`")));
    }
}
