//! A port of the domain that another program occupies.

use rc_middleware::{Environment, RunDirectory, Settings, WakeEvent};
use rc_vocabulary::Value;
use std::net::UdpSocket;

#[test]
fn an_occupied_port_is_named() {
    let network = format!("ports-{}", std::process::id());
    let environment = |domain: u32| {
        let mut settings = Settings::default();
        settings.set("dds", "domain", Value::Int(domain.into()));
        settings.set("dds", "interfaces", Value::Texts(vec!["lo".to_owned()]));
        Environment {
            directory: RunDirectory::open(&network).expect("a run directory"),
            network: network.clone(),
            instance: "only".to_owned(),
            wake_event: WakeEvent::new().expect("a wake event"),
            settings,
        }
    };
    // A domain that no other test uses, and a port that is not shared.
    let free = |domain: &u32| UdpSocket::bind(("0.0.0.0", 7400 + 250 * *domain as u16)).ok();
    let (domain, taken) = (60..100)
        .find_map(|domain| Some((domain, free(&domain)?)))
        .expect("a domain");
    let port = taken.local_addr().expect("an address").port();
    let refused = rc_dds::connect(&environment(domain)).err();
    let refused = refused.expect("the port is taken").to_string();
    assert!(
        refused.contains(&format!("another program has UDP port {port}"))
            && refused.contains(&format!("ss -ulpn sport = :{port}"))
            && refused.contains("`domain`"),
        "{refused}"
    );
    drop(taken);
    let joined = rc_dds::connect(&environment(domain));
    assert!(joined.is_ok(), "{:?}", joined.err());
    drop(joined);
    let _ = environment(domain).directory.remove();
}
