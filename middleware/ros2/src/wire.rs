//! Samples as bytes: what goes to `rustdds` and what comes from it.
//!
//! Bodies pass through it as they are; its serializers are not used. A body that is sent is filled
//! up to a multiple of four bytes: Cyclone DDS never gets a larger sample of another length that
//! came in fragments.

use rc_middleware::rpc::ENVELOPE;
use rc_network::{Guid, GuidPrefix, lock, prefix};
use rustdds::bytes::Bytes;
use rustdds::no_key::{Decode, DeserializerAdapter, SerializerAdapter};
use rustdds::{GUID, RepresentationIdentifier, Timestamp};
use std::convert::Infallible;
use std::sync::{Arc, Mutex};

/// Where the header of a call in the Cyclone mapping is: a number of the client and one of the
/// request.
pub(crate) const CYCLONE_HEADER: usize = 16;

/// A body that is sent.
#[derive(Clone)]
pub(crate) struct Body(Bytes);

impl Body {
    /// `parts` one after the other, and zeros up to a multiple of four bytes.
    pub(crate) fn of(parts: &[&[u8]]) -> Self {
        let length: usize = parts.iter().map(|part| part.len()).sum();
        let mut bytes = Vec::with_capacity(length.next_multiple_of(4));
        for part in parts {
            bytes.extend_from_slice(part);
        }
        bytes.resize(length.next_multiple_of(4), 0);
        Self(bytes.into())
    }

    /// How many bytes it has.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }
}

/// What a spare buffer has room for, at most; more costs more to fill than to get.
const MOST_SPARE: usize = 4 << 20;

/// A buffer that what has come is copied into, and that comes back when it was read: large ones
/// would be got from the system, and given back to it, for each sample.
#[derive(Default)]
pub(crate) struct Spare(Mutex<Vec<u8>>);

/// A body that has come, with room for an envelope before it.
pub(crate) struct Taken {
    bytes: Vec<u8>,
    spare: Arc<Spare>,
    /// Whether it is CDR, little endian.
    readable: bool,
}

impl Taken {
    /// The body; why there is none.
    pub(crate) fn body(&self) -> Result<&[u8], String> {
        if self.readable {
            Ok(&self.bytes[ENVELOPE..])
        } else {
            Err("a sample is not CDR, little endian; nothing else is read".to_owned())
        }
    }

    /// The envelope and behind it the body, without the first `skipped` bytes of it.
    pub(crate) fn in_envelope(&mut self, skipped: usize, envelope: &[u8]) -> &[u8] {
        let begin = skipped.min(self.len());
        let end = begin + envelope.len().min(ENVELOPE);
        self.bytes[begin..end].copy_from_slice(&envelope[..end - begin]);
        &self.bytes[begin..]
    }

    /// How many bytes it has.
    pub(crate) fn len(&self) -> usize {
        self.bytes.len() - ENVELOPE
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        let mut spare = lock(&self.spare.0);
        if (spare.capacity()..=MOST_SPARE).contains(&self.bytes.capacity()) {
            *spare = std::mem::take(&mut self.bytes);
        }
    }
}

/// Gives `rustdds` the bytes of a body.
pub(crate) struct Passing;

impl SerializerAdapter<Body> for Passing {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(body: &Body) -> Result<Bytes, Infallible> {
        Ok(body.0.clone())
    }
}

impl DeserializerAdapter<Taken> for Passing {
    type Error = Infallible;
    type Decoded = Taken;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        // What cannot be read is counted, so it has to come this far.
        const ALL: &[RepresentationIdentifier] = &[
            RepresentationIdentifier::CDR_LE,
            RepresentationIdentifier::CDR_BE,
            RepresentationIdentifier::PL_CDR_LE,
            RepresentationIdentifier::PL_CDR_BE,
            RepresentationIdentifier::CDR2_LE,
            RepresentationIdentifier::CDR2_BE,
            RepresentationIdentifier::PL_CDR2_LE,
            RepresentationIdentifier::PL_CDR2_BE,
            RepresentationIdentifier::D_CDR_LE,
            RepresentationIdentifier::D_CDR_BE,
            RepresentationIdentifier::XML,
            RepresentationIdentifier::XCDR2_LE,
            RepresentationIdentifier::XCDR2_BE,
            RepresentationIdentifier::D_CDR2_LE,
            RepresentationIdentifier::D_CDR2_BE,
            RepresentationIdentifier::PL_XCDR2_LE,
            RepresentationIdentifier::PL_XCDR2_BE,
        ];
        ALL
    }

    fn transform_decoded(taken: Taken) -> Taken {
        taken
    }
}

/// Copies the bytes of a sample.
#[derive(Clone, Default)]
pub(crate) struct Copying(pub(crate) Arc<Spare>);

impl Decode<'_, Taken> for Copying {
    type Error = Infallible;

    fn decode_bytes(
        self,
        input: &[u8],
        encoding: RepresentationIdentifier,
    ) -> Result<Taken, Infallible> {
        let mut bytes = std::mem::take(&mut *lock(&self.0.0));
        bytes.clear();
        bytes.reserve(ENVELOPE + input.len());
        bytes.resize(ENVELOPE, 0);
        bytes.extend_from_slice(input);
        Ok(Taken {
            bytes,
            spare: self.0,
            readable: encoding == RepresentationIdentifier::CDR_LE,
        })
    }
}

pub(crate) type Writer = rustdds::no_key::DataWriter<Body, Passing>;
pub(crate) type Reader = rustdds::no_key::SimpleDataReader<Taken, Passing>;

/// A sample that has come.
pub(crate) struct Sample {
    pub(crate) taken: Taken,
    pub(crate) writer: Guid,
    /// Counts the samples of its writer, from 1.
    pub(crate) sequence: u64,
    /// When it was sent, in nanoseconds since 1970; 0 where the sender does not say.
    pub(crate) stamp: i64,
    /// In which order it came here.
    pub(crate) received: u64,
    /// Which request it is or answers, in the Enhanced mapping.
    pub(crate) related: Option<(Guid, i64)>,
    /// The number of the end at which it came, among those that hear together.
    pub(crate) place: usize,
}

impl Sample {
    pub(crate) fn of(
        change: rustdds::no_key::DeserializedCacheChange<Taken>,
        place: usize,
    ) -> Self {
        let related = change.related_sample_identity();
        Self {
            writer: change.writer_guid.to_bytes(),
            sequence: u64::try_from(i64::from(change.sequence_number)).unwrap_or(0),
            stamp: change.source_timestamp().map_or(0, nanoseconds),
            received: change.receive_instant.to_ticks(),
            related: related.map(|id| (id.writer_guid.to_bytes(), i64::from(id.sequence_number))),
            taken: change.into_value(),
            place,
        }
    }

    /// The process of its sender.
    pub(crate) fn prefix(&self) -> GuidPrefix {
        prefix(&self.writer)
    }
}

pub(crate) fn guid(guid: GUID) -> Guid {
    guid.to_bytes()
}

/// A time of RTPS, in seconds and 2⁻³² of one since 1970, in nanoseconds.
fn nanoseconds(time: Timestamp) -> i64 {
    let ticks = time.to_ticks();
    let seconds = i64::try_from(ticks >> 32).unwrap_or(i64::MAX);
    let fraction = ((ticks & 0xffff_ffff) * 1_000_000_000) >> 32;
    seconds
        .saturating_mul(1_000_000_000)
        .saturating_add(fraction as i64)
}

/// The other way round.
pub(crate) fn timestamp(nanoseconds: i64) -> Timestamp {
    let nanoseconds = u64::try_from(nanoseconds).unwrap_or(0);
    let (seconds, rest) = (nanoseconds / 1_000_000_000, nanoseconds % 1_000_000_000);
    Timestamp::from_ticks((seconds << 32) + ((rest << 32) / 1_000_000_000))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sent_is_a_multiple_of_four() {
        for (length, sent) in [(0, 0), (1, 4), (4, 4), (70_001, 70_004)] {
            assert_eq!(Body::of(&[&vec![7; length]]).len(), sent);
        }
        assert_eq!(&Body::of(&[&[1], &[2, 3]]).0[..], [1, 2, 3, 0]);
    }

    #[test]
    fn an_envelope_stands_right_before_its_body() {
        let copied =
            Copying::default().decode_bytes(&[1, 2, 3, 4], RepresentationIdentifier::CDR_LE);
        let Ok(mut taken) = copied;
        assert_eq!(taken.body(), Ok(&[1, 2, 3, 4][..]));
        let envelope = [9; ENVELOPE];
        let whole = taken.in_envelope(1, &envelope).to_vec();
        assert_eq!(
            (&whole[..ENVELOPE], &whole[ENVELOPE..]),
            (&envelope[..], &[2, 3, 4][..])
        );
        assert_eq!(taken.in_envelope(100, &envelope).len(), ENVELOPE);
        let Ok(other) = Copying::default().decode_bytes(&[], RepresentationIdentifier::CDR_BE);
        assert!(other.body().is_err());
    }

    #[test]
    fn times_go_there_and_back() {
        for time in [0, 1_000_000_000, 1_763_700_000_123_456_789] {
            assert!((nanoseconds(timestamp(time)) - time).abs() <= 1);
        }
    }
}
