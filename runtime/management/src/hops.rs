//! The notes of a component about messages on chains: which message came in, which one it sent in
//! the same reaction, and when.
//!
//! They are not part of the messages. The supervisor takes the notes of all components and joins
//! them: a message that one has sent is the one that another has received from the same sender with
//! the same number.

use crate::observation;
use rc_vocabulary::{Stamp, foreign};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The most pairs that are followed in a component.
pub const MOST_PAIRS: usize = 64;
/// How many hops of each pair wait until they are taken. The supervisor takes them four times a
/// second: beyond 2,560 a second of each pair, the newest ones are followed.
pub const RING: usize = 640;

/// A message that may come in, and one that may be sent because of it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Pair {
    /// The input. `None`: the chain begins with the output.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input: Option<Message>,
    /// The output. `None`: the chain ends when the handler of the input has run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub output: Option<Message>,
    /// How the output follows the input.
    #[serde(default)]
    pub way: Way,
    /// Where the stamp is of the input; without an input, of the output. Its messages are noted with
    /// this time as the one at which they were sent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stamp: Option<Stamp>,
}

/// An operation of a slot.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Message {
    /// The slot; for an array, all of its members.
    #[serde(deserialize_with = "foreign::text")]
    pub slot: String,
    /// The operation.
    #[serde(deserialize_with = "foreign::text")]
    pub operation: String,
}

/// The way from a message to what the component sends.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// In the handler of the message.
    Handler,
    /// In a later `compute()`, or in the handler of the message itself.
    Compute,
    /// Whenever it sends: the component does not say what follows what.
    #[default]
    Any,
}

/// The end of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u16)]
pub enum Kind {
    /// The output was sent. Without an input, it begins the chain.
    Sent = 0,
    /// The handler of the input has ended, and has sent nothing.
    Ended = 1,
    /// A newer message came before the input was used.
    Replaced = 2,
    /// A run of `compute()` has not used the input, and a later one may.
    Kept = 3,
}

impl Kind {
    fn of(number: u16) -> Option<Self> {
        [Self::Sent, Self::Ended, Self::Replaced, Self::Kept]
            .into_iter()
            .find(|kind| *kind as u16 == number)
    }
}

/// The way of one message through a component: 48 bytes. Times are nanoseconds of the monotonic
/// clock of its machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hop {
    /// The sender of the input, see [`short`].
    pub sender: u32,
    /// The pair: an index into those of [`Request::Follow`](crate::component::Request::Follow).
    pub pair: u16,
    /// Its end.
    pub kind: Kind,
    /// The lower half of the number of the input.
    pub input: u32,
    /// The lower half of the number of the output; 0 if nothing was sent.
    pub output: u32,
    /// When the input was sent, as its header says; 0 if that is unknown. For a pair with a stamp,
    /// the stamp instead, by any clock.
    pub sent: u64,
    /// When its handler began.
    pub begun: u64,
    /// When the reaction began that used it: its handler, or a later `compute()`.
    pub used: u64,
    /// When the output was sent; for another kind, when that was clear.
    pub left: u64,
}

impl Hop {
    /// Length in bytes.
    pub const LENGTH: usize = 48;

    /// The hop as bytes, little endian.
    pub fn bytes(&self) -> [u8; Self::LENGTH] {
        let mut bytes = [0; Self::LENGTH];
        let head = u64::from(self.sender)
            | (u64::from(self.pair) << 32)
            | (u64::from(self.kind as u16) << 48);
        let numbers = u64::from(self.input) | (u64::from(self.output) << 32);
        let words = [head, numbers, self.sent, self.begun, self.used, self.left];
        for (part, word) in bytes.chunks_exact_mut(8).zip(words) {
            part.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    /// The hop of bytes; `None` if the kind is unknown.
    pub fn read(bytes: &[u8; Self::LENGTH]) -> Option<Self> {
        let mut words = bytes.chunks_exact(8).map(|part| {
            let part = part.try_into().unwrap_or_default();
            u64::from_le_bytes(part)
        });
        let mut word = || words.next().unwrap_or(0);
        let (head, numbers) = (word(), word());
        Some(Self {
            sender: head as u32,
            pair: (head >> 32) as u16,
            kind: Kind::of((head >> 48) as u16)?,
            input: numbers as u32,
            output: (numbers >> 32) as u32,
            sent: word(),
            begun: word(),
            used: word(),
            left: word(),
        })
    }
}

/// A sender in 32 bits. The probability that two senders of one connection have equal ones is
/// 2^-32.
pub fn short(sender: u128) -> u32 {
    let half = ((sender >> 64) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ sender as u64;
    // Mixes, so that no part of an identity counts alone (the finalizer of SplitMix64).
    let half = (half ^ (half >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let half = (half ^ (half >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (half ^ (half >> 32)) as u32
}

/// The answer to [`Request::Follow`](crate::component::Request::Follow).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Following {
    /// For each pair, the senders of its output as receivers see them, see [`short`].
    pub senders: Vec<Vec<u32>>,
}

/// The answer to [`Request::Hops`](crate::component::Request::Hops).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HopReport {
    /// Whether the component handles messages: a managed one that is not active does not.
    pub active: bool,
    /// How many hops had no room since the last time.
    pub overwritten: u64,
    /// The hops, in their order.
    #[serde(serialize_with = "encode", deserialize_with = "decode")]
    pub hops: Vec<Hop>,
}

fn encode<S: Serializer>(hops: &[Hop], serializer: S) -> Result<S::Ok, S::Error> {
    let bytes: Vec<u8> = hops.iter().flat_map(Hop::bytes).collect();
    observation::encode(&bytes, serializer)
}

fn decode<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Hop>, D::Error> {
    let bytes = observation::decode(deserializer)?;
    let (hops, rest) = bytes.as_chunks();
    if !rest.is_empty() {
        return Err(serde::de::Error::custom("a hop has 48 bytes"));
    }
    let hops = hops.iter().map(Hop::read).collect::<Option<_>>();
    hops.ok_or_else(|| serde::de::Error::custom("a hop is of an unknown kind"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOP: Hop = Hop {
        sender: 0xdead_beef,
        pair: 63,
        kind: Kind::Kept,
        input: u32::MAX,
        output: 7,
        sent: 1,
        begun: u64::MAX,
        used: 3,
        left: 4 << 40,
    };

    #[test]
    fn a_hop_survives_its_bytes() {
        assert_eq!(Hop::read(&HOP.bytes()), Some(HOP));
        let mut unknown = HOP.bytes();
        unknown[6] = 9;
        assert_eq!(Hop::read(&unknown), None);
    }

    #[test]
    fn damaged_hops_are_refused() {
        let taken = HopReport {
            active: true,
            overwritten: 1,
            hops: vec![HOP; 3],
        };
        let text = serde_json::to_string(&taken).expect("JSON");
        assert_eq!(
            serde_json::from_str::<HopReport>(&text).expect("hops"),
            taken
        );
        for hops in ["AAAA", "!", &"/".repeat(64)] {
            let text = format!(r#"{{"active":true,"overwritten":0,"hops":"{hops}"}}"#);
            assert!(serde_json::from_str::<HopReport>(&text).is_err(), "{hops}");
        }
    }

    /// Receiver and sender compute it separately, and may be of other versions, or in another
    /// language.
    #[test]
    fn the_short_form_of_a_sender_is_part_of_the_protocol() {
        let identities = [1, 7 << 64, 0x0123_4567_89ab_cdef_0123_4567_89ab_cdef];
        let expected = [0xebbd_3fc3, 0x6ac2_9d23, 0x7d93_742b];
        assert_eq!(identities.map(short), expected);
    }

    #[test]
    fn every_part_of_an_identity_counts() {
        let all = [0, 1, 1 << 64, 1 << 127, 3 << 40].map(short);
        for (at, one) in all.iter().enumerate() {
            assert!(!all[..at].contains(one), "{all:?}");
        }
    }
}
