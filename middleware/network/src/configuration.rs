//! The configuration of Cyclone DDS: its XML.

use rc_diagnostics::xml::escaped;
use std::time::Duration;

/// Sizes of a packet and of a fragment in it: the largest of UDP, with room for the parameters of a
/// reply. Samples of a megabyte take half the time that they take with the library's defaults,
/// 14,720 and 1,344.
const PACKET: &str = "65500B";
const FRAGMENT: &str = "65000B";
/// Most unconfirmed bytes of a writer of calls. At half of this the library asks its readers to
/// confirm, which they do not do by themselves while samples arrive; at all of this it waits for
/// them.
const UNCONFIRMED: &str = "1MiB";
/// Size of the largest sample; both sides refuse larger ones.
const LARGEST: &str = "128MiB";

/// Wanted size of the receive buffer of a socket; the system grants at most `net.core.rmem_max`.
/// Others send the fragments of large samples at once.
const RECEIVE_BUFFER: &str = "16MiB";
/// Repair of losses. The library doubles the time between two heartbeats up to 8 s, and asks for
/// missing fragments after 100 ms, and again after 3 s. Fast DDS sends a heartbeat every 3 s, so an
/// answer to a request would wait for that.
const HEARTBEAT: &str = "100 ms";
const NACK: &str = "10 ms";
const NACK_AGAIN: &str = "200 ms";
/// Number of fragments that are sent at once to a reader that has none of a sample; the library
/// sends one, and waits until the reader asks for the others.
const REPEATED: u32 = 16;

/// How often a process announces itself within its lease. Multicast loses some announcements, and a
/// process may have to wait for a processor.
const ANNOUNCEMENTS: u32 = 4;

/// The configuration with which a component joins a domain.
#[derive(Clone, Debug)]
pub struct Joining {
    /// The name of the middleware: of its folder in the run directory, and of its thread.
    pub middleware: &'static str,
    /// The domain.
    pub domain: u32,
    /// The configuration of the library, see [`Configuration`].
    pub configuration: String,
    /// The silence after which others take this process for dead.
    pub lease: Duration,
    /// The user data of the participant.
    pub user_data: String,
    /// Gives the name of a service, for the topic of its requests.
    pub service: fn(&str) -> &str,
}

/// Configuration of the library, as far as a backend sets it.
#[derive(Clone, Debug)]
pub struct Configuration {
    domain: u32,
    lease: Duration,
    interfaces: String,
    peers: String,
    multicast: bool,
    known_ports: bool,
}

impl Configuration {
    /// The configuration of a domain. `lease`: the silence after which others take this process for
    /// dead.
    pub fn new(domain: u32, lease: Duration) -> Self {
        Self {
            domain,
            lease,
            interfaces: String::new(),
            peers: String::new(),
            multicast: true,
            known_ports: false,
        }
    }

    /// Adds a network interface, by its name or its address. The error about an unknown one lists
    /// the existing ones.
    pub fn interface(mut self, wanted: &str) -> Result<Self, String> {
        let known = rc_ddsc::interfaces();
        let kind = if known.iter().any(|(name, _)| name == wanted) {
            "name"
        } else if known.iter().any(|(_, address)| address == wanted) {
            "address"
        } else {
            let known = known.iter().map(|(name, at)| format!("{name} ({at})"));
            let known: Vec<String> = known.collect();
            let known = known.join(", ");
            return Err(format!(
                "there is no network interface `{wanted}`; there are {known}"
            ));
        };
        self.interfaces += &format!("<NetworkInterface {kind}=\"{}\"/>", escaped(wanted));
        Ok(self)
    }

    /// Adds a machine that discovery contacts by its address. The library keeps looking for a
    /// machine that is off.
    #[must_use]
    pub fn peer(mut self, address: &str) -> Self {
        let address = escaped(address);
        self.peers += &format!("<Peer Address=\"{address}\" PruneDelay=\"inf\"/>");
        self
    }

    /// Uses this machine alone, and looks there also for those who do not use multicast.
    #[must_use]
    pub fn localhost(mut self) -> Self {
        // By its address: the interface has no other name everywhere.
        self.interfaces += "<NetworkInterface address=\"127.0.0.1\"/>";
        self.peers += "<Peer Address=\"127.0.0.1\"/>";
        self
    }

    /// Receives at known ports, where programs without multicast look for participants of a
    /// machine. At most 100 participants of a machine can be in the domain then.
    #[must_use]
    pub fn known_ports(mut self) -> Self {
        self.known_ports = true;
        self
    }

    /// Discovers no participant, and no participant discovers it.
    #[must_use]
    pub fn without_discovery(mut self) -> Self {
        self.peers.clear();
        self.without_multicast()
    }

    /// Discovery uses no multicast.
    #[must_use]
    pub fn without_multicast(mut self) -> Self {
        self.multicast = false;
        self
    }

    /// The XML, then the variable `CYCLONEDDS_URI`: a setting for a single start comes last and
    /// takes precedence.
    pub fn text(&self) -> String {
        let Self {
            domain,
            lease,
            interfaces,
            peers,
            multicast,
            known_ports,
        } = self;
        let interfaces = match interfaces.as_str() {
            "" => String::new(),
            some => format!("<Interfaces>{some}</Interfaces>"),
        };
        let multicast = if *multicast {
            ""
        } else {
            "<AllowMulticast>false</AllowMulticast>"
        };
        // Other processes look for this one by address at known ports. With multicast, the library
        // chooses any port.
        let index = match peers.as_str() {
            "" if !known_ports => "default",
            _ => "auto",
        };
        let announce = (*lease / ANNOUNCEMENTS).as_nanos();
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
             <MaxSampleSize>{LARGEST}</MaxSampleSize>\
             <SocketReceiveBufferSize max=\"{RECEIVE_BUFFER}\"/>\
             <HeartbeatInterval max=\"{HEARTBEAT}\">{HEARTBEAT}</HeartbeatInterval>\
             <NackDelay>{NACK}</NackDelay><AutoReschedNackDelay>{NACK_AGAIN}</AutoReschedNackDelay>\
             <BurstSize><MaxFragsRexmitSample>{REPEATED}</MaxFragsRexmitSample></BurstSize>\
             </Internal></Domain></CycloneDDS>"
        );
        match std::env::var("CYCLONEDDS_URI") {
            Ok(uri) if !uri.trim().is_empty() => format!("{xml},{uri}"),
            _ => xml,
        }
    }
}
