//! The quality of service of an endpoint as JSON, as components describe themselves to tools.
//!
//! Durations are milliseconds, and left out where there is no limit. The timeout of calls and
//! polling concern the component alone, so they are not part of it.

use super::{Durability, Qos, Reliability};
use crate::duration;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::time::Duration;

#[derive(Deserialize, Serialize)]
struct Form {
    reliable: bool,
    transient_local: bool,
    depth: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    deadline_ms: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    lifespan_ms: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    liveliness_ms: Option<f64>,
}

impl Serialize for Qos {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let Self {
            reliability,
            durability,
            depth,
            deadline,
            lifespan,
            liveliness,
            timeout: _,
            spin: _,
        } = *self;
        let ms = |time: Option<Duration>| time.map(|time| time.as_secs_f64() * 1e3);
        let form = Form {
            reliable: reliability == Reliability::Reliable,
            transient_local: durability == Durability::TransientLocal,
            depth,
            deadline_ms: ms(deadline),
            lifespan_ms: ms(lifespan),
            liveliness_ms: ms(liveliness),
        };
        form.serialize(to)
    }
}

impl<'de> Deserialize<'de> for Qos {
    /// A duration that is none, from another program, is no limit.
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let form = Form::deserialize(from)?;
        let time = |ms: Option<f64>| {
            let nanoseconds = ms.and_then(duration::from_fractional_milliseconds);
            nanoseconds.map(Duration::from_nanos)
        };
        Ok(Self {
            reliability: if form.reliable {
                Reliability::Reliable
            } else {
                Reliability::BestEffort
            },
            durability: if form.transient_local {
                Durability::TransientLocal
            } else {
                Durability::Volatile
            },
            depth: form.depth,
            deadline: time(form.deadline_ms),
            lifespan: time(form.lifespan_ms),
            liveliness: time(form.liveliness_ms),
            ..Self::PUBLISHER
        })
    }
}
