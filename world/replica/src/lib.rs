//! The shared world: a replica of one property graph in every component of a network.
//!
//! A [`World`] is read without a lock and changed independently of others; its changes go to the
//! other replicas as messages of the topics of `World.idsl`. The protocol has neither a clock nor a
//! middleware: the caller passes time and messages in ([`World::receive`], [`World::turn`]) and
//! takes messages out ([`World::take`]). Replicas converge whatever the network loses, repeats or
//! reorders: each announces once a second what it has seen, one that lacks something asks, and one
//! that has it answers.
//!
//! ```
//! use property_graph::Schema;
//! use rc_world::{Setup, World};
//! use std::time::Duration;
//!
//! let world = |name: &str| World::new(Setup::new(name, Schema::anything().into()));
//! let (mapper, planner) = (world("mapper"), world("planner"));
//! let token = mapper.change(|edit| {
//!     let room = edit.add_node("room")?;
//!     edit.set(room, "name", "kitchen")?;
//!     Ok(())
//! })?;
//! assert!(!planner.has(token));
//! while let Some(message) = mapper.take() {
//!     planner.receive(Duration::ZERO, message);
//! }
//! assert!(planner.has(token));
//! assert!(planner.snapshot().named("kitchen").next().is_some());
//! # Ok::<(), rc_world::Error>(())
//! ```

mod answers;
mod apply;
mod asking;
mod check;
mod content;
mod core;
mod counts;
mod digest;
mod error;
mod exchange;
mod frames;
mod gaps;
mod health;
mod local;
mod message;
mod news;
mod overheard;
mod overruled;
mod peers;
mod protocol;
mod rights;
mod start;
mod status;
mod steady;
mod streams;
mod token;
mod watch;
mod wire;
mod world;

pub use content::Topic;
pub use counts::Counts;
pub use error::Error;
pub use frames::transform;
pub use graph_merge::{Conflict, Reason};
pub use health::Health;
pub use message::{MOST_CHUNK, Message, STATE, STREAM};
pub use news::{News, NewsOf, Reader};
pub use overheard::Overheard;
pub use overruled::Overruled;
pub use property_graph;
pub use rights::Rights;
pub use status::{PeerStatus, Status};
pub use steady::Steady;
pub use token::Token;
pub use watch::{Seen, Watch};
pub use world::{Setup, World};
