//! Reports about mismatched endpoints, for the log and for the supervisor of the component.

use crate::{EndpointInfo, EndpointKind, Identity, lock};
use std::sync::Mutex;

/// Most reports that wait for the supervisor; the log has all.
const MOST_REPORTS: usize = 64;

/// Reports about endpoints that do not match those of this component.
#[derive(Debug)]
pub struct Mismatches {
    host: String,
    reports: Mutex<Vec<String>>,
}

impl Mismatches {
    /// Reports that are read on `host`.
    pub fn new(host: &str) -> Self {
        Self {
            host: host.to_owned(),
            reports: Mutex::default(),
        }
    }

    /// A peer of `endpoint` has other types: the two exchange nothing.
    pub fn types_differ(&self, endpoint: &Identity, peer: &EndpointInfo) {
        let (topic, ours) = (&endpoint.topic, &endpoint.info.types);
        let (name, theirs) = (peer.describe(&self.host), &peer.types);
        self.error(format!(
            "the endpoints of `{topic}` differ in type: this one has {ours}, {name} has {theirs}; they exchange nothing. Regenerate and rebuild both from the same .idsl"
        ));
    }

    /// A process on another machine serves `service`, too: discovery finds it too late to refuse
    /// it.
    pub fn second_server(&self, service: &str, server: &EndpointInfo) {
        let name = server.describe(&self.host);
        self.error(format!(
            "`{service}` has two servers, this one and {name}; every request is executed by both. Stop one, or give it another address with --network, --name or --bind"
        ));
    }

    /// `peer` and `endpoint` do not match in quality of service. `peer` is `None` for an endpoint
    /// of another program.
    pub fn qos_differs(
        &self,
        endpoint: &Identity,
        peer: Option<&EndpointInfo>,
        peer_guid: &crate::Guid,
        differences: &str,
    ) {
        let name = match peer {
            Some(info) => format!("the {} {}", info.role.name(), info.describe(&self.host)),
            None => format!("the endpoint {}", crate::hex(peer_guid)),
        };
        let topic = &endpoint.topic;
        self.warn(match endpoint.kind {
            EndpointKind::Writer => {
                format!("samples on `{topic}` do not reach {name}: {differences}")
            }
            EndpointKind::Reader => {
                format!("`{topic}` receives no samples of {name}: {differences}")
            }
        });
    }

    /// Reports an endpoint with which this component exchanges nothing, or that does harm.
    pub fn error(&self, report: String) {
        tracing::error!("{report}");
        self.keep(report);
    }

    /// Reports an endpoint with which less works than was requested.
    fn warn(&self, report: String) {
        tracing::warn!("{report}");
        self.keep(report);
    }

    fn keep(&self, report: String) {
        let mut reports = lock(&self.reports);
        if reports.len() < MOST_REPORTS {
            reports.push(report);
        }
    }

    /// Takes the reports since the last call.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut *lock(&self.reports))
    }
}
