//! Which web pages may connect. A browser lets every page connect to this machine, so a page of a
//! stranger could move the robot.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

/// Whether a page of this origin is served: of Foxglove, of this machine, of an application that
/// brings its own pages (`file://`, `app://`), or of one that was allowed.
pub(crate) fn is_allowed(origin: &str, allowed: &[String]) -> bool {
    let origin = origin.to_ascii_lowercase();
    let is_named = |one: &String| one.trim_end_matches('/').eq_ignore_ascii_case(&origin);
    if allowed.iter().any(is_named) {
        return true;
    }
    // The origin of a page that hides its own is `null`.
    let Some((scheme, authority)) = origin.split_once("://") else {
        return false;
    };
    match scheme {
        "http" | "https" => {
            let Some(host) = host(authority) else {
                return false;
            };
            let is_own = host == "localhost" || host.parse().is_ok_and(is_loopback);
            let is_foxglove = host == "foxglove.dev" || host.ends_with(".foxglove.dev");
            is_own || (scheme == "https" && is_foxglove)
        }
        // The pages of Foxglove's application. Extensions of a browser have schemes of their own.
        "file" | "app" | "foxglove" => true,
        _ => false,
    }
}

/// The host of `HOST[:PORT]`, an IPv6 address without its brackets. An origin has nothing else (RFC
/// 6454); a text with more is none.
fn host(authority: &str) -> Option<&str> {
    let (host, rest) = match authority.strip_prefix('[') {
        Some(address) => {
            let (address, rest) = address.split_once(']')?;
            address.parse::<Ipv6Addr>().ok()?;
            (address, rest)
        }
        None => authority.split_at(authority.find(':').unwrap_or(authority.len())),
    };
    let is_port = |port: &str| {
        let is_number = port.bytes().all(|digit| digit.is_ascii_digit());
        is_number && port.parse::<u16>().is_ok()
    };
    let has_port = rest.is_empty() || rest.strip_prefix(':').is_some_and(is_port);
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | ':');
    (has_port && !host.is_empty() && host.chars().all(is_name)).then_some(host)
}

fn is_loopback(address: IpAddr) -> bool {
    match address {
        IpAddr::V4(address) => address == Ipv4Addr::LOCALHOST,
        IpAddr::V6(address) => address == Ipv6Addr::LOCALHOST,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_of_strangers_are_refused() {
        let named = ["https://viewer.example/".to_owned()];
        for (origin, is_served) in [
            ("https://app.foxglove.dev", true),
            ("https://foxglove.dev:8443", true),
            ("http://app.foxglove.dev", false),
            ("https://evilfoxglove.dev", false),
            ("https://foxglove.dev.evil.example", false),
            ("http://localhost:8080", true),
            ("http://[::1]:8080", true),
            ("https://localhost.evil.example", false),
            ("http://[::1].evil.com", false),
            ("http://[::1]evil.com:80", false),
            ("http://[::1", false),
            ("http://[0:0:0:0:0:0:0:1]", true),
            ("http://127.0.0.1", true),
            ("http://127.0.0.1.evil.com", false),
            ("http://localhost:80.evil.com", false),
            ("http://localhost:99999", false),
            ("http://localhost@evil.com", false),
            ("http://localhost/evil", false),
            ("http://evil.com:80@localhost", false),
            ("https://evil.com?.foxglove.dev", false),
            ("https://evil.com#.foxglove.dev", false),
            ("https://.foxglove.dev:443@evil.com", false),
            ("http://", false),
            ("https://viewer.example", true),
            ("https://other.example", false),
            ("file://", true),
            ("null", false),
            ("app://.", true),
            ("chrome-extension://abcdefgh", false),
            ("moz-extension://0-1-2", false),
            ("vscode-webview://abc", false),
        ] {
            assert_eq!(is_allowed(origin, &named), is_served, "{origin}");
        }
    }
}
