//! Whether an operation can be a topic, a call, or both.

use rc_idsl::model::{Interface, Operation, Pattern};

/// Whether an operation alone could be a topic.
fn one_way(operation: &Operation) -> bool {
    let explicit_pattern = operation.explicit_pattern;
    !operation.has_result() && matches!(explicit_pattern, None | Some(Pattern::Publish))
}

/// Whether components can publish the interface.
fn has_topics(interface: &Interface) -> bool {
    interface.operations.iter().all(one_way)
}

/// Whether an operation can be a topic: it has the keyword `publish`, or its interface can be
/// published.
pub(crate) fn is_topic(interface: &Interface, operation: &Operation) -> bool {
    operation.explicit_pattern == Some(Pattern::Publish) || has_topics(interface)
}

/// Whether an operation can be a call. It cannot if its interface can only be published.
pub(crate) fn is_call(interface: &Interface, operation: &Operation) -> bool {
    let publish = |o: &Operation| o.explicit_pattern == Some(Pattern::Publish);
    let only_topics = has_topics(interface) && interface.operations.iter().any(publish);
    !publish(operation) && !only_topics
}

/// Whether an interface has calls.
pub(super) fn has_calls(interface: &Interface) -> bool {
    let mut operations = interface.operations.iter();
    operations.any(|o| is_call(interface, o))
}
