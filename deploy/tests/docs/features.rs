//! The libraries that `up --build` builds one at a time have the same features as in the whole workspace. With others, cargo
//! would compile them anew, in the place of those that running programs and tests use.

use crate::markdown::ROOT;
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt;
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
    profile: BTreeMap<String, Value>,
    mode: String,
    features: BTreeSet<String>,
    dependencies: Vec<Dependency>,
}

#[derive(Deserialize)]
struct Target {
    name: String,
}

#[derive(Deserialize)]
struct Dependency {
    index: usize,
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (package, target) = (&self.pkg_id, &self.target.name);
        write!(f, "{package} {target} ({}) {:?}", self.mode, self.features)
    }
}

/// What cargo would compile, started in a folder.
fn graph(words: &[&str], folder: &str) -> Graph {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command
        .args(words)
        .args(["--unit-graph", "-Z", "unstable-options"])
        .current_dir(folder)
        // Stable cargo has the option, too.
        .env("RUSTC_BOOTSTRAP", "1");
    for name in ["RESOLVER", "UNSTABLE"] {
        command.env_remove(format!("CARGO_{name}_FEATURE_UNIFICATION"));
    }
    let printed = command.output().expect("cargo");
    let said = String::from_utf8_lossy(&printed.stderr);
    assert!(printed.status.success(), "{said}");
    let mut graph: Graph = serde_json::from_slice(&printed.stdout).expect("a graph");
    for unit in &mut graph.units {
        // `dev` and `test` are two names of equal settings.
        unit.profile.remove("name");
    }
    graph
}

/// A number for each unit of a graph. Units have the same one if cargo compiles them the same way, with the same
/// dependencies. A package can be compiled in two ways, for programs and for build scripts, so its features are not enough.
fn numbers(graph: &Graph, known: &mut HashMap<String, usize>) -> Vec<usize> {
    fn number(
        at: usize,
        graph: &Graph,
        known: &mut HashMap<String, usize>,
        done: &mut [Option<usize>],
    ) -> usize {
        if let Some(number) = done[at] {
            return number;
        }
        let unit = &graph.units[at];
        let below: BTreeSet<usize> = unit
            .dependencies
            .iter()
            .map(|dependency| number(dependency.index, graph, known, done))
            .collect();
        let Unit {
            pkg_id,
            target,
            profile,
            mode,
            features,
            ..
        } = unit;
        let name = &target.name;
        let key = format!("{pkg_id} {name} {mode} {features:?} {profile:?} {below:?}");
        let next = known.len();
        let number = *known.entry(key).or_insert(next);
        done[at] = Some(number);
        number
    }
    let mut done = vec![None; graph.units.len()];
    (0..graph.units.len())
        .map(|at| number(at, graph, known, &mut done))
        .collect()
}

#[test]
fn a_library_is_compiled_as_in_the_whole_workspace() {
    let mut known = HashMap::new();
    let whole = graph(&["test", "--no-run", "--workspace"], ROOT);
    let whole_numbers = numbers(&whole, &mut known);
    let in_whole: BTreeSet<usize> = whole_numbers.iter().copied().collect();
    for package in LIBRARIES {
        // As `rcdeploy` builds it in the workspace of a user, which is no folder of this one.
        let (manifest, settings) = (
            format!("{ROOT}/Cargo.toml"),
            format!("{ROOT}/.cargo/config.toml"),
        );
        let words = ["build", "--package", package, "--manifest-path", &manifest];
        let own = graph(&[&words[..], &["--config", &settings]].concat(), "/");
        assert!(own.units.len() > 50, "{package}: {}", own.units.len());
        let own_numbers = numbers(&own, &mut known);
        let is_other = |at: usize| !in_whole.contains(&own_numbers[at]);
        let mut other = Vec::new();
        for (at, unit) in own.units.iter().enumerate() {
            // Those above differ because of it.
            let mut below = unit.dependencies.iter();
            if !is_other(at) || below.any(|dependency| is_other(dependency.index)) {
                continue;
            }
            other.push(format!("{unit}, in the workspace:"));
            let same = |at: &usize| {
                let of = &whole.units[*at];
                of.pkg_id == unit.pkg_id && of.target.name == unit.target.name
            };
            for at in (0..whole.units.len()).filter(same) {
                let of = &whole.units[at];
                other.push(format!("    {of}"));
                let there: BTreeSet<usize> = of
                    .dependencies
                    .iter()
                    .map(|dependency| whole_numbers[dependency.index])
                    .collect();
                for dependency in &unit.dependencies {
                    if !there.contains(&own_numbers[dependency.index]) {
                        let wanted = &own.units[dependency.index];
                        other.push(format!("        without {wanted}"));
                    }
                }
            }
        }
        assert!(
            other.is_empty(),
            "add the features to the manifest of {package}:\n{}",
            other.join("\n")
        );
    }
}
