//! From a message of the network to the clients that have subscribed to its channels.

use crate::client::Client;
use crate::message::{Opened, time_of_sending};
use crate::offers::{Channel, Reading};
use crate::protocol;
use rc_observe::Observed;
use rc_record::system_time;

/// Sends a message to the clients, by those channels that show its source. `simulated` is the time
/// of the network, in nanoseconds, if it is not that of the system. Says whether the message fits
/// its description.
pub(crate) fn deliver<'c>(
    reading: &Reading,
    observed: &Observed<'_>,
    channels: impl Iterator<Item = (&'c u64, &'c Channel)>,
    clients: impl Iterator<Item = &'c mut Client>,
    simulated: Option<u64>,
) -> bool {
    let time = simulated.unwrap_or_else(system_time);
    // Waiting messages were measured earlier. In simulated time, only the time of the network is
    // known.
    let sent = if simulated.is_none() && reading.is_here() {
        time_of_sending(observed.header.sent, rc_middleware::now(), time)
    } else {
        time
    };
    let mut message = Opened::new(reading, observed);
    let fits = message.is_some();
    let mut channels: Vec<_> = channels.map(|(id, channel)| (*id, channel, None)).collect();
    for client in clients {
        let mut is_wanted = false;
        for (id, channel, data) in &mut channels {
            let Some(subscription) = client.subscriptions.id(*id) else {
                continue;
            };
            is_wanted = true;
            let opened = message.as_mut();
            let data = data.get_or_insert_with(|| opened.and_then(|m| m.data(channel, sent)));
            if let Some(data) = data {
                client.publish(protocol::message(subscription, time, data));
            }
        }
        // Several channels may show the same message.
        if is_wanted {
            client.note_loss(observed.lost);
        }
    }
    fits
}
