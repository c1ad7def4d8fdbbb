//! Packages of cmake that the clause `dependencies` names.

use rc_cdsl::Component;
use rc_diagnostics::{Diagnostic, Diagnostics};

/// Checks the clause `dependencies`: names of `find_package`, with a least version
/// and components.
pub(crate) fn check(component: &Component, found: &mut Diagnostics) {
    for dependency in &component.dependencies {
        let package = &dependency.package;
        let follows = |c: char| c.is_ascii_alphanumeric() || ['-', '_', '+', '.'].contains(&c);
        let mut bad = |name: &rc_syntax::Name, reason: &str| {
            let message = format!("`{}` cannot be a dependency of C++: {reason}", name.text);
            let help = "name a package of cmake with its least version or its components: `Eigen3 \"3.4\";`, `OpenCV { components \"core\"; };`";
            found.push(Diagnostic::error("bad-dependency", name.span, message).help(help));
        };
        if !package.text.chars().all(follows) {
            bad(
                package,
                "find_package takes letters, digits, `-`, `_`, `+` and `.`",
            );
        }
        if let Some(version) = &dependency.version
            && (version.text.is_empty()
                || !version.text.chars().all(|c| c.is_ascii_digit() || c == '.'))
        {
            bad(version, "a version of cmake has digits and dots");
        }
        if let Some(path) = &dependency.path {
            bad(
                path,
                "a folder is added in CMakeLists.txt, with add_subdirectory",
            );
        }
        if !dependency.features.is_empty() || !dependency.default_features {
            bad(package, "packages of cmake have no features");
        }
        for component in &dependency.components {
            if component.text.is_empty() || !component.text.chars().all(follows) {
                bad(
                    component,
                    "a component has letters, digits, `-`, `_`, `+` and `.`",
                );
            }
        }
    }
}
