//! Mermaid and Graphviz accept the output.

use super::fleet::fleet;
use super::goldens::{NETWORKS, draw};
use super::wrong::broken;
use rc_deploy_graph::GraphFormat;
use rc_test_support::debian;
use rc_test_support::python::{run, skipped};
use std::path::{Path, PathBuf};

/// Writes the graphs of all networks, of an invalid and of a large one.
fn files(folder: &Path, format: GraphFormat) -> Vec<String> {
    let mut texts: Vec<String> = NETWORKS.iter().map(|name| draw(name, format)).collect();
    texts.push(broken(folder).draw(format).expect("a picture"));
    texts.push(fleet(folder).draw(format).expect("a picture"));
    let write = |(number, text): (usize, &String)| {
        let path = folder.join(number.to_string());
        std::fs::write(&path, text).expect("a file");
        path.display().to_string()
    };
    texts.iter().enumerate().map(write).collect()
}

/// The words that start `dot`: that of the system, else one of Debian's packages below the target
/// folder. Its program finds plugins by variables and by a list, which it writes itself.
fn graphviz() -> Result<Vec<String>, String> {
    let words = |place: Option<&Path>| {
        let Some(place) = place else {
            return vec!["dot".to_owned()];
        };
        let library = format!("usr/lib/{}-linux-gnu", std::env::consts::ARCH);
        let library = place.join(library).display().to_string();
        let variables = [
            format!("GVBINDIR={library}/graphviz"),
            format!("LD_LIBRARY_PATH={library}:{library}/graphviz"),
        ];
        let dot = place.join("usr/bin/dot").display().to_string();
        let words = ["env".to_owned()].into_iter().chain(variables);
        words.chain([dot]).collect::<Vec<String>>()
    };
    let works = |place: Option<&Path>| {
        // An unpacked program has to write its list.
        let tried = if place.is_some() { "-c" } else { "-V" };
        let all = [words(place), vec![tried.to_owned()]].concat();
        all.split_first()
            .is_some_and(|(program, rest)| run(Path::new(program), rest).is_ok())
    };
    let place = debian::provided("graphviz --no-install-recommends", &works)?;
    Ok(words(place.as_deref()))
}

#[test]
fn graphviz_accepts_the_output() {
    let dot = match graphviz() {
        Ok(dot) => dot,
        Err(reason) => return skipped("graphviz_accepts_the_output", &reason),
    };
    let (program, first) = dot.split_first().expect("a program");
    let folder = tempfile::tempdir().expect("a folder");
    for file in files(folder.path(), GraphFormat::Dot) {
        let out = format!("{file}.svg");
        let words = ["-Tsvg", &file, "-o", &out].map(str::to_owned);
        run(Path::new(program), &[first, &words].concat()).expect("Graphviz reads it");
        let drawn = std::fs::read_to_string(out).expect("a picture");
        assert!(drawn.contains("<svg"));
    }
}

/// Installs Mermaid below the target folder, with a DOM, which its parser requires.
fn mermaid() -> Result<PathBuf, String> {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mermaid-10");
    let program = place.join("parse.mjs");
    if program.exists() {
        return Ok(program);
    }
    let new = place.with_extension(std::process::id().to_string());
    std::fs::create_dir_all(&new).map_err(|e| e.to_string())?;
    let path = new.display().to_string();
    let npm = ["install", "--prefix", &path, "--no-audit", "--no-fund"];
    let packages = ["--silent", "mermaid@10", "jsdom@22"];
    let all: Vec<&str> = npm.into_iter().chain(packages).collect();
    let made = run(Path::new("npm"), &all).and_then(|()| {
        let text = include_str!("parse.mjs");
        std::fs::write(new.join("parse.mjs"), text).map_err(|e| e.to_string())
    });
    if made.is_ok() && std::fs::rename(&new, &place).is_err() && !program.exists() {
        let _ = std::fs::remove_dir_all(&place);
        let _ = std::fs::rename(&new, &place);
    }
    let _ = std::fs::remove_dir_all(&new);
    made.map(|()| program)
}

#[test]
fn mermaid_accepts_the_output() {
    let program = match mermaid() {
        Ok(program) => program.display().to_string(),
        Err(reason) => {
            skipped("mermaid_accepts_the_output", &reason);
            return;
        }
    };
    let folder = tempfile::tempdir().expect("a folder");
    let files = files(folder.path(), GraphFormat::Mermaid);
    let all: Vec<&str> = [&program]
        .into_iter()
        .chain(&files)
        .map(String::as_str)
        .collect();
    run(Path::new("node"), &all).expect("Mermaid reads them");
}
