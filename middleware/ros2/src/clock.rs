//! `/clock`, the topic by which nodes of ROS 2 share a simulated time.

use crate::{NAME, remap};
use rc_middleware::linked::NodeClock;
use rc_middleware::{DecodeError, Reader, Settings, Writer};
use rc_vocabulary::Value;
use rc_vocabulary::ros::Remapping;

/// The clock of nodes with `use_sim_time`.
pub(crate) const CLOCK: NodeClock = NodeClock {
    setting: "use_sim_time",
    types: "rosgraph_msgs::Clock/clock",
    type_name: "rosgraph_msgs/msg/Clock",
    rename,
    read,
    write,
};

/// Names the topic `clock` of a slot `/clock`, after the rules of the settings.
fn rename(settings: &mut Settings, slot: &str) {
    let mut rules = remap::rules(settings).to_vec();
    rules.extend(Remapping::parse(&format!("{slot}/clock:=/clock")));
    settings.set(NAME, remap::KEY, Value::Remappings(rules));
}

/// Reads the nanoseconds of a `rosgraph_msgs/msg/Clock`: `int32` seconds, `uint32` nanoseconds.
/// Times before 0 count as 0.
fn read(reader: &mut Reader<'_>) -> Result<u64, DecodeError> {
    let (seconds, nanoseconds): (i32, u32) = (reader.get()?, reader.get()?);
    let seconds = u64::try_from(seconds).unwrap_or(0);
    Ok(seconds * 1_000_000_000 + u64::from(nanoseconds))
}

/// Writes a `rosgraph_msgs/msg/Clock`. Its seconds end in 2038.
fn write(nanoseconds: u64, writer: &mut Writer<'_>) {
    let seconds = i32::try_from(nanoseconds / 1_000_000_000).unwrap_or(i32::MAX);
    writer.put(&seconds);
    writer.put(&((nanoseconds % 1_000_000_000) as u32));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_seconds_and_nanoseconds() {
        let mut writer = Writer::default();
        write(12_500_000_001, &mut writer);
        let bytes = writer.finish().expect("bytes").to_vec();
        assert_eq!(bytes, [12, 0, 0, 0, 1, 0x65, 0xcd, 0x1d]);
        assert_eq!(read(&mut Reader::new(&bytes)), Ok(12_500_000_001));
        let early = [0xff, 0xff, 0xff, 0xff, 7, 0, 0, 0];
        assert_eq!(read(&mut Reader::new(&early)), Ok(7));
        assert!(read(&mut Reader::new(&bytes[..7])).is_err());
    }

    #[test]
    fn the_topic_is_renamed_behind_other_rules() {
        let mut settings = Settings::default();
        let own = Remapping::parse("a:=/b").expect("a rule");
        settings.set(NAME, remap::KEY, Value::Remappings(vec![own]));
        rename(&mut settings, "rc_time");
        let rules = remap::rules(&settings).iter();
        let rules: Vec<String> = rules.map(ToString::to_string).collect();
        assert_eq!(rules, ["a:=/b", "rc_time/clock:=/clock"]);
    }
}
