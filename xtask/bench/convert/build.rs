//! Prints the functions of the plans that the benchmark measures.

use rc_diagnostics::{Format, SourceMap, render};
use rc_plans::{Network, rust};
use rc_syntax::MemoryLoader;
use std::error::Error;
use std::path::Path;
use std::{env, fs};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=lidar.dproto");
    println!("cargo::rerun-if-changed=Cloud.idsl");
    let (text, idsl) = (
        fs::read_to_string("lidar.dproto")?,
        fs::read_to_string("Cloud.idsl")?,
    );
    let mut sources = SourceMap::new();
    let source = sources.add("lidar.dproto", text);
    let loader = MemoryLoader::new([("Cloud.idsl", idsl.as_str())]);
    let (library, found) = rc_prototypes::load(&mut sources, &loader, &[source]);
    if found.has_errors() {
        return Err(render(&sources, &found, Format::Short).into());
    }
    let network = Network::new(&library);
    let mut out = String::new();
    for (from, to) in [("scan", "point"), ("scan_pose", "pose")] {
        out += &rust(&network.plan(from, to).map_err(|e| e.to_string())?);
    }
    let folder = env::var("OUT_DIR")?;
    fs::write(Path::new(&folder).join("emitted.rs"), out)?;
    Ok(())
}
