//! The bill of materials: all crates that are linked into programs of the packages, as `CycloneDX`
//! 1.5 lists them.

use crate::build::{Build, output};
use crate::{named, selection};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Writes the bill into a folder, and returns its path.
pub(crate) fn write(build: &Build, out: &Path) -> Result<PathBuf, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut cargo = Command::new(cargo);
    cargo.args(["metadata", "--locked", "--format-version", "1"]);
    let machine = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    cargo
        .args(["--filter-platform", &machine])
        .current_dir(&build.root);
    let metadata: Value = serde_json::from_str(&output(&mut cargo)?)
        .map_err(|error| format!("cargo metadata: {error}"))?;
    let roots = selection::selected(build, &[])?.crates();
    let bill = bill(&metadata, &roots, &checksums(&build.root)?, &build.version)?;
    let place = out.join(format!("robocomp-{}.cdx.json", build.version));
    let text = serde_json::to_string_pretty(&bill).map_err(|error| error.to_string())?;
    std::fs::write(&place, text + "\n").map_err(named(&place))?;
    Ok(place)
}

/// The checksums of `Cargo.lock`, by name and version.
fn checksums(root: &Path) -> Result<BTreeMap<(String, String), String>, String> {
    let path = root.join("Cargo.lock");
    let text = std::fs::read_to_string(&path).map_err(named(&path))?;
    let value = |block: &str, key: &str| {
        let line = block.lines().find_map(|line| line.strip_prefix(key))?;
        Some(line.trim_start_matches(" = ").trim_matches('"').to_owned())
    };
    let blocks = text.split("[[package]]");
    let all = blocks.filter_map(|block| {
        let key = (value(block, "name")?, value(block, "version")?);
        Some((key, value(block, "checksum")?))
    });
    Ok(all.collect())
}

fn bill(
    metadata: &Value,
    roots: &BTreeSet<String>,
    checksums: &BTreeMap<(String, String), String>,
    version: &str,
) -> Result<Value, String> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let mut described = BTreeMap::new();
    for package in list(&metadata["packages"]) {
        described.insert(text(&package["id"]), package);
    }
    // What a crate links: neither tools of its build nor of its tests.
    let mut links: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for node in list(&metadata["resolve"]["nodes"]) {
        let linked = list(&node["deps"]).into_iter().filter(|dependency| {
            list(&dependency["dep_kinds"])
                .iter()
                .any(|kind| kind["kind"].is_null())
        });
        let linked = linked.map(|dependency| text(&dependency["pkg"]));
        links.insert(text(&node["id"]), linked.collect());
    }
    let named = |id: &String| described.get(id).map(|package| text(&package["name"]));
    let mut next: Vec<String> = links
        .keys()
        .filter(|id| named(id).is_some_and(|name| roots.contains(&name)))
        .cloned()
        .collect();
    if next.len() < roots.len() {
        return Err(format!("cargo metadata does not list all of {roots:?}"));
    }
    let mut seen = BTreeSet::new();
    while let Some(id) = next.pop() {
        if seen.insert(id.clone()) {
            next.extend(links.get(&id).into_iter().flatten().cloned());
        }
    }
    let address = |id: &String| {
        let package = &described[id];
        format!(
            "pkg:cargo/{}@{}",
            text(&package["name"]),
            text(&package["version"])
        )
    };
    let mut components: Vec<(String, Value)> = Vec::new();
    let mut dependencies: Vec<(String, Value)> = Vec::new();
    for id in &seen {
        let package = &described[id];
        let key = (text(&package["name"]), text(&package["version"]));
        let mut component = json!({
            "type": "library", "bom-ref": address(id), "name": key.0, "version": key.1, "purl": address(id),
        });
        if let Some(licence) = package["license"].as_str() {
            component["licenses"] = json!([{ "expression": licence.replace('/', " OR ") }]);
        }
        if let Some(checksum) = checksums.get(&key) {
            component["hashes"] = json!([{ "alg": "SHA-256", "content": checksum }]);
        }
        components.push((address(id), component));
        let on: BTreeSet<String> = links[id]
            .iter()
            .filter(|id| seen.contains(*id))
            .map(address)
            .collect();
        dependencies.push((address(id), json!({ "ref": address(id), "dependsOn": on })));
    }
    components.sort_by(|(a, _), (b, _)| a.cmp(b));
    dependencies.sort_by(|(a, _), (b, _)| a.cmp(b));
    let values =
        |all: Vec<(String, Value)>| all.into_iter().map(|(_, value)| value).collect::<Vec<_>>();
    Ok(json!({
        "bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
        "metadata": { "component": { "type": "application", "name": "robocomp", "version": version } },
        "components": values(components),
        "dependencies": values(dependencies),
    }))
}
