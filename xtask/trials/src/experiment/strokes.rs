//! Lines and key strokes of typed text, and of what a person types who has no generator.

use std::path::Path;

/// Typed text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Typed {
    pub(super) lines: usize,
    /// Without the blanks that an editor indents with; the end of a line counts.
    pub(super) keys: usize,
}

impl Typed {
    pub(super) fn of(text: &str) -> Self {
        Self::default().and(text)
    }

    /// Adds text. Blank lines do not count.
    pub(super) fn and(mut self, text: &str) -> Self {
        for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
            self.lines += 1;
            self.keys += line.chars().count() + 1;
        }
        self
    }
}

/// What a person types in place of the generator: the code that a diff without context adds in
/// `generated/`. Of a changed line, only the part that differs.
pub(super) fn by_hand(diff: &str) -> String {
    let mut out = String::new();
    let mut counts = false;
    let mut hunk = Hunk::default();
    for line in diff.lines() {
        if let Some(name) = line.strip_prefix("+++ ") {
            // Without what helps tests.
            let extension = Path::new(name).extension();
            let is_code = extension.is_some_and(|end| end == "rs" || end == "toml");
            counts = is_code && name.contains("/generated/") && !name.ends_with("/testing.rs");
        } else if line.starts_with("@@") || line.starts_with("diff ") {
            std::mem::take(&mut hunk).typed(&mut out);
        } else if let Some(text) = line.strip_prefix('-').filter(|_| counts) {
            hunk.removed.push(text.trim());
        } else if let Some(text) = line.strip_prefix('+').filter(|_| counts) {
            hunk.added.push(text.trim());
        }
    }
    hunk.typed(&mut out);
    out
}

/// Lines that a diff replaces by others.
#[derive(Default)]
struct Hunk<'a> {
    removed: Vec<&'a str>,
    added: Vec<&'a str>,
}

impl Hunk<'_> {
    fn typed(mut self, out: &mut String) {
        self.added.retain(|line| {
            let before = self.removed.iter().position(|removed| removed == line);
            before.map(|at| self.removed.remove(at)).is_none()
        });
        let mut removed = self.removed.iter().filter(|line| is_code(line));
        for line in self.added.iter().filter(|line| is_code(line)) {
            let line = without_hashes(line);
            let before = removed.next().map_or(String::new(), |l| without_hashes(l));
            out.push_str(difference(&before, &line));
            out.push('\n');
        }
    }
}

/// Whether a person types a line of generated code: no comment, no attribute, and nothing that is
/// only for tools: hashes, notes and descriptions in JSON.
fn is_code(line: &str) -> bool {
    let is_for_tools = line.contains("hash") || line.contains("const NOTE");
    !(is_for_tools
        || ["//", "#", "{\""]
            .iter()
            .any(|start| line.starts_with(start)))
}

/// A line with 1 in place of each number that is computed from a name or a type.
fn without_hashes(line: &str) -> String {
    let is_hash = |word: &str| match word.strip_prefix("0x") {
        Some(digits) => digits.len() > 6,
        None => word.len() > 6 && word.chars().all(|c| c.is_ascii_digit()),
    };
    let words = line.split_inclusive(|c: char| !c.is_ascii_alphanumeric());
    let words = words.map(|word| {
        let bare = word.trim_end_matches(|c: char| !c.is_ascii_alphanumeric());
        if is_hash(bare) {
            format!("1{}", &word[bare.len()..])
        } else {
            word.to_owned()
        }
    });
    words.collect()
}

/// The part of a line that differs from an earlier one.
fn difference<'a>(before: &str, line: &'a str) -> &'a str {
    let same = |pairs: &mut dyn Iterator<Item = (char, char)>| -> usize {
        let equal = pairs.take_while(|(a, b)| a == b);
        equal.map(|(a, _)| a.len_utf8()).sum()
    };
    let start = same(&mut line.chars().zip(before.chars()));
    let (line, before) = (&line[start..], &before[start..]);
    let end = same(&mut line.chars().rev().zip(before.chars().rev()));
    &line[..line.len() - end]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blanks_do_not_count() {
        let typed = Typed::of("  ab\n\n c\n").and("d");
        assert_eq!(typed, Typed { lines: 3, keys: 7 });
    }

    #[test]
    fn only_code_of_generated_files_counts() {
        let diff = "\
diff --git a/components/a/generated/src/slots.rs b/components/a/generated/src/slots.rs
--- a/components/a/generated/src/slots.rs
+++ b/components/a/generated/src/slots.rs
@@ -1 +1,4 @@
-moved();
+// A comment.
+    model_hash: 0x1,
+{\"name\":\"x\"}
+let x = 1;
+
+moved();
@@ -9 +12 @@
-    slots: &[ONE],
+    slots: &[ONE, TWO],
@@ -20,0 +24 @@
+    on_added query(\"added\", -2082992458, 0x390ee0e5eb0fec54, &[])
diff --git a/components/a/generated/src/testing.rs b/components/a/generated/src/testing.rs
--- a/components/a/generated/src/testing.rs
+++ b/components/a/generated/src/testing.rs
@@ -1,0 +2 @@
+fake();
diff --git a/components/a/a.cdsl b/components/a/a.cdsl
--- a/components/a/a.cdsl
+++ b/components/a/a.cdsl
@@ -1,0 +2 @@
+requires Laser;
";
        let typed = by_hand(diff);
        let expected = "let x = 1;\n\n, TWO\non_added query(\"added\", -1, 1, &[])\n";
        assert_eq!(typed.replace("\n\n", "\n"), expected.replace("\n\n", "\n"));
    }

    #[test]
    fn words_are_no_hashes() {
        assert_eq!(
            without_hashes("added(defaced, 12, 1234567)"),
            "added(defaced, 12, 1)"
        );
        assert_eq!(without_hashes("0xdeadbeef00"), "1");
        assert_eq!(difference("aXb", "aXXb"), "X");
        assert_eq!(difference("", "new"), "new");
        assert_eq!(difference("ä.", "ä!."), "!");
    }
}
