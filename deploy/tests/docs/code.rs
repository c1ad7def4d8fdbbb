//! The code on the pages: every block is checked by the tools, or is a part of a file that is
//! compiled.

use crate::markdown::{Block, ROOT, book};
use rc_codegen::FileLoader;
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use std::path::Path;

/// Checks a description. The other descriptions of the page with a name are beside it.
fn describe(block: &Block, page: &[Block]) -> Result<(), String> {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(&path, text).expect("a file");
        path
    };
    for other in page {
        if let Some(name) = other.file() {
            write(name, &other.text);
        }
    }
    let path = match block.file() {
        Some(name) => folder.path().join(name),
        None => write(&format!("page.{}", block.tag), &block.text),
    };
    let (mut sources, mut found) = (SourceMap::new(), Diagnostics::new());
    let folders = ["components/networks", "kinematics/examples"];
    let loader = FileLoader::new(&folders.map(|folder| Path::new(ROOT).join(folder)));
    rcgen::check::file(&path, false, &mut sources, &loader, &[], &mut found).expect("a file");
    match render(&sources, &found, Format::Short) {
        told if told.is_empty() => Ok(()),
        told => Err(told),
    }
}

/// Checks a part of a network, in which names may be missing.
fn part_of_network(block: &Block) -> Result<(), String> {
    let mut sources = SourceMap::new();
    let text = format!("Deployment page {{\n{}}};", block.text);
    let source = sources.add("page.ddsl", text);
    let (_, found) = rc_ddsl::parse(&sources, source);
    match render(&sources, &found, Format::Short) {
        told if told.is_empty() => Ok(()),
        told => Err(told),
    }
}

/// Checks a configuration, or a part of a Cargo.toml.
fn configuration(block: &Block) -> Result<(), String> {
    if block.text.contains("[workspace") || block.text.contains("[dependencies]") {
        let read = block.text.parse::<toml_edit::DocumentMut>();
        return read.map(|_| ()).map_err(|error| error.to_string());
    }
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", &*block.text);
    let (_, found) = rc_configuration::check(&sources, source, None);
    // The parameters of a page that shows mistakes are checked by a test of its language.
    let unknown = |code: &str| code == "unknown-parameter" && !block.has("wrong");
    let wrong = found.iter().any(|d| !unknown(d.code));
    if wrong {
        Err(render(&sources, &found, Format::Short))
    } else {
        Ok(())
    }
}

/// Text without the white space at the beginning of its lines.
fn flat(text: &str) -> String {
    text.lines()
        .map(|line| line.trim().to_owned() + "\n")
        .collect()
}

/// Rust is a file or a module of the workspace that the book makes, or a part of a file of this
/// project.
fn rust(block: &Block) -> Result<(), String> {
    match (block.file(), block.value("in")) {
        // `book.rs` compiles it.
        (Some(_), None) => Ok(()),
        (None, None) if block.has("module") => Ok(()),
        (None, Some(file)) => {
            let text = std::fs::read_to_string(Path::new(ROOT).join(file));
            let text = flat(&text.map_err(|error| format!("{file}: {error}"))?);
            let mut parts = block.text.split("// …\n").map(flat);
            match parts.find(|part| !text.contains(part.trim())) {
                Some(part) => Err(format!("{file} does not contain\n{part}")),
                None => Ok(()),
            }
        }
        _ => Err("its first line names no file, and it has no mark `in=FILE` or `module`".into()),
    }
}

/// Checks a block. The error names the mistake.
fn check(block: &Block, page: &[Block]) -> Result<(), String> {
    match &*block.tag {
        "ddsl" if !block.text.contains("Deployment ") => part_of_network(block),
        "idsl" | "cdsl" | "pdsl" | "smdsl" | "scxml" | "ddsl" | "xml" | "gdsl" | "dproto"
        | "kdsl" | "graph" => describe(block, page),
        "toml" => configuration(block),
        "rust" | "lua" | "lisp" | "cpp" | "python" => rust(block),
        // `book.rs` runs it.
        "console" => Ok(()),
        // Grammars, output, types of other languages.
        "ebnf" | "text" | "idl" | "mermaid" => {
            let commands = ["$ ", "cargo ", "rcgen ", "rcdeploy ", "ros2 "];
            let is_command = |line: &str| commands.iter().any(|c| line.starts_with(c));
            if block.text.lines().any(is_command) {
                return Err("commands need the tag `console`".to_owned());
            }
            Ok(())
        }
        tag => Err(format!("the tag `{tag}` is not known")),
    }
}

#[test]
fn every_code_block_is_right() {
    let mut faults = Vec::new();
    for page in book() {
        let blocks = page.blocks();
        for block in &blocks {
            let wrong = block.has("wrong");
            match check(block, &blocks) {
                Err(fault) if !wrong => faults.push(format!("{}: {fault}", block.place)),
                Ok(()) if wrong => faults.push(format!("{}: it is not wrong", block.place)),
                _ => {}
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
