//! Subscriptions of a client.

use std::collections::BTreeMap;

/// How many channels a client may subscribe to.
pub(crate) const SUBSCRIPTIONS: usize = 4096;

/// The subscriptions of a client, at most one for a channel: each costs a copy of each message.
#[derive(Default)]
pub(crate) struct Subscriptions {
    channels: BTreeMap<u32, u64>,
    ids: BTreeMap<u64, u32>,
}

impl Subscriptions {
    /// Subscribes to a channel by an id that the client has chosen. Says why not.
    pub(crate) fn add(&mut self, id: u32, channel: u64) -> Result<(), String> {
        if self.ids.contains_key(&channel) {
            return Err(format!("channel {channel} has a subscription already"));
        }
        if self.channels.contains_key(&id) {
            return Err(format!("subscription {id} is in use"));
        }
        if self.channels.len() >= SUBSCRIPTIONS {
            return Err(format!("more than {SUBSCRIPTIONS} subscriptions"));
        }
        self.channels.insert(id, channel);
        self.ids.insert(channel, id);
        Ok(())
    }

    pub(crate) fn remove(&mut self, id: u32) {
        if let Some(channel) = self.channels.remove(&id) {
            self.ids.remove(&channel);
        }
    }

    /// Keeps those to channels for which this holds.
    pub(crate) fn retain(&mut self, is_there: impl Fn(u64) -> bool) {
        self.ids.retain(|channel, _| is_there(*channel));
        self.channels.retain(|_, channel| is_there(*channel));
    }

    /// The id of the subscription to a channel.
    pub(crate) fn id(&self, channel: u64) -> Option<u32> {
        self.ids.get(&channel).copied()
    }

    /// The channels.
    pub(crate) fn channels(&self) -> impl Iterator<Item = &u64> {
        self.ids.keys()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_has_one_subscription_and_an_id_one_channel() {
        let mut all = Subscriptions::default();
        assert_eq!(all.add(1, 10), Ok(()));
        assert!(all.add(2, 10).is_err());
        assert!(all.add(1, 11).is_err());
        assert_eq!((all.id(10), all.id(11)), (Some(1), None));
        all.remove(2);
        assert_eq!(all.id(10), Some(1));
        all.remove(1);
        assert_eq!(all.add(2, 10), Ok(()));
        assert_eq!(all.add(1, 11), Ok(()));
        all.retain(|channel| channel == 11);
        assert_eq!(all.add(2, 12), Ok(()));
        assert!(all.channels().eq([&11, &12]));
        for id in 3..=SUBSCRIPTIONS as u32 {
            all.add(id, u64::from(id) + 100).expect("room");
        }
        assert!(all.add(0, 1).is_err());
    }
}
