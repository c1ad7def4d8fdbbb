//! Recordings: MCAP files that Foxglove and the tools of ROS 2 open.
//!
//! - [`writer`]: writes a recording, in parts if it grows long.
//! - [`reader`]: reads one from its beginning, also if it was cut or is damaged.
//! - [`schema`]: types of interfaces as definitions of ROS 2 messages.
//! - [`live`]: records a running network into a [`sink`]: a file, or a [`ring`] in memory.
//! - [`player`]: sends recorded samples, and answers calls with recorded replies.
//! - [`bag`]: the contents of a recording, as lists and shorter recordings.
//! - [`meaning`]: its values as another data prototype.
//! - [`table`]: its messages as tables in CSV.
//! - [`definition`]: definitions of ROS 2 messages as types, to decode the messages of a file.
//! - [`envelope`]: calls without their envelopes, and with them again.
//! - [`qos`]: the quality of service of a channel, as rosbag2 writes it.
//!
//! `docs/recording.md` describes the file.

pub mod bag;
pub mod chains;
pub mod content;
pub mod definition;
pub mod envelope;
mod error;
mod latched;
pub mod live;
pub mod meaning;
pub mod player;
pub mod qos;
pub mod reader;
pub mod ring;
pub mod schema;
pub mod sink;
pub mod table;
pub mod writer;

pub use error::RecordError;
pub use rc_mcap::{Stamp, system_time};
pub use reader::{Attachment, Channel, Faults, Message, Reader, Record};
pub use schema::Schema;
pub use writer::{ChannelId, Limits, Writer};

/// The encapsulation header of CDR, little endian, before each message.
pub const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// The keys of the metadata of a channel.
pub mod keys {
    /// The address in the network.
    pub const ADDRESS: &str = "robocomp.address";
    /// The interface with its module, `RoboCompLaser::Laser`.
    pub const INTERFACE: &str = "robocomp.interface";
    /// The operation.
    pub const OPERATION: &str = "robocomp.operation";
    /// The hash of the types, 16 hexadecimal digits.
    pub const HASH: &str = "robocomp.hash";
    /// The sender, if the middleware distinguishes senders: the publisher, or the client of calls.
    pub const SENDER: &str = "robocomp.sender";
    /// The publishers of a topic, or the end that has copied the calls: `simulator.Laser`.
    pub const ENDS: &str = "robocomp.ends";
    /// The middleware.
    pub const MIDDLEWARE: &str = "robocomp.middleware";
    /// `sample`, `request` or `reply`; `events`, `parameters`, `state`, `loss`, `clock` or `refused`
    /// for JSON.
    pub const KIND: &str = "robocomp.kind";
    /// The name of a component that is recorded exactly.
    pub const EXACT: &str = "robocomp.exact";
    /// The quality of service, as rosbag2 writes it.
    pub const QOS: &str = "offered_qos_profiles";
}
