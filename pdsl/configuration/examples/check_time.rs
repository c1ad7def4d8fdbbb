//! `check_time FILE.pdsl FILE.toml COUNT`: checks a configuration so many times, and says how long
//! each check took, in nanoseconds. `cargo xtask bench parameters` runs it.

use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rc_pdsl::load;
use rc_syntax::MemoryLoader;
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [pdsl, toml, count] = arguments.as_slice() else {
        return Err("usage: check_time FILE.pdsl FILE.toml COUNT".into());
    };
    let mut sources = SourceMap::new();
    let source = sources.add(pdsl, std::fs::read_to_string(pdsl)?);
    let (parameters, found) = load(&mut sources, &MemoryLoader::default(), source);
    refuse(&sources, &found)?;
    let source = sources.add(toml, std::fs::read_to_string(toml)?);
    for _ in 0..count.parse()? {
        let start = Instant::now();
        let (configuration, found) = rc_configuration::check(&sources, source, parameters.as_ref());
        let took = start.elapsed();
        drop(configuration);
        refuse(&sources, &found)?;
        println!("{}", took.as_nanos());
    }
    Ok(())
}

fn refuse(sources: &SourceMap, found: &Diagnostics) -> Result<(), Failure> {
    if found.is_empty() {
        return Ok(());
    }
    Err(render(sources, found, Format::Short).into())
}
