//! Failed tests of a run, from the output of cargo and of the stable test harness.
//!
//! Output and errors of cargo have to be one stream: then each target is a block of lines that
//! begins with cargo's `Running …`, holds the harness's `failures:` and `test result: …`, and ends
//! with cargo's `error: test failed, to rerun pass …` if it failed.

use std::collections::VecDeque;

/// The output about one target.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Block {
    /// Source and executable of the target, as cargo prints them.
    pub(crate) program: String,
    /// How many tests passed.
    pub(crate) passed: usize,
    /// The tests that the harness lists as failed.
    pub(crate) failed: Vec<String>,
    /// The arguments with which cargo runs this target again. Only a failed target has them.
    pub(crate) rerun: Option<String>,
    /// Why `failed` may be incomplete, if it may.
    pub(crate) doubt: Option<&'static str>,
    /// The last lines, which tell how a target ended that does not list its failed tests.
    pub(crate) tail: VecDeque<String>,
}

/// The doubt about a target that a signal has ended, for example.
pub(crate) const ENDED: &str = "it ended without a list of failed tests";

/// How many of the last lines a block keeps.
const TAIL: usize = 8;

/// Reads the output of `cargo test --no-fail-fast` line by line.
#[derive(Debug, Default)]
pub(crate) struct Report {
    blocks: Vec<Block>,
    /// Lines since the last line `failures:`, as long as all of them are names of tests.
    listed: Option<Vec<String>>,
    /// The targets that cargo lists as failed at its end.
    closing: Option<Vec<String>>,
}

impl Report {
    pub(crate) fn note(&mut self, line: &str) {
        if let Some(program) = running(line) {
            self.listed = None;
            self.closing = None;
            self.blocks.push(Block {
                program: program.to_owned(),
                ..Block::default()
            });
        } else if line.starts_with("error: ") && line.ends_with(" failed:") {
            self.closing = Some(Vec::new());
        } else if let Some(targets) = &mut self.closing {
            let target = line.strip_prefix("    `").and_then(|l| l.strip_suffix('`'));
            targets.extend(target.map(str::to_owned));
        } else if let Some(block) = self.blocks.last_mut() {
            block.tail.push_back(line.to_owned());
            if block.tail.len() > TAIL {
                block.tail.pop_front();
            }
            if line == "failures:" {
                self.listed = Some(Vec::new());
            } else if let Some((passed, failed)) = result(line) {
                // A test that fails may print the result of a run of its own. The harness prints the
                // true one last.
                block.passed = passed;
                block.failed = self.listed.take().unwrap_or_default();
                block.doubt = (block.failed.len() != failed)
                    .then_some("its list of failures and its result differ");
            } else if let Some(rerun) = rerun(line) {
                let doubt = if block.rerun.is_some() {
                    Some("it failed twice")
                } else if rerun.ends_with("--doc") {
                    Some("examples in documentation are not repeated")
                } else if block.failed.is_empty() {
                    Some(ENDED)
                } else {
                    None
                };
                block.doubt = block.doubt.or(doubt);
                block.rerun = Some(rerun.to_owned());
            } else if let Some(listed) = &mut self.listed
                && !line.is_empty()
            {
                match line.strip_prefix("    ") {
                    Some(name) => listed.push(name.to_owned()),
                    None => self.listed = None,
                }
            }
        }
    }

    /// The targets that failed, or why the output does not tell them.
    pub(crate) fn failed(&self) -> Result<Vec<&Block>, &'static str> {
        let failed: Vec<&Block> = self.blocks.iter().filter(|b| b.rerun.is_some()).collect();
        let mut seen: Vec<&String> = failed.iter().filter_map(|b| b.rerun.as_ref()).collect();
        let mut closing: Vec<&String> = self.closing.iter().flatten().collect();
        seen.sort_unstable();
        closing.sort_unstable();
        if closing.is_empty() {
            Err("cargo lists no failed targets")
        } else if seen != closing {
            Err("cargo lists other failed targets at its end")
        } else {
            Ok(failed)
        }
    }

    /// Whether the target of `first`, which did not list its failed tests, passed in this second run.
    pub(crate) fn passes_whole(&self, first: &Block) -> bool {
        let second = self.blocks.iter().find(|b| b.program == first.program);
        second.is_some_and(|second| second.rerun.is_none() && second.passed > 0)
    }

    /// Whether `test`, one of the failed tests of `first`, passed in this second run of them.
    pub(crate) fn passes_again(&self, first: &Block, test: &String) -> bool {
        let second = self.blocks.iter().find(|b| b.program == first.program);
        second.is_some_and(|second| {
            second.doubt.is_none()
                && !second.failed.contains(test)
                && second.passed + second.failed.len() == first.failed.len()
        })
    }
}

/// The target of which cargo says that it runs now.
fn running(line: &str) -> Option<&str> {
    let program = line.strip_prefix("     Running ");
    let program = program.filter(|p| p.ends_with(')') && p.contains(" ("));
    program.or_else(|| line.strip_prefix("   Doc-tests "))
}

/// How many tests passed and failed, in the last line of the harness.
fn result(line: &str) -> Option<(usize, usize)> {
    let counts = line.strip_prefix("test result: ")?.split_once(". ")?.1;
    let (passed, rest) = counts.split_once(" passed; ")?;
    let (failed, _) = rest.split_once(" failed; ")?;
    Some((passed.parse().ok()?, failed.parse().ok()?))
}

/// The arguments with which cargo runs a failed target again. A program that was killed may have
/// left half a line before them.
fn rerun(line: &str) -> Option<&str> {
    let (_, rest) = line
        .split_once("error: test failed, to rerun pass `")
        .or_else(|| line.split_once("error: doctest failed, to rerun pass `"))?;
    rest.strip_suffix('`')
}

#[cfg(test)]
mod tests;
