//! `cargo xtask bench ice`: a query compared with the same query over Ice in C++, RoboComp's own
//! middleware.

use crate::bench::{BLOCKS, machine};
use crate::compare::{Peer, met};
use crate::figure::BUILD;
use crate::pair::{Pair, Row};
use crate::programs::{Failure, cargo, finish, root, target};
use std::borrow::Cow;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

/// The measured queries.
const ROWS: [Row; 2] = [
    Row {
        name: Cow::Borrowed("query 64 B, round trip"),
        kind: "query",
        size: 64,
        count: 1000,
    },
    Row {
        name: Cow::Borrowed("query 4 KiB, round trip"),
        kind: "query",
        size: 4096,
        count: 1000,
    },
];

/// Builds both sides, measures them, and prints the tables.
pub(crate) fn run() -> Result<(), Failure> {
    let echo = build()?;
    finish(
        cargo(&[
            "build",
            "--release",
            "--workspace",
            "--bin",
            "ping",
            "--bin",
            "pong",
        ])?,
        BUILD,
    )?;
    println!("{}\n", machine());
    let peer = Peer {
        name: "Ice",
        goal: 0.5,
    };
    let (mut ours, mut theirs) = (Pair::generated()?, Pair::ice(&echo)?);
    if !met(&peer.table(&ROWS, &mut ours, &mut theirs, BLOCKS, 1.0)?) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}

/// Compiles `xtask/bench/ice`; returns the program.
pub(crate) fn build() -> Result<PathBuf, Failure> {
    let source = root().join("xtask/bench/ice");
    let out = target()?.join("ice");
    std::fs::create_dir_all(&out)?;
    let mut translate = Command::new("slice2cpp");
    translate
        .arg("--output-dir")
        .arg(&out)
        .arg(source.join("Echo.ice"));
    run_tool(translate, "slice2cpp")?;
    let compiler = std::env::var_os("CXX").unwrap_or_else(|| OsString::from("c++"));
    let mut compile = Command::new(&compiler);
    compile.args(["-std=c++17", "-O2", "-DICE_CPP11_MAPPING", "-I"]);
    compile.arg(&out);
    compile.args([source.join("echo.cpp"), out.join("Echo.cpp")]);
    compile.arg("-o").arg(out.join("echo"));
    compile.args(["-lIce++11", "-pthread"]);
    run_tool(compile, &compiler.to_string_lossy())?;
    Ok(out.join("echo"))
}

/// Runs a tool of the system. If it or the headers of Ice are missing, the error says how to install them.
fn run_tool(command: Command, name: &str) -> Result<(), Failure> {
    let Err(error) = finish(command, BUILD) else {
        return Ok(());
    };
    let of_system = error.downcast_ref::<std::io::Error>();
    let is_missing = of_system.is_some_and(|e| e.kind() == std::io::ErrorKind::NotFound);
    // g++ and clang++ name a header that they do not find.
    let text = error.to_string();
    let lacks_header = text
        .lines()
        .any(|line| line.contains("fatal error:") && line.contains("Ice"));
    let what = if is_missing {
        name
    } else if lacks_header {
        "a header of Ice"
    } else {
        return Err(error);
    };
    Err(format!(
        "{what} is not there, and this benchmark needs Ice for C++; on Debian and Ubuntu: apt install zeroc-ice-all-dev g++"
    )
    .into())
}
