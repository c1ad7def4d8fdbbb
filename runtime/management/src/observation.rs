//! Description of a component's connections and their types, and the copies of messages that it
//! makes for tools.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use rc_vocabulary::Role;
use rc_vocabulary::foreign;
use rc_vocabulary::qos::Qos;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;
use std::collections::BTreeMap;

/// The connections of a component, with their types.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Described {
    /// The component's type: the name after `Component` in its `.cdsl`.
    #[serde(deserialize_with = "foreign::text")]
    pub component: String,
    /// The component's name in its network.
    #[serde(deserialize_with = "foreign::text")]
    pub name: String,
    /// The network.
    #[serde(deserialize_with = "foreign::text")]
    pub network: String,
    /// The process.
    pub pid: u32,
    /// The settings of each of its middlewares, as command lines take them.
    #[serde(default)]
    pub middlewares: BTreeMap<String, BTreeMap<String, String>>,
    /// The connections, in the order of the `.cdsl`; without addresses until they are open.
    pub slots: Vec<SlotDescription>,
    /// The files of the schema of its shared world, the one that the component names first: names and
    /// texts. Empty if it has no world.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub world: Vec<(String, String)>,
    /// The IDSL modules, each in the form of `rc_values::description::Module`.
    pub types: Vec<Value>,
}

/// The clocks of a component's machine at one moment: with those of the moments of the request and
/// of its answer, a tool estimates how far they are apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clocks {
    /// The clock of the system, in nanoseconds since 1970.
    pub system_ns: i64,
    /// The monotonic clock, in nanoseconds since an unspecified moment.
    pub monotonic_ns: u64,
}

/// One connection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SlotDescription {
    /// The slot's name.
    #[serde(deserialize_with = "foreign::text")]
    pub name: String,
    /// Which end of the connection it is.
    pub role: Role,
    /// The interface with its module, `RoboCompLaser::Laser`.
    #[serde(deserialize_with = "foreign::text")]
    pub interface: String,
    /// The middleware that tools use.
    #[serde(deserialize_with = "foreign::text")]
    pub middleware: String,
    /// Further middlewares over which it has connections.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(deserialize_with = "foreign::texts")]
    pub further: Vec<String>,
    /// Where the ends of the connection meet. A topic adds the name of its operation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "foreign::optional")]
    pub address: Option<String>,
    /// Hash over the types of all operations, 16 hexadecimal digits.
    #[serde(deserialize_with = "foreign::text")]
    pub hash: String,
    /// The operations, in the order of the IDSL.
    pub operations: Vec<OperationDescription>,
}

/// One operation of a connection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OperationDescription {
    /// The name.
    #[serde(deserialize_with = "foreign::text")]
    pub name: String,
    /// Hash over its types, 16 hexadecimal digits.
    #[serde(deserialize_with = "foreign::text")]
    pub hash: String,
    /// The quality of service of its topic, or of the calls.
    pub qos: Qos,
    /// Type in a middleware that has types of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "foreign::optional")]
    pub external_type: Option<String>,
}

/// A notification to a client that taps a slot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Notification {
    /// The copy of a message.
    Tapped(Box<Tapped>),
    /// Messages that were lost, if no copy follows that says so.
    Dropped {
        /// The slot.
        #[serde(deserialize_with = "foreign::text")]
        slot: String,
        /// How many messages of the slot this client has lost since it began to tap the slot.
        dropped: u64,
    },
}

/// The copy of a message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tapped {
    /// The slot.
    #[serde(deserialize_with = "foreign::text")]
    pub slot: String,
    /// Sample, request or reply.
    pub kind: TappedKind,
    /// The operation of a sample. A request and its reply have the operation in their envelope.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "foreign::optional")]
    pub operation: Option<String>,
    /// Hash over the types of the body, 0 from another program.
    pub type_hash: u64,
    /// The number among the messages of one sender, from 1.
    pub sequence: u64,
    /// The time of sending, in nanoseconds of the monotonic clock of the component's machine.
    pub sent: u64,
    /// Whether the body is the memory image of a plain type, not CDR.
    pub image: bool,
    /// Whether a body after an envelope begins at a multiple of 8 bytes, as in ROS 2.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ros: bool,
    /// How many messages of the slot this client has lost since it began to tap the slot.
    pub dropped: u64,
    /// The message. A request and a reply begin with the envelope of `rc_middleware::rpc`.
    #[serde(serialize_with = "encode", deserialize_with = "decode")]
    pub body: Vec<u8>,
}

/// Kind of a copied message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TappedKind {
    /// A request.
    Request,
    /// The reply to a request.
    Reply,
    /// A sample of a topic.
    Sample,
}

/// The reply to a request that a tool has sent over management.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Called {
    /// The reply with its envelope; empty for a command.
    #[serde(serialize_with = "encode", deserialize_with = "decode")]
    pub body: Vec<u8>,
}

/// Writes bytes as Base64.
pub(crate) fn encode<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&STANDARD.encode(bytes))
}

/// Reads bytes from Base64.
pub(crate) fn decode<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u8>, D::Error> {
    let text = std::borrow::Cow::<str>::deserialize(deserializer)?;
    STANDARD
        .decode(text.as_bytes())
        .map_err(serde::de::Error::custom)
}
