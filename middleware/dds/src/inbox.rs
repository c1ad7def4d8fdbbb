//! How samples of the library get into queues, and how a sample becomes a body.

use crate::endpoint_state::Inbox;
use rc_ddsc::{Guid, Sample};
use rc_middleware::Header;
use rc_middleware::rpc::{self, RequestId};
use rc_network::{Backlog, RateLimit, ReplyQueue, RequestQueues, SampleQueue};

/// Length of the encapsulation before a body (RTPS 2.5, 10.2): the representation, and the number
/// of padding bytes.
const ENCAPSULATION: usize = 4;

/// The body of a sample, or why it cannot be read.
pub(crate) fn body(sample: &[u8]) -> Result<&[u8], String> {
    let Some((head, body)) = sample.split_at_checked(ENCAPSULATION) else {
        return Err(format!(
            "a sample of {} bytes has no encapsulation",
            sample.len()
        ));
    };
    match head[..2] {
        [0, 1] => {}
        [0, 0] => return Err("a sample is big endian; only little endian is read".to_owned()),
        [a, b] => {
            return Err(format!(
                "a sample has the representation {a:02x}{b:02x}; only XCDR1, little endian (0001), is read"
            ));
        }
        _ => return Err("a sample has no encapsulation".to_owned()),
    }
    let padding = usize::from(head[3] & 3);
    Ok(&body[..body.len().saturating_sub(padding)])
}

/// The header of a sample. `type_hash` is 0 where the sender tells none.
pub(crate) fn header(sample: &Sample, sender: u128, type_hash: u64) -> Header {
    rc_network::header(sample.sequence(), sample.stamp(), sender, type_hash)
}

impl Inbox for SampleQueue<Sample> {
    fn put(&self, sample: Sample) {
        SampleQueue::put(self, sample);
    }
}

/// The replies to one client.
pub(crate) struct Replies {
    /// The address of the server.
    address: String,
    queue: ReplyQueue<Sample>,
    rate_limit: RateLimit,
}

impl Replies {
    pub(crate) fn new(address: &str) -> Self {
        Self {
            address: address.to_owned(),
            queue: ReplyQueue::default(),
            rate_limit: RateLimit::default(),
        }
    }

    /// Sets the client whose replies are kept.
    pub(crate) fn set_client(&self, client: Guid) {
        self.queue.set_client(client);
    }

    pub(crate) fn next(&self) -> Option<(RequestId, Sample)> {
        self.queue.next()
    }
}

impl Backlog for Replies {}

impl Inbox for Replies {
    fn put(&self, sample: Sample) {
        let envelope = |body| rpc::request_id(body).ok_or_else(|| "it has no envelope".to_owned());
        match body(&sample).and_then(envelope) {
            Ok(id) => self.queue.put(id, sample),
            Err(reason) => {
                if let Some(suppressed) = self.rate_limit.allow() {
                    let (count, address) = (suppressed + 1, &self.address);
                    tracing::warn!(
                        "`{address}` sent a sample that is no reply ({count} times): {reason}"
                    );
                }
            }
        }
    }
}

/// The requests to a server. The library names clients by handles.
impl Inbox for RequestQueues<u64, Sample> {
    fn put(&self, sample: Sample) {
        let id = |sample: &Sample| body(sample).ok().and_then(rpc::request_id);
        RequestQueues::put(self, sample.writer(), sample.len(), sample, id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encapsulation_and_padding_are_removed() {
        assert_eq!(body(&[0, 1, 0, 0, 7, 8]), Ok(&[7, 8][..]));
        assert_eq!(body(&[0, 1, 0, 3, 7, 0, 0, 0]), Ok(&[7][..]));
        assert_eq!(body(&[0, 1, 0, 3]), Ok(&[][..]));
        for wrong in [&[][..], &[0, 1, 0], &[0, 0, 0, 0, 1], &[0, 7, 0, 0, 1]] {
            assert!(body(wrong).is_err(), "{wrong:?}");
        }
    }
}
