//! The configuration of Cyclone DDS, from the settings of `[middleware.dds]`.

use rc_middleware::{Environment, OpenError};

/// Sizes of a packet and of a fragment in it: the largest of UDP. Samples of a megabyte take half
/// the time that they take with the library's defaults, 14,720 and 1,344.
const PACKET: &str = "65500B";
const FRAGMENT: &str = "65000B";
/// Most unconfirmed bytes of a writer of calls. At half of this the library asks its readers to
/// confirm, which they do not do by themselves while samples arrive; at all of this it waits for
/// them.
const UNCONFIRMED: &str = "1MiB";
/// Size of the largest sample; both sides refuse larger ones.
const LARGEST: &str = "128MiB";

/// How often a process announces itself within its lease. Multicast loses some announcements, and a
/// process may have to wait for a processor.
const ANNOUNCEMENTS: u32 = 4;

/// What the backend reads from the settings.
pub(crate) struct Config {
    pub(crate) domain: u32,
    pub(crate) xml: String,
}

/// Reads the settings. The error about an unknown network interface lists the existing ones.
pub(crate) fn of(environment: &Environment) -> Result<Config, OpenError> {
    let settings = &environment.settings;
    let domain = settings.int(crate::NAME, "domain").unwrap_or_default();
    let domain = u32::try_from(domain)
        .map_err(|_| refused(environment, format!("there is no domain {domain}")))?;
    let known = rc_ddsc::interfaces();
    let mut interfaces = String::new();
    for wanted in settings.texts(crate::NAME, "interfaces") {
        let kind = if known.iter().any(|(name, _)| name == wanted) {
            "name"
        } else if known.iter().any(|(_, address)| address == wanted) {
            "address"
        } else {
            let known = known.iter().map(|(name, at)| format!("{name} ({at})"));
            let known: Vec<String> = known.collect();
            let known = known.join(", ");
            let reason = format!("there is no network interface `{wanted}`; there are {known}");
            return Err(refused(environment, reason));
        };
        interfaces += &format!("<NetworkInterface {kind}=\"{}\"/>", escaped(wanted));
    }
    if !interfaces.is_empty() {
        interfaces = format!("<Interfaces>{interfaces}</Interfaces>");
    }
    let multicast = match settings.bool(crate::NAME, "multicast") {
        Some(false) => "<AllowMulticast>false</AllowMulticast>",
        _ => "",
    };
    // The library keeps looking for a machine that is off.
    let peer = |peer: &String| {
        let address = escaped(peer);
        format!("<Peer Address=\"{address}\" PruneDelay=\"inf\"/>")
    };
    let peers = settings.texts(crate::NAME, "peers");
    let peers: String = peers.iter().map(peer).collect();
    // Other processes look for this one by address at known ports. With multicast, the library
    // chooses any port.
    let index = match peers.as_str() {
        "" => "default",
        _ => "auto",
    };
    let lease = settings.duration(crate::NAME, "lease");
    let lease = lease.ok_or_else(|| refused(environment, "there is no lease".to_owned()))?;
    let announce = (lease / ANNOUNCEMENTS).as_nanos();
    let lease = lease.as_nanos();
    let xml = format!(
        "<CycloneDDS><Domain Id=\"any\">\
         <General>{interfaces}{multicast}<MaxMessageSize>{PACKET}</MaxMessageSize>\
         <FragmentSize>{FRAGMENT}</FragmentSize></General>\
         <Discovery><ExternalDomainId>{domain}</ExternalDomainId><LeaseDuration>{lease}ns</LeaseDuration>\
         <SPDPInterval>{announce}ns</SPDPInterval>\
         <ParticipantIndex>{index}</ParticipantIndex><Peers>{peers}</Peers></Discovery>\
         <Internal><Watermarks><WhcAdaptive>false</WhcAdaptive>\
         <WhcHighInit>{UNCONFIRMED}</WhcHighInit><WhcHigh>{UNCONFIRMED}</WhcHigh></Watermarks>\
         <MaxSampleSize>{LARGEST}</MaxSampleSize></Internal></Domain></CycloneDDS>"
    );
    // A variable that is set for a single start comes last and wins.
    let xml = match std::env::var("CYCLONEDDS_URI") {
        Ok(uri) if !uri.trim().is_empty() => format!("{xml},{uri}"),
        _ => xml,
    };
    Ok(Config { domain, xml })
}

pub(crate) fn refused(environment: &Environment, reason: String) -> OpenError {
    OpenError::Backend {
        address: environment.network.clone(),
        reason,
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}
