//! Addresses of hosts.

use std::net::Ipv6Addr;

/// The host of components without the field `host`.
pub(crate) const LOCALHOST: &str = "localhost";

/// The corrected text for `text`, unless it is a host name or an IP address.
pub(crate) fn wrong_address(text: &str) -> Option<String> {
    let is_name = |text: &str| {
        let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
        !text.is_empty() && !text.starts_with('-') && text.chars().all(allowed)
    };
    // A zone may follow: `fe80::1%eth0`.
    let is_ipv6 = |text: &str| {
        let (number, zone) = text.split_once('%').unwrap_or((text, "zone"));
        number.parse::<Ipv6Addr>().is_ok() && is_name(zone)
    };
    let is_host = |text: &str| is_name(text) || is_ipv6(text);
    if is_host(text) {
        return None;
    }
    let is_port = |text: &str| text.parse::<u16>().is_ok();
    let inside = text.strip_prefix('[').and_then(|text| text.split_once(']'));
    let help = match (text.split_once('@'), inside, text.rsplit_once(':')) {
        (Some((user, host)), ..) if is_name(user) && is_host(host) => {
            format!("write the user as a field of its own: `address \"{host}\"; user \"{user}\";`")
        }
        (_, Some((host, "")), _) if is_ipv6(host) => {
            format!("write it without brackets: `address \"{host}\";`")
        }
        (_, Some((host, port)), _)
            if is_ipv6(host) && port.strip_prefix(':').is_some_and(is_port) =>
        {
            with_port(host, &port[1..])
        }
        (.., Some((host, port))) if is_name(host) && is_port(port) => with_port(host, port),
        _ => "write a host name or an IP address: `robot.local` or `10.0.0.2`".to_owned(),
    };
    Some(help)
}

/// How to set another ssh port of a host.
fn with_port(host: &str, port: &str) -> String {
    format!(
        "write `address \"{host}\";`, and the port into ~/.ssh/config, from which `rcdeploy` and ssh have it: `Host {host}` and below it `Port {port}`"
    )
}
