//! Reads pages of Markdown: code blocks, links and headings.

use std::path::{Path, PathBuf};

/// This project.
pub(crate) const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// A page, as `docs/time.md`.
pub(crate) struct Page {
    pub(crate) path: String,
    pub(crate) text: String,
}

/// A fenced code block: ```` ```TAG,MARK,… ````.
pub(crate) struct Block {
    /// PAGE:LINE, for messages.
    pub(crate) place: String,
    pub(crate) tag: String,
    /// Marks after the tag. Readers do not see them.
    pub(crate) marks: Vec<String>,
    pub(crate) text: String,
}

impl Block {
    pub(crate) fn has(&self, mark: &str) -> bool {
        self.marks.iter().any(|m| m == mark)
    }

    /// VALUE of the mark `NAME=VALUE`.
    pub(crate) fn value(&self, name: &str) -> Option<&str> {
        let mut marks = self.marks.iter();
        marks.find_map(|mark| mark.strip_prefix(name)?.strip_prefix('='))
    }

    /// The file that the block is, if its first line is a comment with a name: `// guard.cdsl`.
    pub(crate) fn file(&self) -> Option<&str> {
        let first = self.text.lines().next()?;
        let name = first
            .strip_prefix("// ")
            .or_else(|| first.strip_prefix("# "))?;
        let is_path = name
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || b"./_-".contains(&b));
        (is_path && name.contains('.')).then_some(name)
    }
}

fn read(path: &str) -> Page {
    let text = std::fs::read_to_string(Path::new(ROOT).join(path));
    Page {
        path: path.to_owned(),
        text: text.unwrap_or_else(|error| panic!("{path}: {error}")),
    }
}

/// README.md, then the pages of `docs` in the order of SUMMARY.md.
pub(crate) fn book() -> Vec<Page> {
    let summary = read("docs/SUMMARY.md");
    let listed = summary.links().into_iter();
    let mut pages = vec![read("README.md")];
    pages.extend(listed.map(|(_, target)| read(&format!("docs/{target}"))));
    pages
}

/// The files of Markdown whose links are checked: the book, and the pages for developers.
pub(crate) fn all() -> Vec<Page> {
    let mut all = book();
    let others = [
        "docs/SUMMARY.md",
        "ARCHITECTURE.md",
        "BENCHMARKS.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "middleware/dds/README.md",
        "middleware/ros2/README.md",
    ];
    all.extend(others.map(read));
    all
}

impl Page {
    /// The lines, with their numbers, and whether they are in a code block.
    fn lines(&self) -> Vec<(usize, bool, &str)> {
        let mut inside = false;
        let lines = self.text.lines().enumerate().map(|(at, line)| {
            let fence = line.trim_start().starts_with("```");
            inside ^= fence;
            (at + 1, inside || fence, line)
        });
        lines.collect()
    }

    pub(crate) fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let mut open = false;
        for (at, line) in self.text.lines().enumerate() {
            let fence = line.trim_start().strip_prefix("```");
            match (fence, open) {
                (Some(info), false) => {
                    let mut words = info.split(',').map(|word| word.trim().to_owned());
                    blocks.push(Block {
                        place: format!("{}:{}", self.path, at + 1),
                        tag: words.next().unwrap_or_default(),
                        marks: words.collect(),
                        text: String::new(),
                    });
                }
                (None, true) => {
                    let block = blocks.last_mut().expect("an open block");
                    block.text += line;
                    block.text.push('\n');
                }
                _ => {}
            }
            open ^= fence.is_some();
        }
        assert!(!open, "{}: a code block does not end", self.path);
        blocks
    }

    /// Line and target of each link and picture outside of code.
    pub(crate) fn links(&self) -> Vec<(usize, String)> {
        let mut links = Vec::new();
        for (at, code, line) in self.lines() {
            if code {
                continue;
            }
            let text: String = line.split('`').step_by(2).collect();
            let targets = text.split("](").skip(1);
            let targets = targets.filter_map(|rest| rest.split(')').next());
            links.extend(targets.map(|target| (at, target.to_owned())));
        }
        links
    }

    /// The anchors of the headings, as GitHub and mdBook make them.
    pub(crate) fn anchors(&self) -> Vec<String> {
        let headings = self.lines().into_iter().filter(|(_, code, _)| !code);
        let headings = headings.filter_map(|(_, _, line)| {
            let text = line.trim_start_matches('#');
            (text.len() < line.len()).then(|| text.strip_prefix(' '))?
        });
        let kept = |c: &char| c.is_alphanumeric() || "-_ ".contains(*c);
        headings
            .map(|text| text.to_lowercase().chars().filter(kept).collect::<String>())
            .map(|text| text.trim().replace(' ', "-"))
            .collect()
    }

    pub(crate) fn folder(&self) -> PathBuf {
        let path = Path::new(ROOT).join(&self.path);
        path.parent().expect("a folder").to_path_buf()
    }
}
