//! Packages of Python that the `dependencies` of a `.cdsl` name. They are the worker's own: rcgen
//! writes them into its `pyproject.toml` once, and compares afterwards.

use crate::python::names;
use pep440_rs::{Version, VersionSpecifiers};
use rc_cdsl::Component;
use rc_cdsl::model::Dependency;
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::path::Path;
use toml_edit::{DocumentMut, Item, Value};

/// Packages that every component in Python has.
const OURS: [&str; 2] = ["numpy", "robocomp"];

/// Reports names that cannot be packages, and versions that pip and uv do not understand.
pub(crate) fn check(component: &Component, found: &mut Diagnostics) {
    for dependency in &component.dependencies {
        let package = &dependency.package;
        if let Some(reason) = bad_name(dependency, &component.name.text) {
            let message = format!("`{}` cannot be a dependency: {reason}", package.text);
            found.push(Diagnostic::error("bad-dependency", package.span, message));
        }
        if let Some(version) = &dependency.version
            && specifier(&version.text).is_none()
        {
            let message = format!("`{}` is not a version of a package of Python", version.text);
            let help = "write the least version (`4.10`: below 5), or a specifier (`>=4.10,<4.12`)";
            found.push(Diagnostic::error("bad-dependency", version.span, message).help(help));
        }
        if let Some(path) = &dependency.path {
            let message = "a component in Python takes packages by their versions, not by a path";
            let help = format!(
                "install the folder into its environment: `pip install -e {}`",
                path.text
            );
            found.push(Diagnostic::error("bad-dependency", path.span, message).help(help));
        }
    }
}

/// The rules of `PyPI` for names, and the names of this project.
fn bad_name(dependency: &Dependency, component: &str) -> Option<&'static str> {
    let name = &dependency.package.text;
    let follows = |c: char| c.is_ascii_alphanumeric() || ['-', '_', '.'].contains(&c);
    let same = normal(name);
    let is_numpy_with_version = same == "numpy" && dependency.version.is_some();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        Some("its name must begin with a letter")
    } else if !name.chars().all(follows) || name.ends_with(['-', '_', '.']) {
        Some("its name must consist of letters, digits, `-`, `_` and `.`")
    } else if name.len() > 64 {
        Some("its name is longer than 64 characters")
    } else if OURS.contains(&same.as_str()) && !is_numpy_with_version {
        Some("every component has it")
    } else if same == normal(&names::package(component)) {
        Some("it is the component itself")
    } else if !dependency.default_features {
        Some("packages of Python have no default features")
    } else if !dependency.components.is_empty() {
        Some("packages of Python have no components")
    } else {
        None
    }
}

/// A name as `PyPI` compares it (PEP 503).
fn normal(name: &str) -> String {
    let words = name.split(['-', '_', '.']).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-").to_lowercase()
}

/// The specifiers of a version. A version without an operator is the least one, below the next
/// major one, as in the `.cdsl` of a component in Rust.
fn specifier(text: &str) -> Option<VersionSpecifiers> {
    let text = text.trim();
    if text == "*" {
        return Some(VersionSpecifiers::empty());
    }
    if !text.starts_with(|c: char| c.is_ascii_digit()) {
        return text.parse().ok();
    }
    let version: Version = text.parse().ok()?;
    let next = version.release().first()?.checked_add(1)?;
    format!(">={version},<{next}").parse().ok()
}

/// A dependency as a requirement (PEP 508).
fn requirement(dependency: &Dependency) -> String {
    let extras: Vec<&str> = dependency
        .features
        .iter()
        .map(|f| f.text.as_str())
        .collect();
    let extras = if extras.is_empty() {
        String::new()
    } else {
        format!("[{}]", extras.join(","))
    };
    let version = dependency.version.as_ref();
    let version = version.and_then(|version| specifier(&version.text));
    let version = version.unwrap_or_default();
    let parts: Vec<String> = version.iter().map(ToString::to_string).collect();
    let version = parts.join(",");
    format!("{}{extras}{version}", dependency.package.text)
}

/// A dependency as an item of the list in `pyproject.toml`.
pub(crate) fn line(dependency: &Dependency) -> String {
    Value::from(requirement(dependency)).to_string()
}

/// The dependencies that the worker's `pyproject.toml` in `folder` lacks, and warnings for those
/// and for others than the description has. Without a manifest, or with one that is not TOML, there
/// is nothing to compare.
pub(crate) fn compare<'a>(
    component: &'a Component,
    folder: &Path,
) -> (Vec<&'a Dependency>, Diagnostics) {
    let (mut missing, mut found) = (Vec::new(), Diagnostics::new());
    let path = folder.join("pyproject.toml");
    let text = rc_files::read(&path).unwrap_or_default();
    let Ok(manifest) = text.parse::<DocumentMut>() else {
        return (missing, found);
    };
    if text.is_empty() {
        return (missing, found);
    }
    let project = manifest.get("project").and_then(Item::as_table_like);
    let there = project.and_then(|project| project.get("dependencies"));
    let there = there.and_then(Item::as_array).into_iter().flatten();
    let there: Vec<&str> = there.filter_map(Value::as_str).collect();
    let path = path.display();
    for dependency in &component.dependencies {
        let package = &dependency.package;
        let wanted = normal(&package.text);
        let end = |text: &&&str| {
            let end = text.find(|c: char| !(c.is_alphanumeric() || "-_.".contains(c)));
            normal(&text[..end.unwrap_or(text.len())]) == wanted
        };
        let message = match there.iter().find(end) {
            None => {
                missing.push(dependency);
                format!("{path} does not have the dependency `{}`", package.text)
            }
            Some(text) if fits(dependency, text) => continue,
            Some(text) => format!("{path} has another dependency `{}`: {text}", package.text),
        };
        let help = format!("write `{}` there", line(dependency));
        found.push(Diagnostic::warning("dependency-differs", package.span, message).help(help));
    }
    (missing, found)
}

/// Whether the user's requirement has what the description asks for; more is the user's choice.
fn fits(dependency: &Dependency, there: &str) -> bool {
    let there = there.split(';').next().unwrap_or_default();
    let (head, specifiers) = there.split_once(']').unwrap_or_else(|| {
        let end = there.find(|c| "<>=!~".contains(c));
        there.split_at(end.unwrap_or(there.len()))
    });
    let extras: Vec<&str> = head.split(['[', ',']).skip(1).map(str::trim).collect();
    let Ok(specifiers) = specifiers.trim().parse::<VersionSpecifiers>() else {
        return false;
    };
    let version = dependency.version.as_ref();
    let wanted = version.and_then(|version| specifier(&version.text));
    let mut features = dependency.features.iter();
    wanted.is_none_or(|wanted| {
        wanted
            .iter()
            .all(|one| specifiers.iter().any(|other| other == one))
    }) && features.all(|extra| extras.contains(&extra.text.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_become_specifiers() {
        for (text, wanted) in [
            ("4.10", Some(">=4.10,<5")),
            ("2", Some(">=2,<3")),
            (">=4.9, <4.11", Some(">=4.9,<4.11")),
            ("==1.*", Some("==1.*")),
            ("*", Some("")),
            ("new", None),
            ("^1.2", None),
            ("1..2", None),
            ("1.2rc1", Some(">=1.2rc1,<2")),
            ("1.2.post3", Some(">=1.2.post3,<2")),
            ("18446744073709551615", None),
            ("~=1.4", Some("~=1.4")),
            ("~=1", None),
            ("4.x", None),
            (">=1.*", None),
            (">=", None),
        ] {
            let found = specifier(text).map(|found| found.to_string().replace(", ", ","));
            assert_eq!(found.as_deref(), wanted, "{text}");
        }
        assert_eq!(
            normal("Ruamel_Yaml..CLib"),
            ["ruamel", "yaml", "clib"].join("-")
        );
    }
}
