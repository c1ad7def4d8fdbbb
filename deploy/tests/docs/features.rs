//! The libraries that `up --build` builds one at a time have the same features as in the whole workspace. With others, cargo
//! would compile them anew, in the place of those that running programs and tests use.

use crate::markdown::ROOT;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

/// The packages of libraries for components in C++ and Python, whose files have no hash in their names.
const LIBRARIES: [&str; 4] = [
    "rc-cpp",
    "rc-python",
    "rc-python-graph",
    "rc-python-innermodel",
];

#[derive(Deserialize)]
struct Graph {
    units: Vec<Unit>,
}

#[derive(Deserialize)]
struct Unit {
    pkg_id: String,
    target: Target,
    mode: String,
    features: BTreeSet<String>,
}

#[derive(Deserialize)]
struct Target {
    name: String,
}

/// The sets of features of each target: build scripts and macros may have others than programs.
type Features = BTreeMap<(String, String), BTreeSet<BTreeSet<String>>>;

/// What cargo would compile.
fn graph(words: &[&str]) -> Features {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command
        .args(words)
        .args(["--unit-graph", "-Z", "unstable-options"])
        .current_dir(ROOT)
        // Stable cargo has the option, too.
        .env("RUSTC_BOOTSTRAP", "1");
    for name in ["RESOLVER", "UNSTABLE"] {
        command.env_remove(format!("CARGO_{name}_FEATURE_UNIFICATION"));
    }
    let printed = command.output().expect("cargo");
    let said = String::from_utf8_lossy(&printed.stderr);
    assert!(printed.status.success(), "{said}");
    let graph: Graph = serde_json::from_slice(&printed.stdout).expect("a graph");
    let mut features = Features::new();
    for unit in graph.units.into_iter().filter(|unit| unit.mode == "build") {
        let target = features.entry((unit.pkg_id, unit.target.name));
        target.or_default().insert(unit.features);
    }
    features
}

#[test]
fn a_library_has_the_features_of_the_whole_workspace() {
    let whole = graph(&["test", "--no-run", "--workspace"]);
    for package in LIBRARIES {
        let own = graph(&["build", "--package", package]);
        assert!(own.len() > 50, "{package}: {}", own.len());
        let mut other = Vec::new();
        for (target, sets) in own {
            let known = whole.get(&target).cloned().unwrap_or_default();
            if !sets.is_subset(&known) {
                other.push(format!(
                    "{} {}: {sets:?}, in the workspace {known:?}",
                    target.0, target.1
                ));
            }
        }
        assert!(
            other.is_empty(),
            "add the features to the manifest of {package}:\n{}",
            other.join("\n")
        );
    }
}
