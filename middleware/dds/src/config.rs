//! The configuration with which a component joins DDS, from the settings of `[middleware.dds]`.

use crate::names;
use rc_middleware::{Environment, OpenError};
use rc_network::{Configuration, Joining, refused};

/// Reads the settings.
pub(crate) fn of(environment: &Environment) -> Result<Joining, OpenError> {
    read(environment).map_err(|reason| refused(environment, reason))
}

fn read(environment: &Environment) -> Result<Joining, String> {
    let settings = &environment.settings;
    let domain = settings.int(crate::NAME, "domain").unwrap_or_default();
    let domain = u32::try_from(domain).map_err(|_| format!("there is no domain {domain}"))?;
    let lease = settings.duration(crate::NAME, "lease");
    let lease = lease.ok_or("there is no lease")?;
    let mut configuration = Configuration::new(domain, lease);
    for wanted in settings.texts(crate::NAME, "interfaces") {
        configuration = configuration.interface(wanted)?;
    }
    for peer in settings.texts(crate::NAME, "peers") {
        configuration = configuration.peer(peer);
    }
    if settings.bool(crate::NAME, "multicast") == Some(false) {
        configuration = configuration.without_multicast();
    }
    Ok(Joining {
        middleware: crate::NAME,
        domain,
        configuration: configuration.text(),
        lease,
        user_data: String::new(),
        service: names::address_of_requests,
    })
}
