//! Which web pages may connect. A browser lets every page connect to this machine, so a page of a
//! stranger could move the robot.

/// Whether a page of this origin is served: of Foxglove, of this machine, of an application that
/// brings its own pages (`file://`, `app://`), or of one that was allowed.
pub(crate) fn is_allowed(origin: &str, allowed: &[String]) -> bool {
    let origin = origin.to_ascii_lowercase();
    let is_named = |one: &String| one.trim_end_matches('/').eq_ignore_ascii_case(&origin);
    if allowed.iter().any(is_named) {
        return true;
    }
    // The origin of a page that hides its own is `null`.
    let Some((scheme, rest)) = origin.split_once("://") else {
        return false;
    };
    let host = match rest.strip_prefix('[') {
        Some(address) => address.split(']').next().unwrap_or_default(),
        None => rest.split(':').next().unwrap_or_default(),
    };
    match scheme {
        "http" | "https" => {
            let is_own = matches!(host, "localhost" | "127.0.0.1" | "::1");
            let is_foxglove = host == "foxglove.dev" || host.ends_with(".foxglove.dev");
            is_own || (scheme == "https" && is_foxglove)
        }
        // The pages of Foxglove's application. Extensions of a browser have schemes of their own.
        "file" | "app" | "foxglove" => true,
        _ => false,
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
