//! Calls an operation of a component, over its management socket. So it works over every middleware
//! and on every machine, and takes no client's place.

use crate::error::Error;
use crate::network::{Operation, connect, failed};
use rc_management::CallError;
use rc_management::component::Request;
use rc_management::observation::Called;
use rc_management::rpc::Error as Refusal;
use rc_middleware::rpc::{self, ReplyKind, RequestId};
use rc_middleware::{Reader, Writer};
use rc_values::{Value, decode_from, encode};
use std::time::Duration;

/// The margin beyond the time of the call, for the reply of the component.
const MARGIN: Duration = Duration::from_secs(2);

/// Reply of an operation.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// The output parameters and the returned value. Empty for a command.
    Result(Value),
    /// An exception that the operation declares.
    Exception(Value),
}

/// Calls an operation with these parameters.
pub fn call(
    network: &str,
    operation: &Operation,
    parameters: &Value,
    limit: Duration,
) -> Result<Answer, Error> {
    let component = &operation.server.component;
    let id = RequestId {
        writer: [0; 16],
        sequence: 1,
    };
    let of = &operation.operation;
    let mut writer = Writer::default();
    rpc::begin_request(&mut writer, id, of.id);
    encode(parameters, &mut writer)?;
    let body = writer.into_bytes();
    let timeout_ms = u64::try_from(limit.as_millis()).unwrap_or(u64::MAX);
    let request = Request::Call {
        slot: operation.server.slot.clone(),
        body,
        timeout_ms: timeout_ms.clamp(1, 600_000),
    };
    let mut client = connect(network, component, MARGIN)?;
    let called: Called = client
        .call(&request, limit.saturating_add(MARGIN))
        .map_err(|error| match error {
            CallError::Refused(refusal) if refusal.code == Refusal::WORKER_REFUSES => {
                Error::Refused {
                    operation: operation.name(),
                    reason: refusal.message,
                }
            }
            CallError::Refused(refusal) if refusal.code == Refusal::WORKER_TIMEOUT => {
                Error::Deadline {
                    operation: operation.name(),
                    reason: refusal.message,
                }
            }
            CallError::Closed => Error::ServerDied {
                component: component.clone(),
            },
            error @ (CallError::Io(_)
            | CallError::TimedOut(_)
            | CallError::Refused(_)
            | CallError::Unexpected(_)) => failed(component, &error),
        })?;
    if called.body.is_empty() {
        return Ok(Answer::Result(rc_values::Value::Struct(
            of.reply.clone(),
            Vec::new(),
        )));
    }
    let mut reader = Reader::new(&called.body);
    let (_, kind) = rpc::open_reply(&mut reader, of.id).map_err(rc_values::ValueError::from)?;
    match kind {
        ReplyKind::Case(0) => Ok(Answer::Result(decode_from(&of.reply, &mut reader)?)),
        ReplyKind::Case(case) => {
            let exception = of.throws.iter().find(|exception| exception.id == case);
            let Some(exception) = exception else {
                let reason = format!(
                    "it threw an exception with the number {case}, which the operation does not declare"
                );
                return Err(Error::Component {
                    component: component.clone(),
                    reason,
                });
            };
            Ok(Answer::Exception(decode_from(&exception.ty, &mut reader)?))
        }
        ReplyKind::Refused(reason) => Err(Error::Refused {
            operation: operation.name(),
            reason,
        }),
        ReplyKind::Unavailable(state) => Err(Error::Unavailable {
            operation: operation.name(),
            state,
        }),
    }
}
