//! Converts a sample of the library into a body and a header.

use crate::entities::Inbox;
use crate::{GuidPrefix, RateLimit, SampleQueue};
use rc_ddsc::Sample;
use rc_middleware::Header;

/// Length of the encapsulation before a body (RTPS 2.5, 10.2): the representation, and the number
/// of padding bytes.
const ENCAPSULATION: usize = 4;

/// The body of a sample, or why it cannot be read.
pub fn body(sample: &[u8]) -> Result<&[u8], String> {
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

/// The header of a sample. `type_hash` is 0 if the sender announces none.
pub fn sample_header(sample: &Sample, sender: u128, type_hash: u64) -> Header {
    crate::header(sample.sequence(), sample.stamp(), sender, type_hash)
}

impl Inbox for SampleQueue<Sample> {
    fn put(&self, sample: Sample, _from: Option<GuidPrefix>) {
        static RATE_LIMIT: RateLimit = RateLimit::new();
        let size = sample.len();
        if !SampleQueue::put(self, size, sample) && RATE_LIMIT.allow().is_some() {
            let limit = self.gauge().limit();
            tracing::warn!(
                "a sample of {size} bytes is dropped: the setting `queue_mib` allows {limit} bytes"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_is_what_is_behind_the_encapsulation_and_before_the_padding() {
        assert_eq!(body(&[0, 1, 0, 0, 7, 8]), Ok(&[7, 8][..]));
        assert_eq!(body(&[0, 1, 0, 3, 7, 0, 0, 0]), Ok(&[7][..]));
        assert_eq!(body(&[0, 1, 0, 3]), Ok(&[][..]));
        for wrong in [&[][..], &[0, 1, 0], &[0, 0, 0, 0, 1], &[0, 7, 0, 0, 1]] {
            assert!(body(wrong).is_err(), "{wrong:?}");
        }
    }
}
