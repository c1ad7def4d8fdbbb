//! Queues of samples that were received and not read yet: of a topic, of requests, of replies. Each
//! has a bound in bytes, see `queue_mib` in the settings.

mod replies;
mod requests;
mod samples;

pub use replies::ReplyQueue;
pub use requests::{NO_ROOM, QueuedRequest, RequestQueues};
pub use samples::{DuplicateFilter, SampleQueue};
