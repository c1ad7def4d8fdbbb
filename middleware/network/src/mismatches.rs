//! Endpoints that do not match those of this component, for its log and for its supervisor.

use crate::{EndpointInfo, EndpointKind, Guid, Identity, lock};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Most mismatched endpoints that are listed; the log has all.
const MOST_LISTED: usize = 64;

/// The endpoints that do not match those of this component, until they leave.
#[derive(Debug)]
pub struct Mismatches {
    host: String,
    /// The report about each pair of a foreign endpoint and an own topic.
    reports: Mutex<BTreeMap<(Guid, String), String>>,
}

impl Mismatches {
    /// Reports that are read on `host`.
    pub fn new(host: &str) -> Self {
        Self {
            host: host.to_owned(),
            reports: Mutex::default(),
        }
    }

    /// The endpoint `guid`, a peer of `endpoint`, has other types: the two exchange nothing.
    pub fn types_differ(&self, endpoint: &Identity, guid: &Guid, peer: &EndpointInfo) {
        let (topic, ours) = (&endpoint.topic, &endpoint.info.types);
        let (name, theirs) = (peer.describe(&self.host), &peer.types);
        self.error(guid, topic, format!(
            "the endpoints of `{topic}` differ in type: this one has {ours}, {name} has {theirs}; they exchange nothing. Regenerate and rebuild both from the same .idsl"
        ));
    }

    /// A process on another machine serves `service`, whose requests come on `topic`, too:
    /// discovery finds it too late to refuse it.
    pub fn second_server(&self, topic: &str, guid: &Guid, service: &str, server: &EndpointInfo) {
        let name = server.describe(&self.host);
        self.error(guid, topic, format!(
            "`{service}` has two servers, this one and {name}; every request is executed by both. Stop one, or give it another address with --network, --name or --bind"
        ));
    }

    /// `peer` and `endpoint` do not match in quality of service. `peer` is `None` for an endpoint
    /// of another program.
    pub fn qos_differs(
        &self,
        endpoint: &Identity,
        peer: Option<&EndpointInfo>,
        peer_guid: &Guid,
        differences: &str,
    ) {
        let name = match peer {
            Some(info) => format!("the {} {}", info.role.name(), info.describe(&self.host)),
            None => format!("the endpoint {}", crate::hex(peer_guid)),
        };
        let topic = &endpoint.topic;
        let report = match endpoint.kind {
            EndpointKind::Writer => {
                format!("samples on `{topic}` do not reach {name}: {differences}")
            }
            EndpointKind::Reader => {
                format!("`{topic}` receives no samples of {name}: {differences}")
            }
        };
        tracing::warn!("{report}");
        self.keep(peer_guid, topic, report);
    }

    /// Reports the endpoint `guid`, with which this component exchanges nothing on its `topic`, or
    /// that does harm.
    pub fn error(&self, guid: &Guid, topic: &str, report: String) {
        tracing::error!("{report}");
        self.keep(guid, topic, report);
    }

    fn keep(&self, guid: &Guid, topic: &str, report: String) {
        let mut reports = lock(&self.reports);
        if reports.len() < MOST_LISTED {
            reports.insert((*guid, topic.to_owned()), report);
        }
    }

    /// Forgets the endpoint `guid`, which has left.
    pub fn forget(&self, guid: &Guid) {
        lock(&self.reports).retain(|(reported, _), _| reported != guid);
    }

    /// The reports about endpoints that are there, at the topics of this component for which
    /// `is_open` holds.
    pub fn list(&self, is_open: impl Fn(&str) -> bool) -> Vec<String> {
        let reports = lock(&self.reports);
        let open = reports.iter().filter(|((_, topic), _)| is_open(topic));
        open.map(|(_, report)| report.clone()).collect()
    }
}
