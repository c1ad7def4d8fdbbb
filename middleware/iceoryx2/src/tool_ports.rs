//! Ports of tools have a name by which they are not counted as peers.

use crate::ports::TopicService;
use iceoryx2::prelude::{CallbackProgression, PortName};
use iceoryx2::service::port_factory::PortFactory as _;

/// The name of a port that is not counted as a peer.
const PORT: &str = "rc-observer";
/// The name of the ports of tools.
pub(crate) fn port_name() -> PortName {
    PortName::new(PORT).unwrap_or_else(|_| PortName::new_empty())
}

/// The subscribers of components.
pub(crate) fn subscribers(topic: &TopicService) -> usize {
    let all = topic.dynamic_config().number_of_subscribers();
    // A tool may have come in between.
    all.saturating_sub(observers(topic))
}

/// The publishers of components.
pub(crate) fn publishers(topic: &TopicService) -> usize {
    let mut count = 0;
    topic.dynamic_config().list_publishers(|details| {
        count += usize::from(details.publisher_name.as_str() != PORT);
        CallbackProgression::Continue
    });
    count
}

/// The subscribers of tools.
pub(crate) fn observers(topic: &TopicService) -> usize {
    let mut count = 0;
    topic.dynamic_config().list_subscribers(|details| {
        count += usize::from(details.subscriber_name.as_str() == PORT);
        CallbackProgression::Continue
    });
    count
}
