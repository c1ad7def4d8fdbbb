//! The commands of the pages that need the installed tools and components only: those in blocks
//! ```` ```console ```` with the mark `installed`. `deploy/tests/docs/book.rs` compares what they print.

use crate::named;
use rc_vocabulary::shell;
use std::fmt::Write as _;
use std::path::Path;

/// Before the commands: a home folder of their own, `$PAGES`, which has the networks that pages name.
/// `$PATROL` is the network of the README. No network outlives a command that fails.
const PRELUDE: &str = "set -eu
trap 'for network in patrol robot; do rcdeploy down $network > /dev/null 2>&1 || :; done' EXIT
export HOME=\"$PAGES\"
mkdir -p \"$PAGES/components/networks\"
cp \"$PATROL\" \"$PAGES/components/networks/patrol.ddsl\"
sed 's/Deployment patrol/Deployment robot/' \"$PATROL\" > \"$PAGES/robot.ddsl\"
";

/// Runs `cargo xtask dist --pages`.
pub(crate) fn print() -> Result<(), String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    print!("{}", script(&root)?);
    Ok(())
}

/// The commands of all pages as a script for `sh`, which ends with the first one that does not do what
/// its page says.
pub(crate) fn script(root: &Path) -> Result<String, String> {
    let mut script = PRELUDE.to_owned();
    for page in pages(root)? {
        let path = root.join(&page);
        let text = std::fs::read_to_string(&path).map_err(named(&path))?;
        let commands = commands(&page, &text)?;
        if !commands.is_empty() {
            script += "cd \"$PAGES\"\n";
            script += &commands;
        }
    }
    Ok(script)
}

/// README.md, then the pages in the order of the book.
fn pages(root: &Path) -> Result<Vec<String>, String> {
    let summary = root.join("docs/SUMMARY.md");
    let text = std::fs::read_to_string(&summary).map_err(named(&summary))?;
    let links = text.split("](").skip(1);
    let links = links.filter_map(|rest| rest.split(')').next());
    let mut all = vec!["README.md".to_owned()];
    all.extend(links.map(|page| format!("docs/{page}")));
    Ok(all)
}

/// The commands of one page.
fn commands(page: &str, text: &str) -> Result<String, String> {
    let mut script = String::new();
    // The marks of the block around a line, and the commands in it with their lines.
    let mut marks: Vec<&str> = Vec::new();
    let mut block: Vec<(usize, String)> = Vec::new();
    let mut is_open = false;
    for (at, line) in text.lines().enumerate() {
        if let Some(information) = line.trim_start().strip_prefix("```") {
            is_open = !is_open;
            if is_open {
                marks = information.split(',').collect();
                // What looks like a command outside of a block is none.
                block.clear();
            } else if marks[0] == "console" && marks.contains(&"installed") {
                add(page, &marks, &block, &mut script)?;
            }
        } else if let Some(command) = line.strip_prefix("$ ") {
            block.push((at + 1, command.to_owned()));
        } else if let Some((_, command)) = block.last_mut().filter(|(_, of)| of.ends_with('\\')) {
            command.push('\n');
            command.push_str(line);
        }
    }
    Ok(script)
}

/// Adds the commands of a block.
fn add(
    page: &str,
    marks: &[&str],
    block: &[(usize, String)],
    script: &mut String,
) -> Result<(), String> {
    for (at, (line, command)) in block.iter().enumerate() {
        let is_last = at + 1 == block.len();
        if is_last && marks.contains(&"runs") {
            return Err(format!(
                "{page}:{line}: a command with the mark `installed` has to end"
            ));
        }
        let shown = shell::word(&format!("{page}:{line}: {command}"));
        let _ = writeln!(script, "echo {shown}");
        if is_last && marks.contains(&"fails") {
            let _ = writeln!(script, "if {command}\nthen echo 'it succeeds'; exit 1; fi");
        } else {
            let _ = writeln!(script, "{command}");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_with_the_mark_are_taken_in_their_order() {
        let page = "```console\n$ cargo build\n```\nThen:\n\n```console,not-run=x-y,installed\n$ a 'b' \\\n  c\nits output\n\
                    $ cd d\n```\n```console,installed,fails\n$ e\n```\n```text,installed\n$ f\n```\n";
        let script = commands("p.md", page).expect("commands");
        assert_eq!(
            script,
            "echo 'p.md:7: a '\\''b'\\'' \\\n  c'\na 'b' \\\n  c\necho 'p.md:10: cd d'\ncd d\n\
             echo 'p.md:13: e'\nif e\nthen echo 'it succeeds'; exit 1; fi\n"
        );
        let runs = "```console,runs,installed\n$ rcdeploy up a.ddsl\n```\n";
        let refused = commands("p.md", runs).expect_err("it would not end");
        assert!(refused.starts_with("p.md:2: "), "{refused}");
    }
}
