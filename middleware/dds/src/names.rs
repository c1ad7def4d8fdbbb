//! The names of topics and types in DDS, as `docs/dds.md` documents them.

use rc_middleware::Endpoint;

/// The name of a topic and of its type: the address, and `Module::Interface_operation`.
pub(crate) fn topic(endpoint: &Endpoint) -> (String, String) {
    let type_name = endpoint.types.name.replace('/', "_");
    (endpoint.address.to_string(), type_name)
}

/// The topics of requests and of replies: what OMG DDS-RPC 1.0, 7.4.2.2, lets an annotation name.
pub(crate) fn service(endpoint: &Endpoint) -> [(String, String); 2] {
    let (address, types) = (&endpoint.address, &endpoint.types.name);
    ["Request", "Reply"].map(|word| (format!("{address}_{word}"), format!("{types}_{word}")))
}

/// The address of a server, for the topic of its requests.
pub(crate) fn address_of_requests(topic: &str) -> &str {
    topic.strip_suffix("_Request").unwrap_or(topic)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_address_of_requests_may_end_like_their_topic() {
        assert_eq!(address_of_requests("a/Arm_Request"), "a/Arm");
        assert_eq!(
            address_of_requests("a/Arm_Request_Request"),
            "a/Arm_Request"
        );
        assert_eq!(address_of_requests("a/Arm"), "a/Arm");
    }
}
