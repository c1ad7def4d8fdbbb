//! Reads recordings for tests.

use rc_record::bag::Info;

/// The number of messages of the topics with this end.
pub fn count(info: &Info, end: &str) -> u64 {
    let topics = info.topics.iter();
    let fitting = topics.filter(|(name, _)| name.ends_with(end));
    fitting.map(|(_, topic)| topic.count).sum()
}
