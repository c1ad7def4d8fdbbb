//! The settings of `[middleware.dds]` as Cyclone's configuration.

use rc_middleware::{Environment, OpenError};

/// How large a packet may be, and a fragment in it: the largest of UDP. Samples of a megabyte take half the time that
/// they take with the library's own 14,720 and 1,344.
const PACKET: &str = "65500B";
const FRAGMENT: &str = "65000B";
/// How much a writer of calls may have sent that is not confirmed. At half of it the library asks its readers, who do not
/// confirm by themselves as long as more comes; at all of it, it waits for them.
const UNCONFIRMED: &str = "1MiB";
/// A sample that is larger is refused on both sides.
const LARGEST: &str = "128MiB";

/// After how many milliseconds of silence a process counts as dead, and how often it is heard in that time: of what is
/// sent by multicast some is lost, and a process may have to wait for a processor.
const LEASE: u64 = 1000;
const ANNOUNCEMENTS: u64 = 4;

/// What the backend has to know beside the XML.
pub(crate) struct Config {
    pub(crate) domain: u32,
    pub(crate) xml: String,
}

/// Reads the settings. A wrong interface is told with the ones that there are.
pub(crate) fn of(environment: &Environment) -> Result<Config, OpenError> {
    let values = |key: &str| environment.settings.values(crate::NAME, key);
    let one = |key: &str| values(key).first().map(String::as_str);
    let domain = one("domain").map_or(Ok(0), str::parse);
    let domain: u32 =
        domain.map_err(|_| refused(environment, "`domain` is no number".to_owned()))?;
    let known = rc_ddsc::interfaces();
    let mut interfaces = String::new();
    for wanted in values("interfaces") {
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
    let multicast = match one("multicast") {
        Some("false") => "<AllowMulticast>false</AllowMulticast>",
        _ => "",
    };
    // A machine that is off for long is still asked for when it comes back.
    let peer = |peer: &String| {
        let address = escaped(peer);
        format!("<Peer Address=\"{address}\" PruneDelay=\"inf\"/>")
    };
    let peers: String = values("peers").iter().map(peer).collect();
    // Who is asked for by address has to listen where it is asked; with multicast, the library chooses any port.
    let index = match peers.as_str() {
        "" => "default",
        _ => "auto",
    };
    let lease = one("lease").map_or(Some(LEASE), rc_network::milliseconds);
    let lease = lease.ok_or_else(|| refused(environment, "`lease` is no time".to_owned()))?;
    let announce = lease / ANNOUNCEMENTS;
    let xml = format!(
        "<CycloneDDS><Domain Id=\"any\">\
         <General>{interfaces}{multicast}<MaxMessageSize>{PACKET}</MaxMessageSize>\
         <FragmentSize>{FRAGMENT}</FragmentSize></General>\
         <Discovery><ExternalDomainId>{domain}</ExternalDomainId><LeaseDuration>{lease}ms</LeaseDuration>\
         <SPDPInterval>{announce}ms</SPDPInterval>\
         <ParticipantIndex>{index}</ParticipantIndex><Peers>{peers}</Peers></Discovery>\
         <Internal><Watermarks><WhcAdaptive>false</WhcAdaptive>\
         <WhcHighInit>{UNCONFIRMED}</WhcHighInit><WhcHigh>{UNCONFIRMED}</WhcHigh></Watermarks>\
         <MaxSampleSize>{LARGEST}</MaxSampleSize></Internal></Domain></CycloneDDS>"
    );
    // What somebody sets for a single start wins.
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
