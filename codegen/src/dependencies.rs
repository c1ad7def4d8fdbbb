//! Crates that the `dependencies` of a `.cdsl` name. They are the worker's own: rcgen writes them
//! into its Cargo.toml once, and compares afterwards.

use crate::names;
use crate::paths::{absolute, normal, relative};
use rc_cdsl::Component;
use rc_cdsl::model::Dependency;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_vocabulary::Middleware;
use semver::VersionReq;
use std::path::Path;
use toml_edit::{Array, DocumentMut, InlineTable, Item, TableLike, Value};

/// Whether a worker reaches a crate through the generated crate of its component.
fn is_ours(package: &str) -> bool {
    let mut backends = Middleware::ALL.into_iter();
    ["rc-middleware", "rc-runtime"].contains(&package)
        || backends.any(|middleware| middleware.can().package.0 == package)
}

/// Reports names that cannot be packages, and versions that cargo does not understand.
pub(crate) fn check(component: &Component, found: &mut Diagnostics) {
    for dependency in &component.dependencies {
        let package = &dependency.package;
        let reason = if dependency.components.is_empty() {
            bad_name(&package.text, &component.name.text)
        } else {
            Some("a crate has no components")
        };
        if let Some(reason) = reason {
            let message = format!("`{}` cannot be a dependency: {reason}", package.text);
            found.push(Diagnostic::error("bad-dependency", package.span, message));
        }
        if let Some(version) = &dependency.version
            && let Err(error) = VersionReq::parse(&version.text)
        {
            let message = format!("`{}` is not a version: {error}", version.text);
            let error = Diagnostic::error("bad-dependency", version.span, message);
            found.push(
                error.help("write a version as in Cargo.toml (`0.2`), or a path (`../crate`)"),
            );
        }
    }
}

/// The rules of `cargo new` and of crates.io for names, and the names of this project.
fn bad_name(name: &str, component: &str) -> Option<&'static str> {
    let follows = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let own = names::package(component);
    let same = name.replace('_', "-");
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        Some("its name must begin with a letter")
    } else if !name.chars().all(follows) {
        Some("its name must consist of letters, digits, `-` and `_`")
    } else if name.len() > 64 {
        Some("its name is longer than 64 characters")
    } else if name == "interfaces" {
        Some("it is the crate of the interfaces")
    } else if is_ours(&same) {
        Some("the generated crate exports what a worker needs of it")
    } else if name == own || name == format!("{own}_generated") {
        Some("it is the component itself")
    } else {
        None
    }
}

/// A dependency as a manifest has it.
pub(crate) fn value(dependency: &Dependency) -> Value {
    let text = |name: &rc_syntax::Name| Value::from(name.text.as_str());
    let mut table = InlineTable::new();
    if let Some(path) = &dependency.path {
        table.insert("path", text(path));
    }
    if let Some(version) = &dependency.version {
        if dependency.path.is_none()
            && dependency.features.is_empty()
            && dependency.default_features
        {
            return text(version);
        }
        table.insert("version", text(version));
    }
    if !dependency.default_features {
        table.insert("default-features", false.into());
    }
    if !dependency.features.is_empty() {
        let features: Array = dependency
            .features
            .iter()
            .map(|f| f.text.as_str())
            .collect();
        table.insert("features", features.into());
    }
    Value::InlineTable(table)
}

/// A dependency as a line of a manifest.
pub(crate) fn line(dependency: &Dependency) -> String {
    format!(
        "{} = {}",
        dependency.package.text,
        value(dependency).to_string().trim()
    )
}

/// Lets paths, which lead from `own`, the folder of the `.cdsl`, lead from `folder`.
pub fn lead_from(component: &mut Component, own: &Path, folder: &Path) -> std::io::Result<()> {
    let (own, folder) = (absolute(own)?, absolute(folder)?);
    if own == folder {
        return Ok(());
    }
    for dependency in &mut component.dependencies {
        if let Some(path) = &mut dependency.path
            && !Path::new(&path.text).is_absolute()
        {
            let there = normal(&own.join(&path.text));
            path.text = relative(&folder, &there).to_string_lossy().into_owned();
        }
    }
    Ok(())
}

/// The dependencies that the worker's manifest in `folder` lacks, and warnings for those and for
/// others than the description has. Without a manifest, or with one that is not TOML, there is
/// nothing to compare.
pub(crate) fn compare<'a>(
    component: &'a Component,
    folder: &Path,
) -> (Vec<&'a Dependency>, Diagnostics) {
    let (mut missing, mut found) = (Vec::new(), Diagnostics::new());
    let path = folder.join("Cargo.toml");
    let text = rc_files::read(&path).unwrap_or_default();
    let Ok(manifest) = text.parse::<DocumentMut>() else {
        return (missing, found);
    };
    if text.is_empty() {
        return (missing, found);
    }
    let there = manifest.get("dependencies").and_then(Item::as_table_like);
    let path = path.display();
    for dependency in &component.dependencies {
        let package = &dependency.package;
        let message = match there.and_then(|there| there.get(&package.text)) {
            None => {
                missing.push(dependency);
                format!("{path} does not have the dependency `{}`", package.text)
            }
            Some(item) if fits(dependency, item) => continue,
            Some(item) => format!(
                "{path} has another dependency `{}`: {}",
                package.text,
                item.to_string().trim()
            ),
        };
        let help = format!("write `{}` there", line(dependency));
        found.push(Diagnostic::warning("dependency-differs", package.span, message).help(help));
    }
    (missing, found)
}

/// Whether the user's manifest has the dependencies of the description. One from its workspace
/// or from elsewhere is the user's choice.
fn fits(dependency: &Dependency, item: &Item) -> bool {
    let text = |wanted: &Option<rc_syntax::Name>, there: Option<&str>| match (wanted, there) {
        (Some(wanted), Some(there)) => wanted.text == there,
        _ => true,
    };
    if let Some(version) = item.as_str() {
        return dependency.path.is_none()
            && dependency.features.is_empty()
            && text(&dependency.version, Some(version));
    }
    let Some(table) = item.as_table_like() else {
        return false;
    };
    let word = |key: &str| table.get(key).and_then(Item::as_str);
    let features = features(table);
    let has = |name: &rc_syntax::Name| features.contains(&name.text.as_str());
    text(&dependency.version, word("version"))
        && text(&dependency.path, word("path"))
        && (dependency.path.is_none() || word("path").is_some() || !table.contains_key("version"))
        && dependency.features.iter().all(has)
}

fn features(table: &dyn TableLike) -> Vec<&str> {
    let features = table.get("features").and_then(Item::as_array);
    let features = features.into_iter().flatten();
    features.filter_map(Value::as_str).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_diagnostics::{SourceMap, Span};
    use rc_syntax::Name;

    fn dependency(version: Option<&str>, path: Option<&str>, features: &[&str]) -> Dependency {
        let span = Span::new(SourceMap::new().add("", ""), 0, 0);
        let name = |text: &str| Name::new(text, span);
        Dependency {
            package: name("lib"),
            version: version.map(name),
            path: path.map(name),
            features: features.iter().map(|text| name(text)).collect(),
            default_features: true,
            components: Vec::new(),
        }
    }

    #[test]
    fn dependencies_are_escaped_as_values_of_toml() {
        for text in [
            "0.2",
            ">=1, <2",
            "../map",
            "./a\"b",
            "/opt/x\\y\nz",
            "\" }\n[bin]",
        ] {
            for written in [
                dependency(Some(text), None, &[]),
                dependency(None, Some(text), &[]),
                dependency(Some(text), Some(text), &[text]),
            ] {
                let manifest = format!("[dependencies]\n{}\n", line(&written));
                let manifest: DocumentMut = manifest.parse().expect("TOML");
                let lib = &manifest["dependencies"]["lib"];
                let word = |key: &str| lib.get(key).and_then(Item::as_str);
                let value = [lib.as_str(), word("path"), word("version")];
                assert!(value.contains(&Some(text)), "{lib}");
                assert_eq!(manifest.len(), 1, "{text}");
                assert!(fits(&written, lib), "{lib}");
            }
        }
        let plain = dependency(Some("0.2"), None, &[]);
        assert_eq!(line(&plain), "lib = \"0.2\"");
        let rich = dependency(Some("1"), None, &["derive"]);
        assert_eq!(
            line(&rich),
            "lib = { version = \"1\", features = [\"derive\"] }"
        );
    }

    #[test]
    fn a_manifest_may_have_more_features_than_the_description() {
        let fits = |written: &Dependency, text: &str| {
            let manifest: DocumentMut = format!("lib = {text}").parse().expect("TOML");
            super::fits(written, &manifest["lib"])
        };
        let one = dependency(Some("1"), None, &["derive"]);
        assert!(fits(
            &one,
            "{ version = \"1\", features = [\"derive\", \"rc\"] }"
        ));
        assert!(!fits(&one, "\"1\""));
        assert!(!fits(&one, "{ version = \"2\", features = [\"derive\"] }"));
        let plain = dependency(Some("1"), None, &[]);
        assert!(fits(&plain, "{ workspace = true }"));
        assert!(fits(&plain, "{ git = \"https://x\" }"));
        assert!(!fits(&plain, "\"2\""));
        let near = dependency(None, Some("../lib"), &[]);
        assert!(!fits(&near, "\"1\""));
        assert!(!fits(&near, "{ path = \"../other\" }"));
        assert!(fits(&near, "{ path = \"../lib\" }"));
    }
}
