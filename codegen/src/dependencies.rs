//! Crates that the `dependencies` of a `.cdsl` name, as cargo takes them.

use rc_cdsl::Component;
use rc_diagnostics::{Diagnostic, Diagnostics};
use semver::VersionReq;
use std::path::Path;

/// Reports names that cannot be packages, and versions that cargo does not understand. A
/// requirement that begins with `.` or `/` is a path.
pub(crate) fn check(component: &Component, found: &mut Diagnostics) {
    for (package, requirement) in &component.dependencies {
        if let Some(reason) = bad_name(&package.text) {
            let message = format!(
                "`{}` cannot be the name of a package: {reason}",
                package.text
            );
            found.push(Diagnostic::error("bad-dependency", package.span, message));
        }
        if is_path(&requirement.text) {
            continue;
        }
        if let Err(error) = VersionReq::parse(&requirement.text) {
            let message = format!("`{}` is not a version: {error}", requirement.text);
            let error = Diagnostic::error("bad-dependency", requirement.span, message);
            found.push(
                error.help("write a version as in Cargo.toml (`0.2`), or a path (`../crate`)"),
            );
        }
    }
}

/// The rules of `cargo new` and of crates.io for names.
fn bad_name(name: &str) -> Option<&'static str> {
    let follows = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        Some("it must begin with a letter")
    } else if !name.chars().all(follows) {
        Some("it must consist of letters, digits, `-` and `_`")
    } else if name.len() > 64 {
        Some("it is longer than 64 characters")
    } else if name == "interfaces" {
        Some("it is the crate of the interfaces")
    } else {
        None
    }
}

fn is_path(requirement: &str) -> bool {
    requirement.starts_with(['.', '/'])
}

/// The value of a dependency in the manifest in `generated/`: a version, or a path, which leads
/// from the folder of the `.cdsl` in the description.
pub(crate) fn value(requirement: &str) -> String {
    let text = |text: &str| toml_edit::Value::from(text).to_string();
    if requirement.starts_with('.') {
        let path = Path::new("..").join(requirement);
        format!("{{ path = {} }}", text(&path.to_string_lossy()))
    } else if is_path(requirement) {
        format!("{{ path = {} }}", text(requirement))
    } else {
        text(requirement)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_one_value_of_toml() {
        for requirement in [
            "0.2",
            ">=1, <2",
            "../map",
            "./a\"b",
            "/opt/x\\y\nz",
            "\" }\n[bin]",
        ] {
            let manifest = format!("[dependencies]\nlib = {}\n", value(requirement));
            let manifest: toml_edit::DocumentMut = manifest.parse().expect("TOML");
            let lib = &manifest["dependencies"]["lib"];
            let text = lib.as_str().or_else(|| lib["path"].as_str());
            assert!(
                text.is_some_and(|text| text.ends_with(requirement)),
                "{lib}"
            );
            assert_eq!(manifest.len(), 1, "{requirement}");
        }
        assert_eq!(value("../map"), "{ path = \"../../map\" }");
        assert_eq!(value("0.2"), "\"0.2\"");
    }
}
