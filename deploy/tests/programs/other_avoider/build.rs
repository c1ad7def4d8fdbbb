//! Makes the policy of the avoider with one other constant.

use std::path::Path;

/// How strongly the robot leans towards an opening, as the avoider has it and as this program has
/// it.
const CHANGE: [&str; 2] = ["const LEAN: f32 = 0.8;", "const LEAN: f32 = 0.79;"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let policy = "../../../../components/avoider/src/policy.rs";
    println!("cargo::rerun-if-changed={policy}");
    let text = std::fs::read_to_string(policy)?;
    let changed = text.replacen(CHANGE[0], CHANGE[1], 1);
    if changed == text {
        return Err(format!("{policy} has no `{}`", CHANGE[0]).into());
    }
    // An included file has no documentation of its own.
    let lines = changed.lines().filter(|line| !line.starts_with("//!"));
    let lines: Vec<&str> = lines.collect();
    let out = std::env::var("OUT_DIR")?;
    std::fs::write(Path::new(&out).join("policy.rs"), lines.join("\n"))?;
    Ok(())
}
