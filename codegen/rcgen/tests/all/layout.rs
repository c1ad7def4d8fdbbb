//! `rust::worker` breaks lines as rustfmt does: compares many items of random lengths.

use rc_codegen::rust::worker;
use std::process::Command;

/// Deterministic random numbers (xorshift64).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 >> 33).expect("31 bits") % end
    }

    /// A name of up to `length` letters.
    fn name(&mut self, length: usize) -> String {
        let length = 1 + self.below(length);
        "abcdefghijklmnopqrstuvwxyz"[..length.min(26)].repeat(1 + length / 27)
    }

    fn names(&mut self, count: usize, length: usize) -> Vec<String> {
        let count = self.below(count) + 1;
        (0..count).map(|_| self.name(length)).collect()
    }
}

/// Prints `count` items and compares them with the output of rustfmt.
fn check(count: usize, mut item: impl FnMut(&mut Random) -> String) {
    let mut random = Random(0x5EED);
    let items: Vec<String> = (0..count).map(|_| item(&mut random)).collect();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("items.rs");
    let text = items.join("\n\n") + "\n";
    std::fs::write(&file, &text).expect("a file");
    let output = Command::new("rustfmt")
        .args(["--edition", "2024", "--check"])
        .arg(&file)
        .output()
        .expect("rustfmt starts");
    let report = String::from_utf8_lossy(&output.stdout);
    let error = String::from_utf8_lossy(&output.stderr);
    let first: Vec<&str> = report.lines().take(60).collect();
    assert!(output.status.success(), "{}\n{error}", first.join("\n"));
}

#[test]
fn signatures() {
    check(600, |random| {
        let mut args = vec!["&mut self".to_owned(), "ctx: &mut Context".to_owned()];
        let more = random.names(3, 20);
        args.extend(more.into_iter().map(|name| format!("{name}: {name}")));
        let head = format!("fn {}", random.name(26));
        let result = match random.below(3) {
            0 => String::new(),
            _ => format!(" -> Result<{}, {}>", random.name(26), random.name(26)),
        };
        let one = worker::signature(&head, &args, &result);
        format!("impl T {{\n    {one}\n        x;\n    }}\n}}")
    });
}

#[test]
fn imports() {
    check(400, |random| {
        let length = [6, 12, 26][random.below(3)];
        let mut items = random.names(20, length);
        items.sort();
        items.dedup();
        worker::imports(&random.name(20), &items)
    });
}
