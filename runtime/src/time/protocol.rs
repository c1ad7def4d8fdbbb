//! Messages between a source of time and its followers.

use rc_middleware::network_time::TYPE_HASH;
use rc_middleware::typed::Operation;
use rc_middleware::{DecodeError, Reader, Writer};

/// The topic of ticks.
pub(crate) const TICK: Operation = Operation {
    name: "tick",
    id: 0,
    type_hash: TYPE_HASH,
    two_way: false,
    replies: &[],
};

/// The command that acknowledges ticks. Its number is that of the envelope of calls: the first four
/// bytes of the MD5 sum of its name.
pub(crate) const DONE: Operation = Operation {
    name: "done",
    id: i32::from_le_bytes([0x6b, 0x2d, 0xed, 0x51]),
    type_hash: TYPE_HASH,
    two_way: false,
    replies: &[],
};

/// The longest name of a follower, in bytes.
pub(crate) const LONGEST_NAME: usize = 200;

/// The state of a source: its present tick, and whose turn it is. The source repeats it, so a lost
/// one delays its receiver and does no other harm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tick {
    /// Identifies the run of the source; never 0.
    pub(crate) epoch: u64,
    /// The number of the tick, from 1; 0 before the first one.
    pub(crate) number: u64,
    /// The time, in nanoseconds.
    pub(crate) time: u64,
    /// Whose turn it is: [`turn_of`] its name, or 0 for all.
    pub(crate) turn: u64,
    /// Whether the source waits for acknowledgements.
    pub(crate) lockstep: bool,
}

/// A follower has done the work of a tick, joins or leaves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Done {
    /// The run of the source; 0 if the follower knows none yet.
    pub(crate) epoch: u64,
    /// The tick.
    pub(crate) number: u64,
    /// The name of the follower in its network.
    pub(crate) follower: String,
    /// Whether it ends in order: the source no longer waits for it.
    pub(crate) leaving: bool,
}

impl Tick {
    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        writer.put(&self.epoch);
        writer.put(&self.number);
        writer.put(&self.time);
        writer.put(&self.turn);
        writer.put(&self.lockstep);
    }

    pub(crate) fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Ok(Self {
            epoch: reader.get()?,
            number: reader.get()?,
            time: reader.get()?,
            turn: reader.get()?,
            lockstep: reader.get()?,
        })
    }
}

impl Done {
    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        writer.put(&self.epoch);
        writer.put(&self.number);
        rc_middleware::cdr::text(&self.follower, writer);
        writer.put(&self.leaving);
    }

    pub(crate) fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let (epoch, number) = (reader.get()?, reader.get()?);
        let follower: String = reader.get()?;
        if follower.len() > LONGEST_NAME {
            return Err(DecodeError::TooLong {
                what: "follower",
                length: follower.len(),
                bound: LONGEST_NAME,
            });
        }
        Ok(Self {
            epoch,
            number,
            follower,
            leaving: reader.get()?,
        })
    }
}

/// The number by which a tick names the follower whose turn it is: the 64-bit FNV-1a hash of its
/// name, never 0. Source: draft-eastlake-fnv.
pub(crate) fn turn_of(name: &str) -> u64 {
    let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    hash.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_read_as_they_were_written_and_cut_ones_are_errors() {
        let tick = Tick {
            epoch: 1,
            number: 2,
            time: 3,
            turn: 4,
            lockstep: true,
        };
        let done = Done {
            epoch: 5,
            number: 6,
            follower: "arm-left".to_owned(),
            leaving: true,
        };
        let mut writer = Writer::default();
        tick.write(&mut writer);
        let bytes = writer.finish().expect("bytes").to_vec();
        assert_eq!(Tick::read(&mut Reader::new(&bytes)), Ok(tick));
        for length in 0..bytes.len() {
            assert!(Tick::read(&mut Reader::new(&bytes[..length])).is_err());
        }
        writer.clear();
        done.write(&mut writer);
        let bytes = writer.finish().expect("bytes").to_vec();
        assert_eq!(Done::read(&mut Reader::new(&bytes)), Ok(done.clone()));
        for length in 0..bytes.len() {
            assert!(Done::read(&mut Reader::new(&bytes[..length])).is_err());
        }
        let long = Done {
            follower: "x".repeat(LONGEST_NAME + 1),
            ..done
        };
        writer.clear();
        long.write(&mut writer);
        let bytes = writer.finish().expect("bytes").to_vec();
        assert!(Done::read(&mut Reader::new(&bytes)).is_err());
    }
}
