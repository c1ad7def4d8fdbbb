//! A message of the network, as its channels show it.

use crate::offers::{Channel, Form, Reading};
use crate::shapes::{Context, shown};
use rc_middleware::Encoding;
use rc_observe::{MessageKind, Observed};
use rc_record::definition;
use rc_record::envelope::{self, Reply};
use rc_values::{Interface, Value, decode};
use std::sync::Arc;

/// The frame of poses.
const WORLD: &str = "world";

/// The system's time of sending, in nanoseconds. `sent` has it on the monotonic clock of this
/// machine, which is `monotonic` at the time `system`; 0 if the sender does not say.
pub(crate) fn time_of_sending(sent: u64, monotonic: u64, system: u64) -> u64 {
    match monotonic.checked_sub(sent) {
        Some(age) if sent != 0 => system.saturating_sub(age),
        _ => system,
    }
}

/// A message without its envelope. It is decoded when a client wants to see its shape.
pub(crate) enum Opened<'m> {
    Sample {
        data: Vec<u8>,
        ty: &'m Arc<rc_values::Struct>,
        value: Option<Value>,
    },
    Request(i32, Vec<u8>),
    Reply {
        operation: &'m rc_values::Operation,
        data: Vec<u8>,
        value: Option<Value>,
    },
    /// The server has refused the call.
    Refused,
}

impl<'m> Opened<'m> {
    /// `None` if the description does not fit.
    pub(crate) fn new(reading: &'m Reading, observed: &Observed<'_>) -> Option<Self> {
        match reading {
            Reading::Topic(topic) => Some(Self::Sample {
                data: envelope::sample(topic, observed)?,
                ty: &topic.operation.request,
                value: None,
            }),
            Reading::Calls { interface, .. } => Self::call(interface, observed),
        }
    }

    fn call(interface: &'m Interface, observed: &Observed<'_>) -> Option<Self> {
        let (profile, body) = (observed.profile, observed.body);
        match observed.kind {
            MessageKind::Request => {
                let opened = envelope::request(interface, profile, body)?;
                Some(Self::Request(opened.operation.id, opened.data))
            }
            MessageKind::Reply => {
                let encoding = observed.header.encoding;
                Some(match envelope::reply(interface, profile, encoding, body)? {
                    Reply::Opened(opened) => Self::Reply {
                        operation: opened.operation,
                        data: opened.data,
                        value: None,
                    },
                    Reply::Refused(_) => Self::Refused,
                })
            }
            MessageKind::Sample => None,
        }
    }

    /// The form that a channel shows of it. `time` is when it was sent, in nanoseconds.
    pub(crate) fn data(&mut self, channel: &Channel, time: u64) -> Option<Vec<u8>> {
        let frame = &channel.frame;
        let context = Context {
            time,
            frame,
            world: WORLD,
        };
        match (self, &channel.form) {
            (Self::Sample { data, .. }, Form::Sample) => Some(data.clone()),
            (Self::Sample { data, ty, value }, Form::Shape(shape, at)) => {
                if value.is_none() {
                    let body = definition::body(data).ok()?;
                    *value = decode(ty, Encoding::Cdr, body).ok();
                }
                shape.encode(shown(value.as_ref()?, *at)?, &context)
            }
            (Self::Request(id, data), Form::Request(of)) if id == of => Some(data.clone()),
            (
                Self::Reply {
                    operation, data, ..
                },
                Form::Reply(of),
            ) if operation.id == *of => Some(data.clone()),
            (
                Self::Reply {
                    operation,
                    data,
                    value,
                },
                Form::ShapeOfResult(of, shape, at),
            ) if operation.id == *of => {
                if value.is_none() {
                    *value = envelope::result(operation, data);
                }
                shape.encode(shown(value.as_ref()?, *at)?, &context)
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_that_waited_keep_the_time_of_their_sending() {
        assert_eq!(time_of_sending(700, 1_000, 50_000), 49_700);
        // Unknown, or by another clock.
        assert_eq!(time_of_sending(0, 1_000, 50_000), 50_000);
        assert_eq!(time_of_sending(1_001, 1_000, 50_000), 50_000);
    }
}
